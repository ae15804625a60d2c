"""A seed becomes a person: a body in a stance, and what it wears."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np

from charnerf.errors import DataError
from charnerf.geometry.stances import draw_stance
from charnerf.geometry.world import HEIGHT
from charnerf.people.assets import BASE, RIG, Assets
from charnerf.people.body import draw_traits, shaped
from charnerf.people.garments import PLATES, body_faces, read_garment, skirt, vertex_normals
from charnerf.people.painting import (
    Color,
    cloth_color,
    dyed,
    eye_picture,
    hair_color,
    metal_color,
    skin_picture,
    worn_picture,
)
from charnerf.people.polygons import GroupedMesh, parse_obj
from charnerf.people.rig import Rig, posed_bones, read_rig, skinned
from charnerf.surfaces.color import linear_from_srgb
from charnerf.surfaces.surface_mesh import CUTOFF, SurfaceMaterial, SurfaceMesh, make_texture

PEOPLE_VERSION = 2  # raise it whenever the people of a seed change: caches are named after it
_ARMOURED, _SKIRTED, _HATTED, _BALD, _STYLISED = 0.35, 0.25, 0.12, 0.08, 0.4  # shares of the people


@dataclass(frozen=True)
class _Part:
    """Corners of triangles in the stance (f, 3, 3), MakeHuman's frame; a picture with corners' uvs (f, 3, 2), or a colour."""

    corners: np.ndarray
    uvs: np.ndarray
    picture: np.ndarray | None
    color: Color
    cut_out: bool = False


@dataclass
class _Figure:
    """A person as it is put together."""

    assets: Assets
    base: GroupedMesh
    rig: Rig
    body: np.ndarray
    transforms: np.ndarray
    parts: list[_Part] = field(default_factory=list)

    def add(
        self, points: np.ndarray, weights: np.ndarray, faces: np.ndarray, color: Color,
        picture: np.ndarray | None = None, uvs: np.ndarray | None = None, *, cut_out: bool = False,
    ) -> None:  # fmt: skip
        """Add triangles of points (n, 3) that hang on bones, with uvs of their corners (f, 3, 2)."""
        if len(faces):
            corners = skinned(points, weights, self.transforms)[faces]
            uvs = np.zeros((len(faces), 3, 2)) if uvs is None else uvs
            self.parts.append(_Part(corners, uvs, picture, color, cut_out))

    def wear(self, folder: Path, color: Color, *, dye: bool, cut_out: bool = False) -> np.ndarray:
        """Put on what a folder of the assets holds; the body's vertices that it hides."""
        garment = read_garment(self.assets, folder)
        picture = worn_picture(self.assets, folder, garment.picture)
        picture = dyed(picture, color) if picture is not None and dye else picture
        mesh, fitting = garment.mesh, garment.fitting
        points, weights = fitting.fitted(self.body), fitting.weights(self.rig.weights)
        self.add(points, weights, mesh.faces, color, picture, mesh.uvs[mesh.uv_faces], cut_out=cut_out)
        return fitting.hidden

    def joint(self, bone: str) -> np.ndarray:
        """Where a joint is in the stance, (3,)."""
        index = self.rig.bones.index(bone)
        return (self.transforms[index] @ np.append(self.body[self.rig.joints[index]].mean(axis=0), 1.0))[:3]


def make_person(seed: int, assets: Assets) -> SurfaceMesh:
    """A person.

    Args:
        seed: Any non-negative integer; equal seeds and assets give equal people.
        assets: What people are made of.

    Returns:
        World frame: 2 m tall, feet on z = 0, middle of its box on the z axis.

    Raises:
        DataError: If a file of the assets is missing or broken.
    """
    base, rig = _base(assets)
    try:
        return _person(np.random.default_rng(seed), assets, base, rig)
    except IndexError as err:
        raise DataError(
            f"{assets.root}: a file of the assets names a vertex that the base mesh has not ({err}); clone them again."
        ) from err


def _person(rng: np.random.Generator, assets: Assets, base: GroupedMesh, rig: Rig) -> SurfaceMesh:
    traits = draw_traits(rng, assets)
    body = shaped(base.vertices, traits, assets)
    figure = _Figure(assets, base, rig, body, posed_bones(rig, body, draw_stance(rng)))
    hidden = _dress(rng, figure, "male" if traits.male > 0.5 else "female")
    if rng.random() < _SKIRTED:
        flared, faces = skirt(
            base, body, length=float(rng.uniform(0.25, 1.0)), flare=float(rng.uniform(0.0, 0.5))
        )
        figure.add(flared, rig.weights, faces, cloth_color(rng))
    if rng.random() < _ARMOURED:
        _armour(rng, figure)
    picture, color = skin_picture(rng, assets, traits)
    faces = body_faces(base) & ~hidden[base.faces].all(axis=1)
    figure.add(body, rig.weights, base.faces[faces], color, picture, base.uvs[base.uv_faces[faces]])
    _eyes(rng, figure)
    return _surface(figure.parts, _stylised(rng, figure))


@lru_cache(maxsize=2)
def _base(assets: Assets) -> tuple[GroupedMesh, Rig]:
    assets.check()
    base = assets.read(assets.root / BASE, parse_obj)
    try:
        return base, read_rig(assets, base)
    except (KeyError, ValueError, IndexError, TypeError) as err:
        raise DataError(
            f"{assets.root / RIG}: does not fit the base mesh ({type(err).__name__}: {err}); clone mpfb2 again."
        ) from err


