"""Generated characters as data of a run: the cache, and which settings name a folder of it."""

import pytest
import torch

from charnerf.capture import generated_data as module
from charnerf.capture import shapes_data
from charnerf.capture.people_data import PeopleData
from charnerf.capture.procedural_data import ProceduralData
from charnerf.capture.shapes_data import ShapesData
from charnerf.data.characters import load_character
from charnerf.data.folder import FolderData
from charnerf.data.layout import read_dataset
from charnerf.errors import DataError, DependencyError
from tests.support.people_assets import write_assets


def test_data_are_generated_once_under_a_name_for_its_settings(tmp_path, monkeypatch):
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


def test_shapes_come_as_other_data_in_a_folder_of_their_own(tmp_path):
    settings = {"train": 1, "val": 0, "test": 0, "seed": 1, "size": 8, "views": 1, "cache": str(tmp_path)}
    root = ShapesData(**settings).prepare()
    assert root != ProceduralData(**settings).root
    assert read_dataset(root).made_by["generator"] == "shapes"
    assert (load_character(root, "train-00000").images([0])[..., 3] > 0).any()


def test_what_shapes_need_is_missed_before_any_work(tmp_path, monkeypatch):
    monkeypatch.setattr(shapes_data, "find_spec", lambda name: None)
    data = ShapesData(train=1, val=0, test=0, seed=1, size=8, views=1, cache=str(tmp_path))
    with pytest.raises(DependencyError, match=r"manifold3d.*charnerf\[shapes\]"):
        data.check_image_size(8)
    assert not list(tmp_path.iterdir())


def test_people_come_of_assets_which_are_missed_before_any_work(tmp_path):
    settings = {
        "train": 2,
        "val": 0,
        "test": 0,
        "seed": 1,
        "size": 8,
        "views": 1,
        "cache": str(tmp_path / "cache"),
    }
    data = PeopleData(assets=str(tmp_path / "assets"), **settings)
    with pytest.raises(DataError, match="found no mpfb2"):
        data.check_image_size(8)
    write_assets(tmp_path / "assets")
    data.check_image_size(8)
    root = data.prepare()
    made_by = read_dataset(root).made_by
    assert made_by["generator"] == "people" and made_by["assets"] == data.generator.facts["assets"]
    assert (load_character(root, "train-00000").images([0])[..., 3] > 0).any()
    assert str(tmp_path) not in (root / "dataset.json").read_text()
