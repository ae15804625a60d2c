"""What several processes make of a step is what one makes that is asked for as much as all of them."""

from dataclasses import fields, is_dataclass
from pathlib import Path

import pytest
import torch

from charnerf.data.augmentation.drawing import Drawing
from charnerf.data.augmentation.mirror import Mirror
from charnerf.data.augmentation.recolor import Recolor
from charnerf.data.augmentation.sequence import AugmentationSequence
from charnerf.data.augmentation.stretch import Stretch
from charnerf.data.mixed import MixedDataset
from charnerf.data.sampler import BatchRequest, Share
from charnerf.data.store import CharacterStore
from charnerf.data.surface import AreaSurface
from charnerf.data.validation import shared_out
from charnerf.geometry.hull import build_hull
from charnerf.losses.base import Needs
from charnerf.models.views.mirrored import MirroredSide
from charnerf.surfaces.mesh_files import load_surface_mesh
from support import helpers

ALONE = Share()
VIEWS = MirroredSide()
NAMES = ("lefty", "mirror", "rods", "twin")
CHANGES = AugmentationSequence(
    [
        Recolor(share=0.5),
        Mirror(share=0.5),
        Stretch(share=0.5, width_range=[0.8, 1.03], depth_range=[0.75, 1.3], used_views=VIEWS),
        Drawing(share=0.5, wobble=0.01, shift=0.01, scale=0.01),
    ]
)


def carve(views):
    low = torch.tensor((-1.8, -1.8, -0.8))
    return build_hull(VIEWS(views), box_min=low, box_max=low + 3.6, grid_size=16)


def surface_of(character):
    return None if character.mesh_file is None else AreaSurface(load_surface_mesh(character.mesh_file))


def store_of(root: Path, names: tuple[str, ...] = NAMES) -> CharacterStore:
    return CharacterStore(root=root, names=names, carve=carve, memory_mib=64.0, surface_of=surface_of)


def dataset_of(store: CharacterStore, *, characters: int, share: Share = ALONE) -> MixedDataset:
    return MixedDataset(
        store=store, characters=characters, foreground_share=0.75, needs=Needs(depth=True, space_points=8 * characters),
        used_views=VIEWS, augmentation=CHANGES, seed=7, share=share,
    )  # fmt: skip


def request(step: int, *, times: int = 1) -> BatchRequest:
    return BatchRequest(
        step=step, rays=24 * times, surface_points=16 * times, square=0, phase=0, loss_weights={}
    )


@pytest.mark.parametrize(("processes", "characters"), [(2, 1), (2, 2), (4, 1)])
def test_the_shares_of_a_step_are_the_whole(figure_dataset, processes, characters):
    store = store_of(figure_dataset)
    whole = dataset_of(store, characters=processes * characters)
    parts = [
        dataset_of(store, characters=characters, share=Share(number, processes))
        for number in range(processes)
    ]
    for step in range(4):
        expected = whole[request(step, times=processes)]
        assert len(set(expected.names)) == len(set(expected.seeds)) == processes * characters
        wanted = dict(tensors(expected))
        assert len(wanted) >= 20
        for number, part in enumerate(parts):
            own = slice(number * characters, (number + 1) * characters)
            made = part[request(step)]
            assert made.names == expected.names[own] and made.seeds == expected.seeds[own]
            found = dict(tensors(made))
            assert found.keys() == wanted.keys()
            assert [name for name in found if not torch.equal(found[name], wanted[name][own])] == []


def tensors(record):
    """All tensors of a batch, characters first, by the names of the fields that lead to them."""
    for field in fields(record):
        value = getattr(record, field.name)
        if isinstance(value, torch.Tensor):
            yield field.name, value
        elif is_dataclass(value):
            yield from ((f"{field.name}.{name}", inner) for name, inner in tensors(value))


def test_more_places_than_characters_are_filled(figure_dataset):
    """Every character is drawn once before any is drawn again, with other rays."""
    store = store_of(figure_dataset, NAMES[:2])
    batches = [
        dataset_of(store, characters=1, share=Share(number, 3))[request(step=0)] for number in range(3)
    ]
    names = [batch.names[0] for batch in batches]
    assert set(names[:2]) == set(NAMES[:2]) and names[2] in NAMES[:2]
    assert not torch.equal(batches[names.index(names[2])].rays.origins, batches[2].rays.origins)


def test_a_step_has_surface_points_in_all_processes_or_in_none(tmp_path):
    helpers.write_figure(tmp_path, "bare", "train", helpers.ball(), views=2, mesh=False)
    helpers.write_figure(tmp_path, "solid", "train", helpers.ball(), views=2)
    store = store_of(tmp_path, ("bare", "solid"))
    for number in range(2):
        batch = dataset_of(store, characters=1, share=Share(number, 2))[request(step=0)]
        assert batch.surface is None
    assert dataset_of(store_of(tmp_path, ("solid",)), characters=1)[request(step=0)].surface is not None


@pytest.mark.parametrize("processes", [1, 2, 3, 5])
def test_every_picture_is_drawn_and_all_draw_as_many(processes):
    shares = [shared_out(4, Share(number, processes)) for number in range(processes)]
    assert {index for share in shares for index in share} == set(range(4))
    assert len({len(share) for share in shares}) == 1 and len(shares[0]) == -(-4 // processes)
