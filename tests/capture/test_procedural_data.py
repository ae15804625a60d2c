"""Data sets of embedded characters: seeds, resuming, the cache."""

import shutil

import pytest
import torch

from charnerf.capture import procedural_data as module
from charnerf.capture.procedural_data import SPLITS, ProceduralData, character_seed, generate_dataset
from charnerf.data.characters import load_character
from charnerf.data.folder import FolderData
from charnerf.data.layout import read_dataset
from charnerf.errors import ConfigError, DataError

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


def test_another_seed_or_setting_does_not_mix(made):
    with pytest.raises(DataError, match="seed"):
        generate_dataset(made, **{**SMALL, "seed": 4})
    with pytest.raises(DataError, match="size"):
        generate_dataset(made, **{**SMALL, "size": 32})


@pytest.mark.parametrize(
    "wrong", [{"train": -1}, {"train": 0, "test": 0}, {"views": 0}, {"size": 2}, {"seed": -1}]
)
def test_numbers_out_of_range_are_refused(tmp_path, wrong):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        generate_dataset(tmp_path / "new", **{**SMALL, **wrong})
    assert not (tmp_path / "new").exists()


def test_procedural_data_generates_once_under_a_name_for_its_settings(tmp_path, monkeypatch):
    data = ProceduralData(train=1, val=0, test=0, seed=1, size=8, views=1, cache=str(tmp_path))
    root = data.prepare()
    assert root.parent == tmp_path
    assert read_dataset(root).splits["train"] == ("train-00000",)
    monkeypatch.setattr(module, "generate_dataset", lambda *args, **kwargs: pytest.fail("made again"))
    assert (
        ProceduralData(train=1, val=0, test=0, seed=1, size=8, views=1, cache=str(tmp_path)).prepare() == root
    )
    others = [{"seed": 2}, {"size": 16}, {"views": 2}, {"train": 2}]
    settings = {"train": 1, "val": 0, "test": 0, "seed": 1, "size": 8, "views": 1, "cache": str(tmp_path)}
    roots = {ProceduralData(**{**settings, **other}).root for other in others}
    assert len(roots | {root}) == 5


def test_depth_is_captured_only_where_it_is_asked_for(tmp_path):
    """The same character, the same pictures, in a folder of its own."""
    data = ProceduralData(train=1, val=0, test=0, seed=1, size=8, views=1, cache=str(tmp_path))
    plain, deep = data.prepare(), data.prepare(depth=True)
    assert plain != deep and data.prepare(depth=True) == deep and data.root == plain
    one, other = (load_character(root, "train-00000") for root in (plain, deep))
    assert not one.depth_files and (other.depths([0]) > 0).any()
    assert torch.equal(one.images([0]), other.images([0]))
    assert FolderData(root=str(deep)).prepare(depth=True) == deep
    assert FolderData(root=str(plain)).prepare() == plain
    with pytest.raises(DataError, match="charnerf capture --depth"):
        FolderData(root=str(plain)).prepare(depth=True)
    with pytest.raises(DataError, match=r"charnerf capture --depth.*its weight to 0"):
        one.depths([0])


def test_cache_follows_the_users_setting(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    data = ProceduralData(train=1, val=1, test=1, seed=0, size=64, views=4)
    assert data.root.parent == tmp_path / "charnerf"