def _dress(rng: np.random.Generator, figure: _Figure, sex: str) -> np.ndarray:
    """A suit, shoes, hair or a hat, and eyebrows, as far as the assets have them; hidden vertices of the body (n,) bool."""
    hidden = np.zeros(len(figure.body), dtype=bool)
    for pattern in (f"{sex}_*suit*", "shoes*"):
        clothes = _one(rng, figure, "clothes", pattern)
        if clothes is not None:
            hidden[figure.wear(clothes, cloth_color(rng), dye=bool(rng.random() < 0.7))] = True
    hair = hair_color(rng)
    hat = _one(rng, figure, "clothes", "fedora*") if rng.random() < _HATTED else None
    style = _one(rng, figure, "hair", "short04" if hat else "*") if rng.random() >= _BALD else None
    if hat is not None:
        figure.wear(hat, cloth_color(rng), dye=True)
    for grown, color in ((style, hair), (_one(rng, figure, "eyebrows", "*"), 0.7 * hair)):
        if grown is not None:
            figure.wear(grown, color, dye=True, cut_out=True)
    return hidden


def _one(rng: np.random.Generator, figure: _Figure, kind: str, pattern: str) -> Path | None:
    folders = figure.assets.folders(kind, pattern)
    return folders[int(rng.integers(len(folders)))] if folders else None


def _armour(rng: np.random.Generator, figure: _Figure) -> None:
    """Plates over parts of the body, shades of two colours; most helmets leave the face free."""
    faces = figure.base.faces[body_faces(figure.base)]
    normals = vertex_normals(figure.body, faces)
    colors = [metal_color(rng) for _ in range(2)]
    for name, (bones, farthest) in PLATES.items():
        covered = figure.rig.shares(*bones) > rng.uniform(0.3, 0.6)
        if name == "helmet" and rng.random() < 0.75:
            depths = figure.body[covered, 2]
            covered &= figure.body[:, 2] < (0.5 * (depths.min() + depths.max()) if len(depths) else 0.0)
        if rng.random() < 0.6:
            plate = figure.body + float(rng.uniform(0.12, farthest)) * normals
            color = np.clip(colors[int(rng.integers(2))] * rng.uniform(0.75, 1.2), 0.0, 1.0)
            figure.add(plate, figure.rig.weights, faces[covered[faces].all(axis=1)], color)


def _eyes(rng: np.random.Generator, figure: _Figure) -> None:
    picture = eye_picture(rng)
    for side in "lr":
        faces = figure.base.faces[figure.base.group(f"helper-{side}-eye")]
        if len(faces):
            points = figure.body[faces]
            low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
            uvs = 0.01 + 0.98 * (points[..., :2] - low[:2]) / np.maximum(high[:2] - low[:2], 1e-9)
            figure.add(figure.body, figure.rig.weights, faces, np.ones(3), picture, uvs)


def _stylised(rng: np.random.Generator, figure: _Figure) -> list[np.ndarray]:
    """Corners of all parts; two of five people with short legs, large heads and wide bodies."""
    corners = [part.corners for part in figure.parts]
    legs, head, wide = rng.uniform((0.6, 1.2, 1.0), (0.95, 1.9, 1.25))
    if rng.random() >= _STYLISED:
        return corners
    low = min(float(one[..., 1].min()) for one in corners)
    hips, neck = figure.joint("thigh_l")[1] - low, figure.joint("neck_01")
    neck = neck - np.array((0.0, (1.0 - legs) * hips + low, 0.0))
    styled = []
    for one in corners:
        moved = one - np.array((0.0, low, 0.0))
        moved[..., 1] -= (1.0 - legs) * np.minimum(moved[..., 1], hips)
        above = np.clip((moved[..., 1] - neck[1] + 0.15) / 0.9, 0.0, 1.0)
        above = above**2 * (3.0 - 2.0 * above) * (np.abs(moved[..., 0] - neck[0]) < 1.75)
        styled.append((neck + (moved - neck) * (1.0 + (head - 1.0) * above[..., None])) * (wide, 1.0, wide))
    return styled


def _surface(parts: Sequence[_Part], corners: Sequence[np.ndarray]) -> SurfaceMesh:
    """Parts as one surface that stands in the world."""
    counts = [len(one) for one in corners]
    x, y, z = np.moveaxis(np.concatenate(corners), -1, 0)
    triangles = np.stack((x, -z, y), axis=-1)
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    middle = np.array((0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), low[2]))
    return SurfaceMesh(
        triangles=((triangles - middle) * (HEIGHT / (high[2] - low[2]))).astype(np.float32),
        uvs=np.concatenate([part.uvs for part in parts]).astype(np.float32),
        colors=np.ones((sum(counts), 3, 4), np.float32),
        material_ids=np.repeat(np.arange(len(parts), dtype=np.int32), counts),
        materials=tuple(_material(part) for part in parts),
    )


def _material(part: _Part) -> SurfaceMaterial:
    if part.picture is None:
        return SurfaceMaterial(factor=np.array((*linear_from_srgb(part.color), 1.0), np.float32))
    cutoff = CUTOFF if part.cut_out else None
    return SurfaceMaterial(factor=np.ones(4, np.float32), texture=make_texture(part.picture), cutoff=cutoff)
