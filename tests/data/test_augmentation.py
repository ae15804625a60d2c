"""Augmented batches are true of an augmented character: drawings, hull, rays and points change alike."""

from dataclasses import fields, replace

import pytest
import torch

from charnerf.data.augmentation.base import AbstractAugmentation
from charnerf.data.augmentation.mirror import Mirror, mirror
from charnerf.data.augmentation.recolor import Recolor, recolor
from charnerf.data.augmentation.sequence import AugmentationSequence
from charnerf.data.augmentation.stretch import Stretch, stretch
from charnerf.data.mixed import MixedDataset
from charnerf.data.sampler import BatchRequest, Share
from charnerf.data.silhouettes import SilhouetteSpace
from charnerf.data.store import CharacterStore
from charnerf.data.surface import AreaSurface
from charnerf.geometry.cameras import project_into_all
from charnerf.geometry.hull import build_hull, hull_contains
from charnerf.losses.base import Needs
from charnerf.models.views.mirrored import MirroredSide
from charnerf.surfaces.mesh_files import load_surface_mesh

LOW = torch.tensor((-1.8, -1.8, -0.8))
VIEWS = MirroredSide()


def carve(views):
    return build_hull(VIEWS(views), box_min=LOW, box_max=LOW + 3.6, grid_size=32)


def surface_of(character):
    return AreaSurface(load_surface_mesh(character.mesh_file))


@pytest.fixture(scope="module")
def batch(figure_dataset):
    """A character with one raised arm."""
    store = CharacterStore(
        root=figure_dataset,
        names=("lefty",),
        carve=carve,
        memory_mib=64.0,
        surface_of=surface_of,
        space_of=SilhouetteSpace,
    )
    dataset = MixedDataset(
        store=store, characters=1, foreground_share=0.75,
        needs=Needs(depth=True, space_points=200), used_views=VIEWS, augmentation=lambda batch, _: batch, seed=5, share=Share(),
    )  # fmt: skip
    return dataset[BatchRequest(step=0, rays=64, surface_points=300, square=0, phase=0, loss_weights={})]


def tensors(record):
    """All tensors of a batch, by the names of the fields that lead to them."""
    for field in fields(record):
        value = getattr(record, field.name)
        if isinstance(value, torch.Tensor):
            yield field.name, value
        elif hasattr(value, "__dataclass_fields__"):
            yield from ((f"{field.name}.{name}", inner) for name, inner in tensors(value))


def coverage(batch):
    """Alpha of the drawings where the surface points project, (V, P)."""
    views = batch.views[0]
    pixels, _, _ = project_into_all(views.cameras, batch.surface.points[0])
    last = views.images.shape[-1] - 1
    column, row = pixels.movedim(-2, 0).round().long().unbind(-1)
    near = [
        torch.stack(
            [image[3, (r + dr).clamp(0, last), (c + dc).clamp(0, last)] for dr in (-1, 0) for dc in (-1, 0)]
        )
        for image, r, c in zip(views.images, row, column, strict=True)
    ]
    return torch.stack([one.amax(0) for one in near])


def test_mirroring_twice_changes_nothing(batch):
    once, twice = mirror(batch), mirror(mirror(batch))
    changed = [name for name, value in tensors(batch) if not torch.equal(value, dict(tensors(once))[name])]
    assert {"views.images", "rays.origins", "surface.points", "hull.occupancy", "space.points"} <= set(
        changed
    )
    for name, value in tensors(twice):
        torch.testing.assert_close(value, dict(tensors(batch))[name], msg=name)


def test_the_mirrored_hull_is_the_hull_of_the_mirrored_drawings(batch):
    """Also the maps of the view that the model appends, and where the box is not symmetric."""
    mirrored = mirror(batch)
    carved = carve(mirrored.views)
    inside = torch.rand(4000, 3, generator=torch.Generator().manual_seed(1)) * 3.6 + LOW
    agree = hull_contains(mirrored.hull[0], inside) == hull_contains(carved[0], inside)
    assert agree.float().mean() > 0.99
    assert not torch.equal(hull_contains(batch.hull[0], inside), hull_contains(carved[0], inside))
    torch.testing.assert_close(mirrored.hull.edge_distances, carved.edge_distances)
    apart = (mirrored.hull.front_depths - carved.front_depths).abs()
    assert float((apart < 0.12).float().mean()) > 0.95


