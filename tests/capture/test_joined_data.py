"""A data set on disk and generated characters beside it."""

import pytest
import torch

from charnerf.capture.joined_data import JoinedData
from charnerf.data.characters import load_character
from charnerf.data.layout import read_dataset
from charnerf.errors import ConfigError, DataError


@pytest.fixture
def joined(figure_dataset, tmp_path):
    """Of the data set of figures: what is joined to it."""

    def make(root=figure_dataset, **counts):
        return JoinedData(
            root=str(root),
            **{"embedded": 0, "shapes": 0, "people": 0, "assets": None, **counts},
            seed=1,
            size=64,
            views=1,
            cache=str(tmp_path),
        )

    return make


def test_what_is_generated_joins_train_and_nothing_is_copied(joined, figure_dataset):
    own = read_dataset(figure_dataset).splits
    data = joined(shapes=1, embedded=1)
    assert data.split_sizes() == {name: len(names) + 2 * (name == "train") for name, names in own.items()}
    root = data.prepare()
    splits = read_dataset(root).splits
    assert splits["train"] == (*own["train"], "embedded-00000", "shapes-00000")
    assert {name: splits[name] for name in ("val", "test")} == {name: own[name] for name in ("val", "test")}
    assert (root / own["val"][0]).samefile(figure_dataset / own["val"][0])
    pictures = [load_character(root, name).images([0]) for name in splits["train"]]
    assert all((one[..., 3] > 0).any() for one in pictures)
    assert not any(torch.equal(pictures[-1], one) for one in pictures[:-1] if one.shape == pictures[-1].shape)
    assert data.prepare() == root and read_dataset(root).splits == splits
    assert read_dataset(figure_dataset).splits == own


def test_runs_that_would_not_train_on_it_are_refused(joined):
    data = joined(shapes=1)
    data.check_splits(train=["train"], val="val", test="test")
    for wrong in ({"train": ["val"]}, {"test": "train"}):
        with pytest.raises(ConfigError, match="expected 'train' in train alone"):
            data.check_splits(**{"train": ["train"], "val": "val", "test": "test", **wrong})
    with pytest.raises(
        ConfigError, match=r"data\.embedded, data\.shapes, data\.people: found 0, 0, 0.*data=folder"
    ):
        joined()
    with pytest.raises(ConfigError, match=r"data\.assets: not set"):
        joined(people=1)


def test_a_name_that_is_taken_is_named(joined, figure_dataset, tmp_path):
    root = joined(shapes=1).prepare()
    with pytest.raises(DataError, match="already holds shapes-00000"):
        joined(root, shapes=1).prepare()


def test_a_file_system_without_links_is_one_message(joined, monkeypatch):
    def refused(*args, **kwargs):
        raise OSError("Operation not permitted")

    monkeypatch.setattr("pathlib.Path.symlink_to", refused)
    with pytest.raises(DataError, match=r"Operation not permitted.*data\.cache"):
        joined(shapes=1).prepare()
