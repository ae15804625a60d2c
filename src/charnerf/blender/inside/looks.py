"""Materials that a picture, a factor and corner colours say exactly; all others are baked."""

from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np

from charnerf.blender.inside.unlit import Source, source_of

CUTOFF = 0.5  # alpha below which a surface is not there, where the material names none
_STORED = {"sRGB": True, "Non-Color": False, "Linear Rec.709": False, "Linear": False}  # whether it is sRGB


class NotPlain(Exception):
    """A material that has to be baked; the message says why."""


@dataclass
class Look:
    """How a part looks: factor times picture times corner colours.

    Attributes:
        factor: Linear RGBA.
        image: The picture, if any.
        uv: UV map that it is read by; "" for the one that renders.
        affine: Picture from UV map, (2, 3).
        attribute: Colour attribute that is multiplied; "" for the one that renders.
        cutoff: Alpha below which the surface is not there.
    """

    factor: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    image: bpy.types.Image | None = None
    uv: str = ""
    affine: np.ndarray = field(default_factory=lambda: np.eye(2, 3))
    attribute: str | None = None
    cutoff: float | None = None


def plain_look(color: Source, alpha: Source) -> Look:
    """The look of a base colour and an alpha.

    Raises:
        NotPlain: If they can not be said so.
    """
    look = Look()
    _multiply(look, color)
    factor, look.cutoff = _alpha(look, alpha)
    look.factor = (*look.factor[:3], factor)
    return look


def _multiply(look: Look, source: Source) -> None:
    """Multiply a look's colour by a source."""
    if not isinstance(source, bpy.types.NodeSocket):
        value = source if len(source) > 1 else source * 3
        look.factor = (*(a * b for a, b in zip(look.factor[:3], value[:3], strict=True)), 1.0)
        return
    node = source.node
    if node.mute:
        raise NotPlain("muted nodes")
    if node.type == "RGB":
        _multiply(look, tuple(node.outputs[0].default_value))
    elif node.type == "TEX_IMAGE" and source.name == "Color":
        _take_image(look, node)
    elif node.type in ("VERTEX_COLOR", "ATTRIBUTE") and source.name == "Color":
        _take_attribute(look, node)
    elif node.type in ("MIX", "MIX_RGB"):
        for factor in _factors(node):
            _multiply(look, factor)
    else:
        raise NotPlain(f"the node {node.bl_label}")


def _factors(node: bpy.types.Node) -> tuple[Source, Source]:
    """The two sources that a mixing node multiplies."""
    sockets = [each for each in node.inputs if each.enabled]
    share, first, second = (source_of(each) for each in sockets)
    is_clamped = getattr(node, "clamp_result", False) or getattr(node, "use_clamp", False)
    if is_clamped or node.blend_type != "MULTIPLY" or share != (1.0,):
        raise NotPlain(f"a mix of colours ({node.blend_type.lower()})")
    return first, second


def _take_image(look: Look, node: Any) -> None:
    image = node.image
    if image is None:
        raise NotPlain("an image node without a picture")
    if look.image is not None:
        raise NotPlain("several pictures")
    if image.source not in ("FILE", "GENERATED") or image.is_float:
        raise NotPlain(f"a picture of the kind {'float' if image.is_float else image.source.lower()}")
    if image.colorspace_settings.name not in _STORED:
        raise NotPlain(f"a picture in the colour space {image.colorspace_settings.name}")
    if node.projection != "FLAT" or node.extension != "REPEAT":
        raise NotPlain(f"a picture that is laid on by {node.projection.lower()}, {node.extension.lower()}")
    look.image = image
    look.uv, look.affine = _coordinates(source_of(node.inputs["Vector"]))


def _coordinates(source: Source) -> tuple[str, np.ndarray]:
    """UV map and picture from UV map (2, 3) of an image node's vector."""
    if not isinstance(source, bpy.types.NodeSocket):
        return "", np.eye(2, 3)
    node = source.node
    if node.type == "UVMAP":
        return node.uv_map, np.eye(2, 3)
    if node.type == "TEX_COORD" and source.name == "UV":
        return "", np.eye(2, 3)
    if node.type != "MAPPING" or node.vector_type != "POINT":
        raise NotPlain(f"coordinates of the node {node.bl_label}")
    uv, inner = _coordinates(source_of(node.inputs["Vector"]))
    moved, turned, scaled = (source_of(node.inputs[name]) for name in ("Location", "Rotation", "Scale"))
    if any(isinstance(each, bpy.types.NodeSocket) for each in (moved, turned, scaled)) or any(turned[:2]):
        raise NotPlain("coordinates that are computed")
    cos, sin = np.cos(turned[2]), np.sin(turned[2])
    linear = np.array(((cos, -sin), (sin, cos))) @ np.diag(scaled[:2])
    return uv, np.column_stack((linear @ inner[:, :2], linear @ inner[:, 2] + moved[:2]))


def _take_attribute(look: Look, node: Any) -> None:
    is_named = node.type == "VERTEX_COLOR"
    if look.attribute is not None or (not is_named and node.attribute_type != "GEOMETRY"):
        raise NotPlain("several colour attributes, or those of objects")
    look.attribute = node.layer_name if is_named else node.attribute_name


def _alpha(look: Look, source: Source) -> tuple[float, float | None]:
    """Factor and cutoff of an alpha that is a number, or that of the look's picture, perhaps compared with one."""
    if not isinstance(source, bpy.types.NodeSocket):
        return source[0], None if source[0] >= 1.0 else CUTOFF
    node = source.node
    if node.type == "TEX_IMAGE" and source.name == "Alpha" and node.image == look.image is not None:
        return 1.0, CUTOFF
    if node.type != "MATH" or node.mute:
        raise NotPlain(f"the alpha of the node {node.bl_label}")
    first, second = (source_of(each) for each in node.inputs[:2])
    if node.operation == "MULTIPLY":
        if not isinstance(first, bpy.types.NodeSocket):
            first, second = second, first
        if not isinstance(second, bpy.types.NodeSocket):
            factor, cutoff = _alpha(look, first)
            return factor * second[0], cutoff
    elif node.operation == "ROUND":
        return _alpha(look, first)[0], CUTOFF
    elif node.operation == "GREATER_THAN" and not isinstance(second, bpy.types.NodeSocket):
        return _alpha(look, first)[0], second[0]
    elif node.operation == "SUBTRACT" and first == (1.0,) and isinstance(second, bpy.types.NodeSocket):
        less = second.node  # glTF's mask is imported as 1 - (alpha < cutoff)
        if less.type == "MATH" and less.operation == "LESS_THAN":
            compared, limit = (source_of(each) for each in less.inputs[:2])
            if not isinstance(limit, bpy.types.NodeSocket):
                return _alpha(look, compared)[0], limit[0]
    raise NotPlain(f"an alpha that is computed ({node.operation.lower()})")


def pixels_of(image: bpy.types.Image) -> np.ndarray:
    """A picture, uint8 (h, w, 4), sRGB-encoded, straight alpha, the first row on top."""
    from charnerf.surfaces.color import srgb_from_linear

    width, height = image.size
    flat = np.zeros(width * height * 4, np.float32)
    image.pixels.foreach_get(flat)
    values = flat.reshape(height, width, 4)[::-1]
    if image.is_float or not _STORED[image.colorspace_settings.name]:
        values = np.concatenate((srgb_from_linear(values[..., :3]), values[..., 3:]), axis=-1)
    return np.rint(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8)
