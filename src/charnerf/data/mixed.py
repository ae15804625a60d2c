"""Training batches: target rays and surface points of a few characters, drawn from the step's own seed."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import final

import torch
from torch import Tensor
from torch.utils.data import Dataset

from charnerf.data.sampler import BatchRequest, Share, step_seed
from charnerf.data.store import CharacterStore, OpenCharacter
from charnerf.data.window import Window
from charnerf.geometry.cameras import pixel_rays
from charnerf.losses.base import Needs
from charnerf.types import Cameras, Hull, RayBundle, SourceViews, SpacePoints, SurfacePoints, TrainBatch


@final
class MixedDataset(Dataset[TrainBatch]):
    """Rays and surface points (paper, Mix of 2d ray sampling and 3d surface sampling).

    Args:
        store: The characters.
        characters: B, characters a step and process.
        foreground_share: Share of the rays drawn from pixels that show the character, so that training does not collapse to white;
            the rest is drawn from pixels beside it whose rays may meet the hull.
        needs: What the loss reads of a batch besides rays.
        used_views: The model's rule from drawings to views; a hull has maps of all of those.
        augmentation: Changes a character's batch at random.
        seed: Of the run.
        share: Of every step's batch, which this process makes.
        window: Which characters a step draws from; all of them without.
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
        share: Share,
        window: Window | None = None,
    ) -> None:
        self.store = store
        self.characters = min(characters, len(store))
        self.foreground_share = foreground_share
        self.needs = needs
        self.used_views = used_views
        self.augmentation = augmentation
        self.seed = seed
        self.share = share
        self.window = window

    def __getitem__(self, request: BatchRequest) -> TrainBatch:  # type: ignore[override]
        """Make this process's share of the batch of a request; the same request makes the same batch.

        N processes make together what one makes that is asked for N times as many characters, rays and points: characters are
        drawn for all of them, and what is random about one hangs on its place among those.
        """
        chosen = self._choose(request.step)
        points = request.surface_points if all(map(self.store.has_mesh, chosen)) else 0  # or rays alone
        first = self.share.process * self.characters
        return stack_batches(
            [
                self._alone(chosen[place], place, request, points)
                for place in range(first, first + self.characters)
            ],
            self.used_views,
        )

    def _choose(self, step: int) -> list[str]:
        """Characters of a step, of all processes; the same one again only where there are too few."""
        generator = torch.Generator().manual_seed(step_seed(self.seed, step))
        names = self.store.names if self.window is None else self.window.names(step)
        wanted, there = self.characters * self.share.processes, len(names)
        orders = [torch.randperm(there, generator=generator) for _ in range(-(-wanted // there))]
        return [names[int(index)] for index in torch.cat(orders)[:wanted]]

    def _alone(self, name: str, place: int, request: BatchRequest, surface_points: int) -> TrainBatch:
        """A batch of the character at a place among those of all processes."""
        drawn_here, drawn_later = (step_seed(self.seed, request.step, place, stream) for stream in (0, 1))
        generator = torch.Generator().manual_seed(drawn_here)
        one = self.store.open(name)
        square = min(request.square, *one.images.shape[1:3])
        pixels = self._pixels(one, _count_each(request.rays, self.characters), generator)
        if square:
            pixels = torch.cat((_square(one, square, generator), pixels))
        rays, rgb, alpha, depth = self._rays(one, pixels)
        points = _count_each(surface_points, self.characters)
        batch = TrainBatch(
            names=(name,),
            views=one.character.sources,
            hull=one.hull,
            rays=rays[None],
            rgb=rgb[None],
            alpha=alpha[None],
            square=square,
            depth=depth[None] if self.needs.depth else None,
            surface=one.surface.sample(points, generator) if points and one.surface is not None else None,
            space=self._space(one, generator),
            phase=request.phase,
            loss_weights=request.loss_weights,
            step=request.step,
            seeds=(drawn_later,),
        )
        return self.augmentation(batch, generator)

    def _rays(self, one: OpenCharacter, flat: Tensor) -> tuple[RayBundle, Tensor, Tensor, Tensor]:
        """Rays with colour, alpha and depth through pixels (R,) of one character."""
        height, width = one.images.shape[1:3]
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

    def _space(self, one: OpenCharacter, generator: torch.Generator) -> SpacePoints | None:
        """Labelled points in the hull, None where no loss reads them."""
        if self.needs.space_points == 0 or one.space is None:
            return None
        return one.space.sample(_count_each(self.needs.space_points, self.characters), generator)


def _square(one: OpenCharacter, side: int, generator: torch.Generator) -> Tensor:
    """Flat indices (side * side,) of a square of pixels around one that shows the character, moved into its picture."""
    height, width = one.images.shape[1:3]
    centres = one.foreground if len(one.foreground) else torch.arange(one.images.shape[:3].numel())
    centre = int(centres[int(torch.randint(len(centres), (), generator=generator))])
    image, row, column = centre // (height * width), centre // width % height, centre % width
    top = min(max(row - side // 2, 0), height - side)
    left = min(max(column - side // 2, 0), width - side)
    rows, columns = torch.arange(top, top + side), torch.arange(left, left + side)
    return ((image * height + rows[:, None]) * width + columns).reshape(-1)


def stack_batches(
    batches: Sequence[TrainBatch], used_views: Callable[[SourceViews], SourceViews]
) -> TrainBatch:
    """Batches of one character each as one batch.

    Args:
        batches: Of one step, with the same counts and the same data.
        used_views: The model's rule from drawings to views; a hull has maps of all of those.
    """
    first = batches[0]
    if len(batches) == 1:
        return first
    views = stack_views([batch.views for batch in batches])
    hulls = [batch.hull for batch in batches if batch.hull is not None]
    alone = [used_views(batch.views) for batch in batches]
    depths = [batch.depth for batch in batches if batch.depth is not None]
    surfaces = [batch.surface for batch in batches if batch.surface is not None]
    spaces = [batch.space for batch in batches if batch.space is not None]
    return replace(
        first,
        names=tuple(batch.names[0] for batch in batches),
        views=views,
        hull=stack_hulls(hulls, alone, used_views(views)) if hulls else None,
        rays=RayBundle.joined([batch.rays for batch in batches]),
        rgb=torch.cat([batch.rgb for batch in batches]),
        alpha=torch.cat([batch.alpha for batch in batches]),
        depth=torch.cat(depths) if depths else None,
        surface=SurfacePoints.joined(surfaces) if surfaces else None,
        space=SpacePoints.joined(spaces) if spaces else None,
        seeds=tuple(batch.seeds[0] for batch in batches),
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
