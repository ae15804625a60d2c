"""Simple figures, captured exactly, and a model that knows their visual hull."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import torch
import trimesh

from charnerf.data.characters import CharacterPictures, write_character
from charnerf.data.layout import add_to_split
from charnerf.evaluation.baselines import VisualHullBaseline
from charnerf.geometry.cameras import (
    cameras_towards,
    direction_from_angles,
    fibonacci_hemisphere,
    pixel_centres,
)
from charnerf.surfaces.raycast import RayCaster
from charnerf.types import Cameras, LeftOut, RenderOutput, SourceViews

SIZE = 48
CENTRE = torch.tensor([0.0, 0.0, 1.0])


def figure(kind: str) -> trimesh.Trimesh:
    """A mesh that stands on z = 0: one ball, or a head on a body with two legs."""
    if kind == "ball":
        return trimesh.creation.icosphere(subdivisions=4, radius=0.6).apply_translation((0, 0, 0.6))
    parts = [
        trimesh.creation.icosphere(subdivisions=3, radius=0.3).apply_translation((0, 0, 1.7)),
        trimesh.creation.box((0.6, 0.35, 0.8)).apply_translation((0, 0, 1.1)),
        trimesh.creation.box((0.2, 0.25, 0.8)).apply_translation((0.2, 0, 0.4)),
        trimesh.creation.box((0.2, 0.25, 0.8)).apply_translation((-0.2, 0, 0.4)),
    ]
    return trimesh.util.concatenate(parts)


def colors_at(points: np.ndarray) -> torch.Tensor:
    """The colour of a point (K, 3) of every figure: smooth in space."""
    return torch.from_numpy(0.5 + 0.4 * np.sin(3.0 * points + np.array([0.0, 1.0, 2.0]))).float()


def photograph(mesh: trimesh.Trimesh, camera: Cameras, *, oversampling: int = 4) -> torch.Tensor:
    """Antialiased RGBA bytes (H, W, 4) of a figure."""
    pixels = pixel_centres(camera.width * oversampling, camera.height * oversampling) / oversampling
    hits = RayCaster(mesh.triangles).pixel_hits(camera, pixels.reshape(-1, 2))
    fine = torch.zeros(camera.width * camera.height * oversampling**2, 4)
    fine[hits.hit, :3], fine[hits.hit, 3] = colors_at(hits[hits.hit].points), 1.0
    mean = fine.reshape(camera.height, oversampling, camera.width, oversampling, 4).mean(dim=(1, 3))
    mean[..., :3] /= mean[..., 3:].clamp_min(1e-6)
    return (mean * 255.0).round().to(torch.uint8)


def source_cameras(*, size: int = SIZE, half_extent: float = 1.1) -> Cameras:
    """Front, side, back, orthographic, (3,)."""
    directions = direction_from_angles(torch.tensor([0.0, 90.0, 180.0]), torch.zeros(3))
    return cameras_towards(
        directions, target=CENTRE, distance=4.0, half_extent=half_extent, size=size, orthographic=True
    )


def target_cameras(count: int, *, size: int = SIZE) -> Cameras:
    """Pinholes on the upper hemisphere, (count,)."""
    directions = fibonacci_hemisphere(count).float()
    return cameras_towards(
        directions, target=CENTRE, distance=4.0, half_extent=1.1, size=size, orthographic=False
    )


def source_views(mesh: trimesh.Trimesh, *, size: int = SIZE) -> SourceViews:
    """The drawings of a figure, B = 1."""
    cameras = source_cameras(size=size)
    images = torch.stack([photograph(mesh, cameras[index]) for index in range(3)]).float() / 255.0
    flags = torch.ones(1, 3, dtype=torch.bool)
    return SourceViews(images.movedim(-1, 1)[None], cameras[None], flags, ~flags)


def write_figure(
    root: Path, name: str, kind: str, *, num_views: int, size: int = SIZE, half_extent: float = 1.1
) -> None:
    """Add a figure to the test split of a data set."""
    mesh = figure(kind)
    cameras = target_cameras(num_views, size=size)
    sources = source_cameras(size=size, half_extent=half_extent)
    pictures = CharacterPictures(
        cameras=cameras,
        images=torch.stack([photograph(mesh, cameras[index]) for index in range(num_views)]).numpy(),
        source_cameras=sources,
        source_images=torch.stack([photograph(mesh, sources[index]) for index in range(3)]).numpy(),
        source_names=("front", "side", "back"),
    )
    write_character(root, name, pictures, write_mesh=lambda path: mesh.export(path) and None)
    add_to_split(root, "test", [name])


@dataclasses.dataclass(frozen=True)
class HullScene:
    """A scene whose pictures are those of the visual hull."""

    hull: VisualHullBaseline


class BlindModel:
    """Sees nothing: for renderers that need no scene."""

    device = torch.device("cpu")

    def encode(self, views: SourceViews) -> None:
        return None

    def scene(self, encoded: None, index: int) -> None:
        return None


class HullModel:
    """Answers the visual hull of the drawings, as a trained model would answer its field."""

    device = torch.device("cpu")

    def encode(self, views: SourceViews) -> SourceViews:
        return views

    def scene(self, encoded: SourceViews, index: int) -> HullScene:
        return HullScene(VisualHullBaseline(encoded[index : index + 1]))


class HullRenderer:
    """Draws a HullScene and counts invented work."""

    def prepared(self, scene: HullScene) -> HullScene:
        """The scene itself: nothing is kept of it."""
        return scene

    def render_camera(self, scene: HullScene, camera: Cameras) -> SimpleNamespace:
        left_out = LeftOut(rays=3, rays_of=4, samples=9, samples_of=10)
        return SimpleNamespace(finest=scene.hull.render(camera), left_out=left_out)


class WhiteRenderer:
    """Draws nothing, whatever the scene."""

    def prepared(self, scene: HullScene) -> HullScene:
        """The scene itself: nothing is kept of it."""
        return scene

    def render_camera(self, scene: HullScene, camera: Cameras) -> SimpleNamespace:
        shape = (camera.height, camera.width)
        white = RenderOutput(torch.ones(*shape, 3), torch.zeros(shape), torch.full(shape, 10.0))
        return SimpleNamespace(finest=white, left_out=LeftOut())