@pytest.mark.parametrize("change", ["mirror", "wide", "deep"])
def test_the_surface_stays_in_every_drawing_and_in_the_hull(batch, change):
    scales = {"wide": (1.2, 1.0, 1.0), "deep": (1.0, 1.3, 1.0)}
    cameras = VIEWS(batch.views).cameras
    changed = mirror(batch) if change == "mirror" else stretch(batch, torch.tensor(scales[change]), cameras)
    assert float(coverage(changed).gt(0.2).float().mean()) > 0.97
    assert hull_contains(changed.hull[0], changed.surface.points[0]).float().mean() > 0.97
    unchanged_drawings = replace(changed, views=batch.views)
    assert coverage(unchanged_drawings).sum() < coverage(changed).sum()


@pytest.mark.parametrize("change", ["mirror", "stretch"])
def test_rays_still_reach_the_surface_that_they_saw(batch, change):
    """A ray's depth leads to the changed place of what it led to before."""
    factors = torch.tensor((-1.0, 1.0, 1.0) if change == "mirror" else (0.9, 1.2, 1.0))
    changed = mirror(batch) if change == "mirror" else stretch(batch, factors, VIEWS(batch.views).cameras)
    before = batch.rays.origins + batch.depth[..., None] * batch.rays.directions
    after = changed.rays.origins + changed.depth[..., None] * changed.rays.directions
    torch.testing.assert_close(after, before * factors)
    torch.testing.assert_close(changed.rays.directions.norm(dim=-1), torch.ones_like(changed.depth))


def test_colors_are_exchanged_in_drawings_and_targets_alike(batch):
    order = torch.tensor((2, 0, 1))
    changed = recolor(batch, order)
    torch.testing.assert_close(changed.rgb, batch.rgb[..., order])
    torch.testing.assert_close(changed.surface.rgb, batch.surface.rgb[..., order])
    torch.testing.assert_close(changed.views.images[:, :, :3], batch.views.images[:, :, order])
    torch.testing.assert_close(changed.views.images[:, :, 3], batch.views.images[:, :, 3])


def test_shares_of_nought_and_one_do_nothing_and_all(batch):
    ranges = {"width_range": [0.8, 1.0], "depth_range": [0.8, 1.2], "used_views": VIEWS}
    never = AugmentationSequence([Stretch(share=0.0, **ranges), Recolor(share=0.0), Mirror(share=0.0)])
    unchanged = never(batch, torch.Generator().manual_seed(0))
    assert all(torch.equal(value, dict(tensors(batch))[name]) for name, value in tensors(unchanged))
    always = AugmentationSequence([Recolor(share=0.0), Mirror(share=1.0)])(batch, torch.Generator())
    torch.testing.assert_close(always.rays.origins, mirror(batch).rays.origins)


def test_what_one_change_draws_does_not_move_the_decisions_of_the_next(batch):
    """Whether a batch is mirrored depends on the seed, not on whether it was recoloured."""

    def is_mirrored(seed, share):
        changes = AugmentationSequence([Recolor(share=share), Mirror(share=0.5)])
        changed = changes(batch, torch.Generator().manual_seed(seed))
        return not torch.equal(changed.rays.origins, batch.rays.origins)

    decisions = [is_mirrored(seed, share=0.0) for seed in range(20)]
    assert decisions == [is_mirrored(seed, share=1.0) for seed in range(20)]
    assert 5 < sum(decisions) < 15


def test_changes_are_made_in_the_order_of_the_sequence(batch):
    add = [Offset(1.0), Offset(2.0)]
    changed = AugmentationSequence(add)(batch, torch.Generator().manual_seed(7))
    first, second = torch.rand(2, generator=torch.Generator().manual_seed(7))
    torch.testing.assert_close(changed.rgb, (batch.rgb * 1.0 + first) * 2.0 + second)


class Offset(AbstractAugmentation):
    """Colours times a factor and plus what it draws."""

    num_draws = 1

    def __init__(self, factor):
        self.factor = factor

    def __call__(self, batch, draws, generator):
        return replace(batch, rgb=batch.rgb * self.factor + draws[0])
