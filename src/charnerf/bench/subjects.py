"""What is rendered in a benchmark: characters encoded once, the rays of random pixels, the truth and the converged reference."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import torch
import trimesh
from torch import Tensor

from charnerf.bench.baseline import PixelAligned
from charnerf.capture.character import CaptureOptions, capture_character
from charnerf.capture.generated import character_seed
from charnerf.data.characters import load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.models.charnerf import CharNeRF
from charnerf.procedural import make_character
from charnerf.scene import Scene
from charnerf.types import Cameras, RayBundle, SourceViews
from charnerf.volume.quadrature import PiecewiseConstant
from charnerf.volume.renderers.dense import DenseRenderer

NUM_CHARACTERS, NUM_PIXELS = 4, 512
REFERENCE_SAMPLES = 1024
REFERENCE_STEPS = 1024  # in which the reference looks up the hull
TARGET_VIEWS = 6  # captured for each subject; the last one looked at


@dataclass(frozen=True)
class Subject:
    """One character as the benchmark sees it.

    Attributes:
        name: Its name.
        network: The network that it is rendered by.
        views: Its drawings, B = 1.
        scene: Its field.
        maps: The same for the baseline.
        camera: Of the target picture, shape ().
        rays: Of the random pixels of that picture, (R,).
        truth: Their colours on white, (R, 3).
    """

    name: str
    network: CharNeRF
    views: SourceViews
    scene: Scene
    maps: PixelAligned
    camera: Cameras
    rays: RayBundle
    truth: Tensor

    @cached_property
    @torch.no_grad()
    def converged(self) -> Tensor:
        """Colors (R, 3), float64, of the converged integral: dense, 1024 samples on every ray that meets the hull."""
        scene = self.in_float64()
        renderer = DenseRenderer(
            quadrature=PiecewiseConstant(),
            num_coarse=REFERENCE_SAMPLES,
            num_fine=REFERENCE_SAMPLES,
            hull_steps=REFERENCE_STEPS,
            memory_mib=256,
        )
        rays = self.rays.to(torch.float64)
        met = (renderer.occupied(scene, rays).length > 0).nonzero()[:, 0]
        rgb = torch.ones_like(rays.origins)
        for part in met.split(64):
            rgb[part] = renderer.render(scene, rays[part]).finest.rgb
        return rgb

    def in_float64(self) -> Scene:
        """The scene in float64 over the same hull, so that both precisions integrate over the same cells."""
        network, hull = copy.deepcopy(self.network).double(), self.maps.hull
        if hull is not None:
            hull = replace(hull, **{name: value[None] for name, value in vars(hull).items()}).to(
                torch.float64
            )
        return network.scene(network.encode(self.views.to(torch.float64), hull), 0)


@dataclass(frozen=True)
class Pictured:
    """Drawings (B = 1), the camera of one target picture and that picture, (H, W, 4) in [0, 1]."""

    name: str
    views: SourceViews
    camera: Cameras
    picture: Tensor


def embedded(count: int, size: int) -> list[Pictured]:
    """Characters of the embedded generator's test split (seed 0)."""
    return [
        captured(f"test-{index:05d}", make_character(character_seed(0, "test", index)), size)
        for index in range(count)
    ]


def captured(name: str, scene: trimesh.Scene, size: int) -> Pictured:
    """Capture a character in the world frame."""
    pictures = capture_character(scene, CaptureOptions(views=TARGET_VIEWS, size=size)).pictures
    picture = torch.from_numpy(pictures.images[-1]).float() / 255.0
    return Pictured(
        name, pictures.source_views, pictures.cameras[TARGET_VIEWS - 1].to(torch.float32), picture
    )


def of_dataset(root: Path, split: str, count: int | None) -> list[Pictured]:
    """The first characters of a split of a data set, all if there is no count."""
    pictured = []
    for name in names_of(read_dataset(root), split)[:count]:
        character = load_character(root, name)
        view = character.cameras.shape[0] // 2
        picture = character.images([view])[0].float() / 255.0
        pictured.append(Pictured(name, character.sources, character.cameras[view], picture))
    return pictured


def prepared(network: CharNeRF, pictured: Sequence[Pictured]) -> list[Subject]:
    """Encode characters, choose their pixels, and compute what all errors are measured against."""
    subjects = [subject(one, network, seed=i) for i, one in enumerate(pictured)]
    for one in subjects:
        _ = one.converged
    return subjects


def subject(pictured: Pictured, network: CharNeRF, *, num_pixels: int = NUM_PIXELS, seed: int = 0) -> Subject:
    """Encode a character and choose random pixels of its target picture.

    Args:
        pictured: Drawings and target.
        network: The network.
        num_pixels: Pixels drawn without replacement; all where there are fewer.
        seed: Of the draw.
    """
    device = network.box[0].device
    views, camera = pictured.views.to(device), pictured.camera.to(device)
    with torch.no_grad():
        encoded = network.encode(views)
        scene = network.scene(encoded, 0)
    pixels = pixel_centres(camera.width, camera.height, device=device).reshape(-1, 2)
    generator = torch.Generator().manual_seed(seed)
    chosen = torch.randperm(len(pixels), generator=generator)[:num_pixels].to(device)
    alpha = pictured.picture[..., 3:]
    truth = (pictured.picture[..., :3] * alpha + 1.0 - alpha).reshape(-1, 3).to(device)[chosen]
    return Subject(
        name=pictured.name,
        network=network,
        views=views,
        scene=scene,
        maps=PixelAligned.of(encoded),
        camera=camera,
        rays=pixel_rays(camera, pixels[chosen]),
        truth=truth,
    )


def pixels_psnr(rgb: Tensor, truth: Tensor) -> float:
    """PSNR of colours (R, 3) of random pixels, dB."""
    error = (rgb.double() - truth.double()).square().mean().clamp_min(1e-10)
    return float(-10.0 * torch.log10(error))
