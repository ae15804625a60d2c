"""Training batches: target rays and surface points of a few characters, drawn from the step's own seed."""

from collections.abc import Callable
from typing import final

import torch
from torch import Tensor
from torch.utils.data import Dataset

from charnerf.data.sampler import BatchRequest, step_seed
from charnerf.data.silhouettes import label_points
from charnerf.data.store import CharacterStore, OpenCharacter
from charnerf.data.surface import AbstractSurface
from charnerf.errors import DataError
from charnerf.geometry.cameras import pixel_rays
from charnerf.losses.base import Needs
from charnerf.types import Cameras, Hull, RayBundle, SourceViews, SpacePoints, SurfacePoints, TrainBatch


@final
class MixedDataset(Dataset[TrainBatch]):
    """Rays and surface points (paper, Mix of 2d ray sampling and 3d surface sampling).

    Args:
        store: The characters.
        characters: B, characters a step.
        foreground_share: Share of the rays drawn from pixels that show the character, so that training does not collapse to white;
            the rest is drawn from pixels beside it whose rays may meet the hull.
        needs: What the loss reads of a batch besides rays.
        used_views: The model's rule from drawings to views; a hull has maps of all of those.
        augmentation: Changes a batch at random.
        seed: Of the run.
    """

    def __init__(
        self,
        *,
        store: CharacterStore,
        characters: int,
        foreground_share: float,
        needs: Needs,
        used_views: Callable[[SourceViews], SourceViews],
        augmentation: Callable[[TrainBatch, torch.Generator], TrainBatch],
        seed: int,
    ) -> None:
        self.store = store
        self.characters = min(characters, len(store))
        self.foreground_share = foreground_share
        self.needs = needs
        self.used_views = used_views
        self.augmentation = augmentation
        self.seed = seed

    def __getitem__(self, request: BatchRequest) -> TrainBatch:  # type: ignore[override]
        """Make the batch of a request; the same request makes the same batch."""
        generator = torch.Generator().manual_seed(step_seed(self.seed, request.step))
        chosen = torch.randperm(len(self.store), generator=generator)[: self.characters]
        opened = [self.store.open(self.store.names[int(index)]) for index in chosen]
        rays = _count_each(request.rays, len(opened))
        drawn = [self._rays(one, rays, generator) for one in opened]
        points = _count_each(request.surface_points, len(opened))
        surfaces = [one.surface for one in opened]
        surface = _sample_surfaces(surfaces, points, generator) if points else None
        space = self._space(opened, generator)
        views = stack_views([one.character.sources for one in opened])
        batch = TrainBatch(
            names=tuple(one.character.name for one in opened),
            views=views,
            hull=self._hulls(opened, views),
            rays=RayBundle(
                origins=torch.stack([d[0].origins for d in drawn]),
                directions=torch.stack([d[0].directions for d in drawn]),
            ),
            rgb=torch.stack([d[1] for d in drawn]),
            alpha=torch.stack([d[2] for d in drawn]),
            depth=torch.stack([d[3] for d in drawn]) if self.needs.depth else None,
            surface=surface,
            space=space,
            phase=request.phase,
            loss_weights=request.loss_weights,
            step=request.step,
        )
        return self.augmentation(batch, generator)

    def _hulls(self, opened: list[OpenCharacter], views: SourceViews) -> Hull | None:
        """Hulls of the batch, None for a model without."""
        hulls = [one.hull for one in opened if one.hull is not None]
        if not hulls or len(opened) == 1:
            return hulls[0] if hulls else None
        alone = [self.used_views(one.character.sources) for one in opened]
        return stack_hulls(hulls, alone, self.used_views(views))

    def _rays(
        self, one: OpenCharacter, num_rays: int, generator: torch.Generator
    ) -> tuple[RayBundle, Tensor, Tensor, Tensor]:
        """Rays with colour, alpha and depth of one character."""
        height, width = one.images.shape[1:3]
        flat = self._pixels(one, num_rays, generator)
        image, rest = flat // (height * width), flat % (height * width)
        pixels = torch.stack((rest % width + 0.5, rest // width + 0.5), dim=-1)
        rgba = one.images.reshape(-1, 4)[flat].float() / 255.0
        rgb, alpha = rgba[:, :3], rgba[:, 3]
        camera = one.character.cameras[image]
        rays = pixel_rays(camera, pixels)
        depth = self._depths(one, image, rest, camera, rays) if self.needs.depth else alpha
        return rays, rgb * alpha[:, None] + (1.0 - alpha[:, None]), alpha, depth

    def _pixels(self, one: OpenCharacter, num_rays: int, generator: torch.Generator) -> Tensor:
        """Flat indices (R,) of pixels: a share that shows the character, the rest background before its hull."""
        share = self.foreground_share
        if len(one.foreground) == 0 or len(one.background) == 0:
            share = float(len(one.background) == 0)
        counts = (round(share * num_rays), num_rays - round(share * num_rays))
        picked = []
        for pixels, count in zip((one.foreground, one.background), counts, strict=True):
            if count:
                picked.append(pixels[torch.randint(len(pixels), (count,), generator=generator)])
        return torch.cat(picked).long()

    def _depths(
        self, one: OpenCharacter, image: Tensor, rest: Tensor, camera: Cameras, rays: RayBundle
    ) -> Tensor:
        """Distance along the ray from depth along the camera's axis, (R,), m."""
        axis = -camera.world_from_camera[..., :3, 2]
        used, inverse = image.unique(return_inverse=True)
        depths = one.character.depths(used.tolist()).flatten(1)
        return depths[inverse, rest] / (axis * rays.directions).sum(-1).clamp_min(1e-6)

    def _space(self, opened: list[OpenCharacter], generator: torch.Generator) -> SpacePoints | None:
        """Labelled points in the hulls, None where no loss reads them."""
        if self.needs.space_points == 0:
            return None
        if any(one.hull is None for one in opened):
            raise DataError(
                "model.hull: found false, but a term of the loss reads labelled points, expected a hull to draw them in; set its "
                "weight to 0 or model.hull=true."
            )
        labelled = [
            label_points(one, _count_each(self.needs.space_points, len(opened)), generator) for one in opened
        ]
        return SpacePoints(
            points=torch.stack([p[0] for p in labelled]), inside=torch.stack([p[1] for p in labelled])
        )


def stack_views(views: list[SourceViews]) -> SourceViews:
    """Characters with different numbers of views as one batch, padded with absent views."""
    most = max(view.present.shape[1] for view in views)

    def padded(tensors: list[Tensor]) -> Tensor:
        rows = []
        for tensor in tensors:
            missing = most - tensor.shape[1]
            rows.append(torch.cat((tensor, tensor[:, -1:].expand(-1, missing, *tensor.shape[2:])), dim=1))
        return torch.cat(rows)

    cameras = [view.cameras for view in views]
    present = padded([view.present for view in views])
    counts = torch.tensor([view.present.shape[1] for view in views])
    any_widened = any(view.widened_alphas is not None for view in views)
    return SourceViews(
        images=padded([view.images for view in views]),
        cameras=Cameras(
            world_from_camera=padded([c.world_from_camera for c in cameras]),
            focal=padded([c.focal for c in cameras]),
            principal_point=padded([c.principal_point for c in cameras]),
            orthographic=padded([c.orthographic for c in cameras]),
            width=cameras[0].width,
            height=cameras[0].height,
        ),
        present=present & (torch.arange(most) < counts[:, None]),
        mirrored=padded([view.mirrored for view in views]),
        widened_alphas=padded([view.carving_alphas for view in views]) if any_widened else None,
    )


def _count_each(total: int, number: int) -> int:
    """How many each of a number of characters gives to a total, rounded up."""
    return -(-total // number)


def _sample_surfaces(
    surfaces: list[AbstractSurface | None], num_points: int, generator: torch.Generator
) -> SurfacePoints | None:
    """Points on every character's surface; None if one has no mesh (rays alone then)."""
    if any(surface is None for surface in surfaces):
        return None
    samples = [surface.sample(num_points, generator) for surface in surfaces if surface is not None]
    return SurfacePoints(
        points=torch.cat([s.points for s in samples]), rgb=torch.cat([s.rgb for s in samples])
    )


def stack_hulls(hulls: list[Hull], alone: list[SourceViews], together: SourceViews) -> Hull:
    """Hulls of a batch; the maps of each go to the columns that its views have in the batch.

    Args:
        hulls: Hulls (1) of characters by themselves, with maps of their views used.
        alone: Those views, (1, V) each.
        together: The views used of the batch, (B, V'): the same in the same order, among absent ones.
    """
    columns = []
    for own, present in zip(alone, together.present, strict=True):
        kept = own.present[0].nonzero()[:, 0]
        columns.append(kept[(present.cumsum(0) - 1).clamp(0, len(kept) - 1)])

    def placed(name: str) -> Tensor:
        return torch.stack([getattr(h, name)[0, index] for h, index in zip(hulls, columns, strict=True)])

    return Hull(
        occupancy=torch.cat([hull.occupancy for hull in hulls]),
        box_min=torch.cat([hull.box_min for hull in hulls]),
        box_max=torch.cat([hull.box_max for hull in hulls]),
        front_depths=placed("front_depths"),
        edge_distances=placed("edge_distances"),
        dilations=placed("dilations"),
    )
