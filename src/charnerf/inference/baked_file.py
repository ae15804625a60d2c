"""Baked characters as files: written once, looked at without any network.

A safetensors file in this layout; X, Y, Z points of the fine grid along the world's axes, x = (X - 1) / factor cells of the lattice
that it divides, likewise y and z; M rows; V drawings; C values that a colour is made of; metres:

    grid.low, grid.high, grid.origin   (3,) float32   where the character is; the grid's first point
    grid.u, grid.kept   (X, Y, Z) float32, float16    u and f of the density 20 softplus(u) min(f, 1), 1/m
    grid.errors         (x, y, z) float32             of densities in the lattice's cells, 1/m
    grid.color_index    (x + 1, y + 1, z + 1) int32   a lattice point's row in grid.color_rows
    grid.color_rows     (M, 9 C + 1) float32          coefficients of 9 polynomials of the direction for each of C values; error
    grid.gaps           (x, y, z) uint8               cells to the next one that holds something
    drawn.encoded       (V, 3, H, W) float32          drawings on white that colours are read from
    drawn.detailed      (V, 3, H', W') float32        the same with more pixels, where there are such
    drawn.poses, .focal, .principal_point, .orthographic   cameras of the drawings, as `charnerf.types.Cameras`
    views.images, .poses, .focal, .principal_point, .orthographic, .present, .mirrored   as `charnerf.types.SourceViews`

u and f, or the coefficients, are interpolated linearly between the eight points around a place. Values C of the head `blend` are
the scores of the V drawings, whose softmax mixes their colours, then a free colour and a gate before their sigmoids; of `radiance`
the colour before its sigmoid. The metadata say pitch, factor, tolerance, radius (that pictures frame) and head, as JSON.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from safetensors.torch import save
from torch import Tensor

from charnerf.config.foreign import parse_json
from charnerf.errors import DataError
from charnerf.files import write_aside
from charnerf.geometry.bounds import Bounds
from charnerf.inference.hero import Hero
from charnerf.inference.tensor_file import read_tensors
from charnerf.models.coloring import DrawnColoring
from charnerf.models.heads.base import AbstractHead
from charnerf.models.heads.blend import BlendHead
from charnerf.models.heads.radiance import RadianceHead
from charnerf.models.view_maps import Pictures
from charnerf.scene import Scene
from charnerf.types import Cameras, SourceViews
from charnerf.volume.baking.bake import Baked
from charnerf.volume.baking.directions import NUM_POLYNOMIALS
from charnerf.volume.baking.field import BakedField
from charnerf.volume.baking.grid import BakedGrid
from charnerf.volume.quadrature import PiecewiseConstant
from charnerf.volume.renderers.baked import BakedRenderer

FORMAT = "charnerf-baked-2"
HEADS: dict[str, type[AbstractHead]] = {"blend": BlendHead, "radiance": RadianceHead}
NUM_VALUES = {"blend": lambda views: views + 4, "radiance": lambda views: 3}
GRID = {
    "low": torch.float32, "high": torch.float32, "origin": torch.float32, "u": torch.float32,
    "kept": torch.float16, "errors": torch.float32, "color_index": torch.int32, "color_rows": torch.float32, "gaps": torch.uint8,
}  # fmt: skip
MOST = 1e9  # metres, pixels: squares of larger numbers are beyond what can be told apart, or finite
FINEST = 1e-5  # of a place: a ray that is told in 32 bits makes no way in cells much smaller
CAMERA = ("poses", "focal", "principal_point", "orthographic")


def save_baked(path: str | Path, hero: Hero) -> Path:
    """Write a baked character, beside and then renamed.

    Args:
        path: A .safetensors.
        hero: From `Hero.baked`.

    Returns:
        The file.

    Raises:
        DataError: If the character is not baked, or its colours are not made of drawings.
    """
    file, field = Path(path), hero.scene.field
    if not isinstance(field, BakedField) or not isinstance(field.paint, DrawnColoring):
        raise DataError(
            f"{file}: found a character that is not baked, or whose colours its field alone knows; expected one of "
            "hero.baked(), of a model whose density sees no direction, and not made symmetric."
        )
    grid, paint, views = field.grid, field.paint, hero.views
    (head,) = (name for name, known in HEADS.items() if known is paint.head)
    tensors = {f"grid.{name}": getattr(grid, name) for name in GRID}
    tensors |= {"drawn.encoded": paint.encoded.images, **_camera_tensors("drawn", paint.cameras)}
    if paint.detailed is not None:
        tensors["drawn.detailed"] = paint.detailed
    tensors |= {
        "views.images": views.images,
        "views.present": views.present,
        "views.mirrored": views.mirrored,
    }
    tensors |= _camera_tensors("views", views.cameras)
    tolerance = hero.renderer.tolerance if isinstance(hero.renderer, BakedRenderer) else 0.0
    facts = {
        "pitch": grid.pitch,
        "factor": grid.factor,
        "tolerance": tolerance,
        "radius": hero.radius(),
        "head": head,
    }
    with write_aside(file) as aside:
        whole = {name: one.detach().cpu().contiguous() for name, one in tensors.items()}
        aside.write_bytes(save(whole, metadata={"format": FORMAT, "baked": json.dumps(facts)}))
    return file


def load_baked(path: str | Path) -> Hero:
    """Read a baked character: it is looked at, and meshed, by its grid alone.

    Raises:
        DataError: If the file can not be read, or is not a whole baked character.
    """
    file = Path(path)
    tensors, facts = _read(file)
    try:
        grid = BakedGrid(
            **{name: tensors[f"grid.{name}"] for name in GRID}, pitch=facts["pitch"], factor=facts["factor"]
        )
        drawn = tensors["drawn.encoded"]
        for one in (drawn, tensors.get("drawn.detailed", drawn)):
            if one.ndim != len("VCHW") or one.shape[:2] != (len(drawn), 3) or not _is_sound(one):
                raise IndexError(f"drawn: pictures of shape {tuple(one.shape)} of {one.dtype}")
        cameras = _cameras(tensors, "drawn", drawn)
        encoded = Pictures.of(drawn, drawn.shape[-1])
        images = tensors["views.images"]
        views = SourceViews(
            images=images,
            cameras=_cameras(tensors, "views", images),
            present=tensors["views.present"],
            mirrored=tensors["views.mirrored"],
        )
    except (KeyError, IndexError, RuntimeError) as error:
        raise DataError(
            f"{file}: a part of a baked character is missing or wrong ({error}); bake it again."
        ) from error
    _check(file, grid, facts, views, len(drawn))
    paint = DrawnColoring(HEADS[facts["head"]], cameras, encoded, tensors.get("drawn.detailed"), encoded)
    baked = Baked(grid, 1, 0, 0, grid.u.numel(), 0.0)
    return Hero(
        scene=Scene(BakedField(baked, paint, None), None, Bounds(grid.low, grid.high)),
        views=views,
        renderer=_renderer(facts["tolerance"]),
        framed=facts["radius"],
    )


def _renderer(tolerance: float) -> BakedRenderer:
    """One for a grid; what samples rays of fields as `culled` has usual values."""
    return BakedRenderer(
        quadrature=PiecewiseConstant(),
        num_coarse=16,
        num_fine=0,
        hull_steps=128,
        memory_mib=256,
        tolerance=tolerance,
    )


def _camera_tensors(name: str, cameras: Cameras) -> dict[str, Tensor]:
    values = (cameras.world_from_camera, cameras.focal, cameras.principal_point, cameras.orthographic)
    return {f"{name}.{part}": value for part, value in zip(CAMERA, values, strict=True)}


def _cameras(tensors: Mapping[str, Tensor], name: str, pictures: Tensor) -> Cameras:
    parts = [tensors[f"{name}.{part}"] for part in CAMERA]
    shape = pictures.shape[:-3]
    for part, inner in zip(parts, ((4, 4), (2,), (2,), ()), strict=True):
        if part.shape != (*shape, *inner):
            raise IndexError(
                f"{name}: cameras of shape {tuple(part.shape)} for pictures {tuple(pictures.shape)}"
            )
    poses, focal, principal_point, orthographic = parts
    if not all(map(_is_sound, parts[:3])) or not bool((focal > 0).all()) or orthographic.dtype != torch.bool:
        raise IndexError(f"{name}: cameras with numbers that are not finite, or of no length")
    return Cameras(
        poses, focal, principal_point, orthographic, width=pictures.shape[-1], height=pictures.shape[-2]
    )


def _is_sound(values: Tensor) -> bool:
    """Whether they are numbers that can be computed with."""
    return values.dtype == torch.float32 and bool((values.abs() < MOST).all())


def _is_number(value: object) -> bool:
    """Whether JSON holds a number from 0 on that can be computed with."""
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value < MOST


def _read(file: Path) -> tuple[dict[str, Tensor], dict[str, Any]]:
    """Tensors by name, and what the metadata say."""
    tensors, metadata = read_tensors(
        file,
        file_format=FORMAT,
        expected="a baked character",
        otherwise="write one with `charnerf reconstruct --bake FILE`.",
    )
    read = parse_json(metadata.get("baked", ""), str(file))
    facts = read if isinstance(read, dict) else {}
    fits = (
        all(_is_number(facts.get(name)) for name in ("pitch", "tolerance", "radius"))
        and facts["pitch"] > 0
        and facts["radius"] > 0
        and type(facts.get("factor")) is int
        and 1 <= facts["factor"] <= 64
        and facts.get("head") in list(HEADS)
    )
    if not fits:
        raise DataError(
            f"{file}: found {facts} in its metadata, expected pitch, factor, tolerance, radius and head of a baked character."
        )
    return tensors, facts


def _check(file: Path, grid: BakedGrid, facts: Mapping[str, Any], views: SourceViews, num_drawn: int) -> None:
    """Check that a grid's parts fit each other: a row that is not there would be read from beyond the memory."""
    cells = grid.gaps.shape
    columns = NUM_POLYNOMIALS * NUM_VALUES[facts["head"]](num_drawn) + 1
    expected = {
        "low": (3,), "high": (3,), "origin": (3,),
        "u": (points := tuple(facts["factor"] * n + 1 for n in cells)),
        "kept": points,
        "errors": cells,
        "color_index": tuple(n + 1 for n in cells),
        "color_rows": (*grid.color_rows.shape[:1], columns),
    }  # fmt: skip
    for name, dtype in GRID.items():
        value = getattr(grid, name)
        shape = expected.get(name, tuple(value.shape))
        if (
            value.dtype != dtype
            or tuple(value.shape) != shape
            or (name == "gaps" and value.ndim != len("xyz"))
        ):
            raise DataError(
                f"{file}: grid.{name}: found {tuple(value.shape)} of {value.dtype}, expected {shape} of {dtype}."
            )
        if value.dtype.is_floating_point and not bool((value.abs() < MOST).all()):
            raise DataError(
                f"{file}: grid.{name}: found values that are not finite, or beyond {MOST:g}; bake it again."
            )
    _check_box(file, grid)
    if not grid.has_colors:
        raise DataError(
            f"{file}: grid.color_rows: found no colours, expected those of a character; bake it again."
        )
    low, high = (int(one) for one in torch.aminmax(grid.color_index))
    if low < 0 or high >= len(grid.color_rows):
        raise DataError(
            f"{file}: grid.color_index: found rows {low} to {high}, expected 0 to {len(grid.color_rows) - 1}."
        )
    marks = (views.present, views.mirrored)
    whole = (
        views.images.ndim == len("BVCHW")
        and views.images.shape[0] == 1
        and views.images.shape[2] == len("RGBA")
        and _is_sound(views.images)
    )
    if not whole or any(one.dtype != torch.bool or one.shape != views.images.shape[:2] for one in marks):
        raise DataError(
            f"{file}: views: found images {tuple(views.images.shape)}, expected (1, V, 4, H, W), and present and mirrored (1, V) "
            "of booleans."
        )


def _check_box(file: Path, grid: BakedGrid) -> None:
    """Check that rays leave the grid: they end at its box, which its cells reach."""
    far = torch.maximum(grid.low.abs(), grid.high.abs()).max()
    end = grid.origin + grid.pitch * (torch.tensor(grid.gaps.shape) + 1)
    if grid.pitch < FINEST * float(far) or bool(
        (grid.low < grid.origin - grid.pitch).any() | (grid.high > end).any()
    ):
        raise DataError(
            f"{file}: grid: found a box from {grid.low.tolist()} to {grid.high.tolist()} m, expected one within its cells of "
            f"{grid.pitch} m from {grid.origin.tolist()}; bake it again."
        )
