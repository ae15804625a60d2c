"""Training batches: repeatable, coloured and placed as the pictures say, nothing read in vain."""

import gc
import logging
import re
import weakref
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from charnerf.data.augmentation.sequence import AugmentationSequence
from charnerf.data.mixed import MixedDataset, stack_views
from charnerf.data.sampler import BatchRequest, Share
from charnerf.data.silhouettes import SilhouetteSpace
from charnerf.data.store import CharacterStore
from charnerf.data.surface import AreaSurface
from charnerf.data.validation import ValidationDataset, spread_frames
from charnerf.data.window import Window, groups_of
from charnerf.errors import DataError
from charnerf.geometry.cameras import pixel_centres, pixel_rays, project
from charnerf.geometry.hull import build_hull, occupied_edges
from charnerf.losses.base import Needs
from charnerf.models.views.turnaround import Turnaround
from charnerf.pictures import on_white
from charnerf.surfaces.mesh_files import load_surface_mesh
from charnerf.types import SourceViews, TrainBatch
from support import helpers

NAMES = ("lefty", "mirror")
FIGURES = {"lefty": helpers.person(symmetric=False), "mirror": helpers.person()}


def carve(views: SourceViews):
    low = torch.tensor((-1.8, -1.8, -0.8))
    return build_hull(views, box_min=low, box_max=low + 3.6, grid_size=32)


def surface_of(character):
    return None if character.mesh_file is None else AreaSurface(load_surface_mesh(character.mesh_file))


def store_of(root: Path, *, names=NAMES, hull: bool = True, memory_mib: float = 64.0) -> CharacterStore:
    return CharacterStore(
        root=root,
        names=names,
        carve=carve if hull else lambda _: None,
        memory_mib=memory_mib,
        surface_of=surface_of,
        space_of=lambda character, images, hull: (
            None if hull is None else SilhouetteSpace(character, images, hull)
        ),
    )


def dataset_of(store: CharacterStore, **changes) -> MixedDataset:
    settings = {
        "characters": 1, "foreground_share": 0.75, "needs": Needs(),
        "used_views": Turnaround(), "augmentation": AugmentationSequence([]), "seed": 5, "share": Share(),
    }  # fmt: skip
    return MixedDataset(store=store, **settings | changes)


def request(step: int = 0, *, rays: int = 64, surface_points: int = 0, **more) -> BatchRequest:
    made = BatchRequest(
        step=step, rays=rays, surface_points=surface_points, square=0, phase=0, loss_weights={}
    )
    return replace(made, **more)


@pytest.fixture(scope="module")
def store(figure_dataset) -> CharacterStore:
    return store_of(figure_dataset)


def same(one: TrainBatch, other: TrainBatch) -> bool:
    return one.names == other.names and all(
        torch.equal(a, b)
        for a, b in (
            (one.rays.origins, other.rays.origins),
            (one.rays.directions, other.rays.directions),
            (one.rgb, other.rgb),
            (one.surface.points, other.surface.points),
            (one.space.points, other.space.points),
        )
    )


def test_batches_are_drawn_from_the_window_by_every_process(store):
    """Two processes of one character each make what one makes of two; a window of one shows one character for a while."""
    window = Window(groups_of(NAMES, None), held=1, steps=3, seed=5)
    for step in range(9):
        alone = dataset_of(store, window=window, characters=2)[request(step)]
        shares = [
            dataset_of(store, window=window, share=Share(process, 2))[request(step)] for process in (0, 1)
        ]
        assert set(alone.names) == set(window.names(step))
        assert alone.names == tuple(name for share in shares for name in share.names)


def test_the_same_request_makes_the_same_batch(figure_dataset, store):
    """Also in another process's data set, in any order; another step or seed makes another one."""
    settings = {"needs": Needs(space_points=20)}
    dataset = dataset_of(store, **settings)
    asked = request(3, surface_points=30)
    first = dataset[asked]
    dataset[request(9, surface_points=30)]
    assert same(dataset[asked], first)
    assert same(dataset_of(store_of(figure_dataset), **settings)[asked], first)
    assert not same(dataset[request(4, surface_points=30)], first)
    assert not same(dataset_of(store, **settings, seed=6)[asked], first)
    assert dataset_of(store, **settings, seed=2**32 - 1)[asked].rgb.isfinite().all()


def test_what_pixels_are_drawn_by_draws_nothing_else(store):
    """The seed that a batch hands on, to renderer and loss, does not begin the stream that its pixels came from."""
    batch = dataset_of(store, foreground_share=1.0)[request(rays=64)]
    one = store.open(batch.names[0])
    generator = torch.Generator().manual_seed(batch.seeds[0])
    again = one.foreground[torch.randint(len(one.foreground), (64,), generator=generator)]
    assert not torch.equal(on_white(one.images.reshape(-1, 4)[again].float() / 255.0), batch.rgb[0])


