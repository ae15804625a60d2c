"""Data sets of generated characters: seeds, resuming."""

import shutil
from contextlib import contextmanager

import pytest

from charnerf.capture import generated as module
from charnerf.capture.generated import SPLITS, Generator, character_seed, generate_dataset
from charnerf.data.characters import load_character
from charnerf.data.layout import read_dataset
from charnerf.errors import ConfigError, DataError
from charnerf.interruption import Stopped
from tests.support.processes import ended_process

SMALL = {"train": 1, "val": 0, "test": 1, "seed": 3, "views": 2, "size": 16}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    root = tmp_path_factory.mktemp("cache") / "embedded"
    generate_dataset(root, **SMALL, processes=1)
    return root


def test_splits_never_share_a_seed():
    seeds = [character_seed(0, split, index) for split in SPLITS for index in range(500)]
    seeds += [character_seed(1, split, index) for split in SPLITS for index in range(500)]
    assert len(set(seeds)) == len(seeds)
    assert character_seed(0, "train", 5) == character_seed(0, "train", 5)


def test_generated_set_reads_as_any_other(made):
    info = read_dataset(made)
    assert info.splits == {"train": ("train-00000",), "val": (), "test": ("test-00000",)}
    assert info.made_by["seed"] == 3
    character = load_character(made, "train-00000")
    assert character.images([0, 1]).shape == (2, 16, 16, 4)
    assert character.source_names == ("front", "side", "back")
    assert character.mesh_file.is_file()


def test_resuming_keeps_what_is_there_and_makes_the_rest(made, tmp_path, monkeypatch):
    root = tmp_path / "copy"
    shutil.copytree(made, root)
    shutil.rmtree(root / "test-00000")
    calls = []
    capture = module.capture_scene_to
    monkeypatch.setattr(module, "capture_scene_to", lambda *args: calls.append(args[1]) or capture(*args))
    info = generate_dataset(root, **SMALL, processes=1)
    assert calls == ["test-00000"]
    assert info == read_dataset(root)
    one, other = ((base / "test-00000/images/000.png").read_bytes() for base in (made, root))
    assert one == other


def test_a_stop_leaves_no_halves_and_lists_what_is_whole(made, tmp_path, monkeypatch):
    """A worker was killed in the middle of a character while the other one ended a whole one."""
    root = tmp_path / "set"

    @contextmanager
    def stopped(*_):
        (root / f".partial-{ended_process()}-test-00000/images").mkdir(parents=True)
        shutil.copytree(made / "train-00000", root / "train-00000")
        raise Stopped(15)
        yield

    with monkeypatch.context() as patch, pytest.raises(Stopped):
        patch.setattr(module, "in_processes", stopped)
        generate_dataset(root, **SMALL, processes=2)
    assert read_dataset(root).splits["train"] == ("train-00000",)
    assert sorted(path.name for path in root.iterdir()) == [".generate.lock", "dataset.json", "train-00000"]
    assert generate_dataset(root, **SMALL, processes=1).splits == read_dataset(made).splits


def test_another_seed_setting_or_generator_does_not_mix(made):
    with pytest.raises(DataError, match="seed"):
        generate_dataset(made, **{**SMALL, "seed": 4})
    with pytest.raises(DataError, match="size"):
        generate_dataset(made, **{**SMALL, "size": 32})
    with pytest.raises(DataError, match="generator"):
        generate_dataset(made, **SMALL, generator=Generator("others", 2, module.make_character))


@pytest.mark.parametrize(
    "wrong", [{"train": -1}, {"train": 0, "test": 0}, {"views": 0}, {"size": 2}, {"seed": -1}]
)
def test_numbers_out_of_range_are_refused(tmp_path, wrong):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        generate_dataset(tmp_path / "new", **{**SMALL, **wrong})
    assert not (tmp_path / "new").exists()
