"""glTF files said plainly: what trimesh passes over, rewritten into what it reads.

Left are dense float positions and texture coordinates in TEXCOORD_0, rigid nodes, triangles, base colours of core
materials, and pictures in the file itself. Extensions that change shape or colour and are not done here are refused.
Sources: glTF 2.0 and the extensions' texts of the Khronos Group.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from charnerf.errors import DataError
from charnerf.surfaces.foreign_files import check_picture
from charnerf.surfaces.gltf_document import FLOAT, GltfDocument, uri_bytes
from charnerf.surfaces.gltf_poses import pose_meshes

_GLOSS, _TRANSFORM = "KHR_materials_pbrSpecularGlossiness", "KHR_texture_transform"
_PICTURE_KINDS = ("EXT_texture_webp", "EXT_texture_avif")  # as far as Pillow reads them
HONOURED = (_GLOSS, _TRANSFORM, "KHR_mesh_quantization", *_PICTURE_KINDS)
WITHOUT_EFFECT = (
    "KHR_lights_punctual",
    "KHR_animation_pointer",
    "KHR_xmp_json_ld",
)  # on base colours at rest
_INSTANCING = "EXT_mesh_gpu_instancing"
_FAN, _TRIANGLES = 6, 4


def make_plain(document: GltfDocument, neighbour: Callable[[str], bytes]) -> None:
    """Rewrite a document so that readers of the core alone see the whole character.

    Args:
        document: Changed.
        neighbour: Gives the bytes of a file beside it.

    Raises:
        DataError: If it needs an extension that is not honoured, or a picture is missing.
    """
    tree = document.tree
    _refuse_extensions(tree)
    for material in tree.get("materials", []):
        _take_diffuse(material)
    if "scenes" not in tree:
        inner = {child for node in tree.get("nodes", []) for child in node.get("children", [])}
        tree["scenes"] = [
            {"nodes": [index for index in range(len(tree.get("nodes", []))) if index not in inner]}
        ]
    pose_meshes(document)
    for mesh in tree.get("meshes", []):
        for primitive in mesh["primitives"]:
            _make_primitive_plain(document, primitive)
    _embed_pictures(document, neighbour)


def _refuse_extensions(tree: dict[str, Any]) -> None:
    accepted = {*HONOURED, *WITHOUT_EFFECT}
    required = tree.get("extensionsRequired", [])
    unknown = [name for name in required if name not in accepted and not name.startswith("KHR_materials_")]
    accessors = tree.get("accessors", [])
    for mesh in tree.get("meshes", []):
        for primitive in mesh["primitives"]:
            position = accessors[primitive["attributes"]["POSITION"]]
            if "bufferView" not in position and "sparse" not in position:
                unknown += primitive.get("extensions", {})
    unknown += [_INSTANCING for node in tree.get("nodes", []) if _INSTANCING in node.get("extensions", {})]
    if unknown:
        names = ", ".join(sorted(set(unknown)))
        raise DataError(f"needs the glTF extension {names}, which is not read; export it without.")


def _take_diffuse(material: dict[str, Any]) -> None:
    """Make the diffuse colour of a specular-glossiness material its base colour."""
    gloss = material.get("extensions", {}).pop(_GLOSS, None)
    if gloss is None:
        return
    names = {"diffuseFactor": "baseColorFactor", "diffuseTexture": "baseColorTexture"}
    material["pbrMetallicRoughness"] = {names[key]: gloss[key] for key in names if key in gloss}


def _make_primitive_plain(document: GltfDocument, primitive: dict[str, Any]) -> None:
    tree = document.tree
    attributes = {
        name: index
        for name, index in primitive["attributes"].items()
        if name.startswith(("POSITION", "TEXCOORD_", "COLOR_"))
    }
    primitive["attributes"] = attributes
    primitive.pop("extensions", None)
    if "material" in primitive:
        _place_texture(document, attributes, _base_texture(tree["materials"][primitive["material"]]))
    for name, index in attributes.items():
        entry = tree["accessors"][index]
        is_color = name.startswith("COLOR_")  # integer colours are read as they are
        if "sparse" in entry or (entry["componentType"] != FLOAT and not is_color):
            attributes[name] = document.add_accessor(document.accessor(index).astype(np.float64))
    if "indices" in primitive and "sparse" in tree["accessors"][primitive["indices"]]:
        primitive["indices"] = document.add_accessor(document.accessor(primitive["indices"]))
    if primitive.get("mode") == _FAN:
        _unfold_fan(document, primitive)


def _base_texture(material: dict[str, Any]) -> dict[str, Any]:
    return material.get("pbrMetallicRoughness", {}).get("baseColorTexture", {})


def _place_texture(document: GltfDocument, attributes: dict[str, int], texture: dict[str, Any]) -> None:
    """Move the coordinates that the base colour is read at into TEXCOORD_0, transformed."""
    transform = texture.get("extensions", {}).get(_TRANSFORM, {})
    name = f"TEXCOORD_{transform.get('texCoord', texture.get('texCoord', 0))}"
    if texture and name not in attributes:
        raise DataError(f"a material reads its picture at {name}, which the mesh has not; export it again.")
    if name not in attributes:
        return
    attributes["TEXCOORD_0"] = attributes[name]
    if {"offset", "rotation", "scale"} & set(transform):
        uvs = document.accessor(attributes[name]) @ _texture_matrix(transform).T + transform.get(
            "offset", (0.0, 0.0)
        )
        attributes["TEXCOORD_0"] = document.add_accessor(uvs)


def _texture_matrix(transform: dict[str, Any]) -> np.ndarray:
    """Rotation times scale (2, 2) of KHR_texture_transform.

    Counter-clockwise where v runs down, as Blender, three.js and Babylon do; the sines of the extension's GLSL listing have the
    other sign (KhronosGroup/glTF, issue 1563).
    """
    angle = transform.get("rotation", 0.0)
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array(((cosine, sine), (-sine, cosine))) @ np.diag(transform.get("scale", (1.0, 1.0)))


def _unfold_fan(document: GltfDocument, primitive: dict[str, Any]) -> None:
    if "indices" in primitive:
        corners = document.accessor(primitive["indices"])[:, 0].astype(np.int64)
    else:
        corners = np.arange(document.tree["accessors"][primitive["attributes"]["POSITION"]]["count"])
    triangles = np.stack((np.full(len(corners) - 2, corners[0]), corners[1:-1], corners[2:]), axis=-1)
    primitive.update(mode=_TRIANGLES, indices=document.add_accessor(triangles.reshape(-1, 1)))


def _embed_pictures(document: GltfDocument, neighbour: Callable[[str], bytes]) -> None:
    """Bring the base colours' pictures into the document, and see that they are pictures."""
    tree = document.tree
    used = {texture["index"] for texture in map(_base_texture, tree.get("materials", [])) if texture}
    for index in sorted({_source(tree["textures"][number]) for number in used}):
        image = tree["images"][index]
        uri = image.pop("uri", None)
        if uri is not None:
            image["bufferView"] = document.add_view(uri_bytes(uri, neighbour))
        name = (
            uri if uri is not None and not uri.startswith("data:") else image.get("name", f"number {index}")
        )
        check_picture(document.bytes_of_view(image["bufferView"]), name)


def _source(texture: dict[str, Any]) -> int:
    """Index of a texture's picture: its own, or else that of an extension that Pillow reads."""
    extensions = texture.pop("extensions", {})
    for name in _PICTURE_KINDS:
        if name in extensions:
            texture.setdefault("source", extensions[name]["source"])
    if "source" not in texture:
        needed = ", ".join(extensions) or "(none is named)"
        raise DataError(f"a texture needs the glTF extension {needed}, which is not read; export it without.")
    return int(texture["source"])