def test_a_square_is_a_window_of_one_picture_around_the_character(store):
    """Row by row, before the other rays; nowhere beyond a picture's edge."""
    dataset, side = dataset_of(store), 16
    for step in range(12):
        batch = dataset[request(step, rays=10, square=side)]
        assert batch.square == side and batch.rgb.shape == batch.rays.origins.shape == (
            1,
            side * side + 10,
            3,
        )
        assert torch.equal(batch.rays.origins[0, : side * side].unique(dim=0), batch.rays.origins[0, :1])
        one = store.open(batch.names[0])
        pictures = on_white(one.images.float() / 255.0)
        windows = (
            pictures.unfold(1, side, 1).unfold(2, side, 1).movedim(3, -1)
        )  # (N, rows, columns, side, side, 3)
        square = batch.rgb[0, : side * side].reshape(side, side, 3)
        image, top, left = (windows == square).flatten(3).all(-1).nonzero()[0].tolist()
        camera = one.character.cameras[image]
        places = pixel_centres(camera.width, camera.height)[top : top + side, left : left + side].reshape(
            -1, 2
        )
        torch.testing.assert_close(
            batch.rays.directions[0, : side * side], pixel_rays(camera, places).directions
        )
        assert (batch.alpha[0, : side * side] > 0.5).any()


def test_a_square_larger_than_the_pictures_is_a_picture(store):
    batch = dataset_of(store)[request(rays=10, square=64)]
    height, width = store.open(batch.names[0]).images.shape[1:3]
    assert batch.square == height == width and batch.rgb.shape[1] == height * width + 10


def test_rays_carry_the_colors_that_the_figure_has(store):
    """Each ray traced through the figure in closed form: on white, away from antialiased edges."""
    batch = dataset_of(store, characters=2)[request(rays=600)]
    assert set(batch.names) == set(NAMES) and batch.rgb.shape == (2, 300, 3)
    torch.testing.assert_close(batch.rays.directions.norm(dim=-1), torch.ones(2, 300))
    for b, name in enumerate(batch.names):
        t_vals, colors = helpers.trace(FIGURES[name], batch.rays[b])
        hit = t_vals.isfinite()
        solid, empty = hit & (batch.alpha[b] == 1), ~hit & (batch.alpha[b] == 0)
        right = (batch.rgb[b] - colors.float()).abs().amax(-1) < 0.01
        assert right[solid].float().mean() > 0.7  # others lie on a border between two colours
        assert batch.rgb[b][empty].eq(1).all()
        assert (solid | empty).float().mean() > 0.5
        assert not (hit & (batch.alpha[b] == 0)).any() and not (~hit & (batch.alpha[b] == 1)).any()


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_the_share_of_foreground_is_kept(store, share):
    batch = dataset_of(store, foreground_share=share)[request(rays=4000)]
    assert (batch.alpha > 0).float().mean().item() == pytest.approx(share)


def test_background_is_drawn_only_where_the_hull_may_be(store):
    """Every ray that can teach anything may be drawn, no other is."""
    batch = dataset_of(store, foreground_share=0.0)[request(rays=4000)]
    one = store.open(batch.names[0])
    shown = one.images[..., 3].reshape(-1) > 0
    assert not shown[one.background.long()].any()
    assert len(one.background) < 0.6 * (~shown).sum()
    everywhere = torch.cat([pixel_centres(helpers.SIZE, helpers.SIZE).reshape(-1, 2)] * len(one.images))
    cameras = one.character.cameras[torch.arange(len(one.images)).repeat_interleave(helpers.SIZE**2)]
    met = occupied_edges(one.hull[0], pixel_rays(cameras, everywhere), 256)[1].any(-1)
    drawable = torch.zeros_like(met).index_fill_(0, one.background.long(), True)
    assert not (met & ~shown & ~drawable).any()


def test_without_a_hull_any_background_is_drawn(figure_dataset):
    open_world = store_of(figure_dataset, hull=False)
    one = open_world.open(NAMES[0])
    assert len(one.background) + len(one.foreground) == one.images[..., 0].numel()


def test_depth_is_along_the_ray(store):
    batch = dataset_of(store, needs=Needs(depth=True))[request(rays=500)]
    t_vals, _ = helpers.trace(FIGURES[batch.names[0]], batch.rays[0])
    hit = t_vals.isfinite()
    torch.testing.assert_close(batch.depth[0][hit], t_vals[hit].float(), atol=1.5e-3, rtol=0)
    assert batch.depth[0][~hit].eq(0).all()
    assert dataset_of(store)[request()].depth is None


def test_surface_points_lie_on_every_characters_surface(store):
    batch = dataset_of(store, characters=2)[request(surface_points=200)]
    assert batch.surface.points.shape == (2, 100, 3)
    for b, name in enumerate(batch.names):
        assert helpers.signed_distances(FIGURES[name], batch.surface.points[b]).max() < 0.01
    none = dataset_of(store)[request(surface_points=0)]
    assert none.surface is None


