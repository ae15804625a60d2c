"""What is learnt from and checked on: rays of the drawings, and rays from elsewhere with the start's answers."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from charnerf.finetuning.cached_rays import CachedRays, cache, place, render_cached, within_memory
from charnerf.finetuning.recipe import Recipe
from charnerf.finetuning.regions import held_out_patches
from charnerf.geometry.cameras import (
    cameras_towards,
    direction_from_angles,
    pixel_centres,
    pixel_rays,
)
from charnerf.geometry.framing import camera_distance
from charnerf.models.character import CharacterField
from charnerf.models.field import Field
from charnerf.scene import Scene
from charnerf.types import Cameras, LeftOut, RayBundle, SourceViews
from charnerf.volume.renderers.base import AbstractRenderer

NOVEL_CAMERAS = 16  # half of them are for the guard
NOVEL_SIZE = 96  # pixels a side
NOVEL_ELEVATIONS = (-5.0, 10.0, 25.0, 50.0)  # degrees, in turn
GUARD_RAYS = 1024
TRIED = 8  # rays from elsewhere that are looked up for one that is wanted: most miss the hull
OPAQUE = 0.5  # opacity from which on the starting weights are trusted: below, they show haze
CHUNK = 1024  # rays


@dataclass(frozen=True)
class Targets:
    """Rays with what they shall show: colours on white (R, 3) and opacities (R,), and how much each counts (R,)."""

    cached: CachedRays
    rgb: Tensor
    alpha: Tensor
    weights: Tensor

    def __len__(self) -> int:
        return len(self.alpha)


@dataclass(frozen=True)
class RaySets:
    """Everything that fine-tuning reads, prepared once.

    Attributes:
        learnt: Rays of the drawings that are learnt from.
        held_out: Rays of the drawings' held-out patches.
        trusted: Rays from elsewhere, with the starting weights' answers.
        guard: The same from yet other cameras, never learnt from.
        left_out: Rays of the drawings that miss the hull, and samples outside it, of all.
    """

    learnt: Targets
    held_out: Targets
    trusted: Targets
    guard: Targets
    left_out: LeftOut


def prepare_rays(
    field: CharacterField,
    renderer: AbstractRenderer,
    scene: Scene,
    views: SourceViews,
    radius: float,
    recipe: Recipe,
) -> RaySets:
    """Prepare the rays of a character.

    Args:
        field: The scene's finest field, with the starting weights.
        renderer: Places samples and composites.
        scene: The character under the starting weights.
        views: Its drawings, B = 1.
        radius: Of the character around the box's centre, m.
        recipe: Settings.
    """
    generator = torch.Generator().manual_seed(recipe.seed)
    rays, rgb, alpha, held = _drawn_rays(views, recipe)
    samples, hit = place(renderer, scene, rays, generator)
    rgb, alpha, held = rgb[hit], alpha[hit], held[hit]
    most = within_memory(samples, field, 0.75 * recipe.memory_mib)
    kept = torch.randperm(len(hit), generator=generator)[:most].sort().values.to(hit.device)
    inside = int(samples.inside[kept].sum())
    drawn = len(rays.origins)
    total = drawn * samples.s_vals.shape[1]
    left_out = LeftOut(
        rays=drawn - len(kept),
        rays_of=drawn,
        samples=total - inside,
        samples_of=total,
    )

    def targets(index: Tensor) -> Targets:
        return Targets(cache(field, samples[index]), rgb[index], alpha[index], torch.ones_like(alpha[index]))

    trusted, guard = (
        _answered(field, renderer, scene, cameras, count, generator)
        for cameras, count in zip(
            _novel_cameras(scene, radius, generator),
            (min(8 * recipe.novel_rays, most // 3 + 1), GUARD_RAYS),
            strict=True,
        )
    )
    return RaySets(targets(kept[~held[kept]]), targets(kept[held[kept]]), trusted, guard, left_out)


def _drawn_rays(views: SourceViews, recipe: Recipe) -> tuple[RayBundle, Tensor, Tensor, Tensor]:
    """Rays of the drawings, their colours on white, alpha, and whether they are held out."""
    origins, directions, rgb, alpha, held = [], [], [], [], []
    for view in (views.present[0] & ~views.mirrored[0]).nonzero()[:, 0].tolist():
        camera, image = views.cameras[0, view], views.images[0, view]
        pixels = pixel_centres(camera.width, camera.height, device=image.device).to(image.dtype)
        rays = pixel_rays(camera, pixels.reshape(-1, 2))
        origins.append(rays.origins)
        directions.append(rays.directions)
        alpha.append(image[3].reshape(-1))
        rgb.append((image[:3] * image[3:] + (1.0 - image[3:])).reshape(3, -1).T)
        mask = held_out_patches(
            camera.height,
            camera.width,
            patches=recipe.patches,
            share=recipe.held_out,
            seed=recipe.seed + view,
        )
        held.append(mask.reshape(-1).to(image.device))
    rays = RayBundle(torch.cat(origins), torch.cat(directions))
    return rays, torch.cat(rgb), torch.cat(alpha), torch.cat(held)


def _novel_cameras(scene: Scene, radius: float, generator: torch.Generator) -> tuple[Cameras, Cameras]:
    """Pinholes around the character, those to trust and those of the guard in turn."""
    azimuths = (torch.arange(NOVEL_CAMERAS, dtype=torch.float64) + 0.5) * (360.0 / NOVEL_CAMERAS)
    azimuths += 10.0 * (torch.rand(NOVEL_CAMERAS, generator=generator, dtype=torch.float64) - 0.5)
    elevations = torch.tensor(NOVEL_ELEVATIONS, dtype=torch.float64)[
        torch.arange(NOVEL_CAMERAS) // 2 % len(NOVEL_ELEVATIONS)
    ]
    cameras = cameras_towards(
        direction_from_angles(azimuths, elevations),
        target=(0.5 * (scene.bounds.box_min + scene.bounds.box_max)).double().cpu(),
        distance=camera_distance(radius),
        half_extent=radius,
        size=NOVEL_SIZE,
        orthographic=False,
    ).to(torch.float32)
    return cameras[0::2], cameras[1::2]


@torch.no_grad()
def _answered(
    field: CharacterField,
    renderer: AbstractRenderer,
    scene: Scene,
    cameras: Cameras,
    count: int,
    generator: torch.Generator,
) -> Targets:
    """Up to `count` rays of cameras that meet the hull, with the answers of the field as it is."""
    device = scene.bounds.box_min.device
    cameras, pixels = cameras.to(device), pixel_centres(cameras.width, cameras.height).reshape(-1, 2)
    some = -(-TRIED * count // cameras.shape[0])
    rays = RayBundle.joined(
        [
            pixel_rays(
                cameras[index], pixels[torch.randint(len(pixels), (some,), generator=generator)].to(device)
            )
            for index in range(cameras.shape[0])
        ]
    )
    hit = (renderer.occupied(scene, rays).length > 0).nonzero()[:, 0].cpu()
    drawn = hit[torch.randperm(len(hit), generator=generator)[:count]].to(device)
    samples, _ = place(renderer, scene, rays[drawn], generator)
    cached = cache(field, samples)
    rgb, alpha = render_all(field.field, renderer, cached)
    return Targets(cached, rgb, alpha, (alpha > OPAQUE).to(alpha.dtype))


@torch.no_grad()
def render_all(field: Field, renderer: AbstractRenderer, cached: CachedRays) -> tuple[Tensor, Tensor]:
    """Colours (R, 3) and opacities (R,) of all cached rays, chunk by chunk, without gradient."""
    index = torch.arange(len(cached), device=cached.numbers.device)
    parts = [render_cached(field, renderer, cached, some) for some in index.split(CHUNK)]
    if not parts:
        return index.new_zeros(0, 3).float(), index.new_zeros(0).float()
    return torch.cat([rgb for rgb, _ in parts]), torch.cat([alpha for _, alpha in parts])