def test_counts_are_of_all_characters_together(store):
    for characters in (1, 2, 5):
        batch = dataset_of(store, characters=characters, needs=Needs(space_points=40))[request(rays=100)]
        used = min(characters, 2)
        assert len(batch.names) == len(set(batch.names)) == used
        assert batch.alpha.numel() == 100 and batch.space.points.shape == (used, 40 // used, 3)
        assert batch.hull.occupancy.shape[0] == used == batch.views.present.shape[0]


def test_every_character_gets_its_turn(store):
    dataset = dataset_of(store)
    names = [dataset[request(step, rays=4)].names[0] for step in range(40)]
    assert 8 <= names.count("lefty") <= 32


def test_a_character_without_a_mesh_makes_a_batch_of_rays(tmp_path):
    helpers.write_figure(tmp_path, "bare", "train", helpers.ball(), views=2, mesh=False)
    store = store_of(tmp_path, names=("bare",))
    batch = dataset_of(store)[request(surface_points=30)]
    assert batch.surface is None and batch.alpha.numel() == 64


def test_padded_views_are_absent():
    views = [helpers.source_views(helpers.ball(), helpers.source_cameras(a)) for a in ((0.0, 90.0), (180.0,))]
    batch = stack_views(views)
    assert batch.present.tolist() == [[True, True], [True, False]]
    assert torch.equal(batch.images[1, 0], views[1].images[0, 0])
    point = torch.tensor((0.2, 0.1, 1.3))
    for b, view in ((0, 1), (1, 0)):
        expected = project(views[b].cameras[0, view], point)[0]
        assert torch.equal(project(batch.cameras[b, view], point)[0], expected)


def test_the_store_drops_what_was_not_used_for_longest(figure_dataset):
    roomy, tight = store_of(figure_dataset), store_of(figure_dataset, memory_mib=0.001)
    assert roomy.open("lefty") is roomy.open("lefty")
    first = tight.open("lefty")
    tight.open("mirror")
    assert tight.open("mirror") is tight.open("mirror")
    again = tight.open("lefty")
    assert again is not first and torch.equal(again.images, first.images)


def test_surfaces_are_dropped_with_their_characters(figure_dataset):
    """The bound is on everything that is kept; textures are the larger part of many characters."""
    tight = store_of(figure_dataset, memory_mib=0.001)
    first = tight.open("lefty")
    bare = replace(first, surface=None)
    assert (
        first.size_bytes - bare.size_bytes == first.surface.size_bytes > first.surface.mesh.triangles.nbytes
    )
    kept = weakref.ref(first.surface)
    del first, bare
    tight.open("mirror")
    gc.collect()
    assert kept() is None


def test_too_small_a_memory_is_told_once(figure_dataset, caplog):
    tight = store_of(figure_dataset, memory_mib=0.001)
    with caplog.at_level(logging.WARNING, logger="charnerf"):
        for name in NAMES * 3:
            tight.open(name)
    (said,) = [record.getMessage() for record in caplog.records]
    needed = float(re.search(r"batches\.memory_mib=(\d+) would hold all", said)[1])
    assert "holds about 1 of 2 characters" in said
    roomy = store_of(figure_dataset, memory_mib=needed + 1)
    caplog.clear()
    assert all(roomy.open(name) is roomy.open(name) for name in NAMES)
    assert roomy.open("lefty") is roomy.open("lefty") and not caplog.records


def test_a_character_without_a_hull_is_named(figure_dataset):
    """A training on hundreds says which of them stopped it."""

    def refuse(views: SourceViews):
        raise DataError("reaches the sides")

    store = CharacterStore(root=figure_dataset, names=NAMES, carve=refuse, memory_mib=64.0)
    with pytest.raises(DataError, match=r"lefty: reaches the sides"):
        store.open("lefty")


def test_validation_shows_each_characters_views(figure_dataset):
    views = ValidationDataset(store=store_of(figure_dataset, names=("lefty", "rods")), views=5)
    assert len(views) == 10  # `rods` has three frames only: two of them are shown again
    shown = [views[index] for index in range(10)]
    poses = [view.camera.world_from_camera for view in shown]
    assert len({tuple(pose.reshape(-1).tolist()) for pose in poses[:5]}) == 5
    assert len({tuple(pose.reshape(-1).tolist()) for pose in poses[5:]}) == 3
    truth = helpers.photograph(FIGURES["lefty"], shown[0].camera[None])[0]
    torch.testing.assert_close(shown[0].rgba[..., 3], truth[..., 3], atol=0.003, rtol=0)


def test_frames_are_spread():
    assert (
        spread_frames(10, 3) == [2, 5, 7]
        and spread_frames(3, 3) == [0, 1, 2]
        and spread_frames(2, 5) == [0, 1]
    )
    assert all(len(set(spread_frames(n, k))) == k for n in range(1, 40) for k in range(1, n + 1))
