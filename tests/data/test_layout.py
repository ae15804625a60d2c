import json
import multiprocessing

import pytest

from charnerf.data.layout import (
    DatasetInfo,
    add_to_split,
    names_of,
    open_or_new,
    read_dataset,
    refuse_taken_names,
    write_dataset,
)
from charnerf.errors import DataError


def test_round_trip(tmp_path):
    info = DatasetInfo(root=tmp_path, splits={"train": ("a", "b"), "test": ()}, made_by={"views": 3})
    write_dataset(info)
    assert read_dataset(tmp_path) == info
    assert names_of(info, "train") == ("a", "b")


@pytest.mark.parametrize("split, found", [("test", "is empty"), ("tset", "does not exist")])
def test_empty_and_unknown_splits_are_refused(tmp_path, split, found):
    info = DatasetInfo(root=tmp_path, splits={"train": ("a",), "test": ()}, made_by={})
    with pytest.raises(DataError, match=f"'{split}' {found}.*train \\(1\\), test \\(0\\)"):
        names_of(info, split)


@pytest.mark.parametrize(
    "content, message",
    [
        ("{", "can not be read as JSON"),
        ("[]", "found a JSON list, expected an object"),
        ('{"format": "nerf"}', "found format 'nerf', expected 'charnerf-dataset'"),
        ('{"format": "charnerf-dataset", "version": 7}', "found version 7, this charnerf reads version 1"),
        ('{"format": "charnerf-dataset", "version": 1}', "splits: found None"),
        ('{"format": "charnerf-dataset", "version": 1, "splits": {"a": "b"}}', "splits.a: found 'b'"),
        ('{"format": "charnerf-dataset", "version": 1, "splits": {"a": ["../b"]}}', "'../b'.*rename"),
        ('{"format": "charnerf-dataset", "version": 1, "splits": {"a": ["b", "b"]}}', "b more than once"),
        (
            '{"format": "charnerf-dataset", "version": 1, "splits": {"a": ["%s"]}}' % ("b" * 201),
            "'b{100}': expected .* 200",
        ),
    ],
)
def test_wrong_dataset_files_are_named(tmp_path, content, message):
    (tmp_path / "dataset.json").write_text(content)
    with pytest.raises(DataError, match=message) as caught:
        read_dataset(tmp_path)
    assert str(tmp_path / "dataset.json") in str(caught.value)


def test_a_missing_data_set_is_named(tmp_path):
    with pytest.raises(DataError, match=r"dataset\.json: no such file"):
        read_dataset(tmp_path)


def test_adding_keeps_what_is_there(tmp_path):
    add_to_split(tmp_path, "train", ["b"], made_by={"views": 1})
    add_to_split(tmp_path, "train", ["a"], made_by={"size": 2})
    info = add_to_split(tmp_path, "test", ["c"])
    assert info.splits == {"train": ("a", "b"), "test": ("c",)}
    assert info.made_by == {"views": 1, "size": 2}
    with pytest.raises(DataError, match="already lists a"):
        add_to_split(tmp_path, "test", ["a"])
    assert json.loads((tmp_path / "dataset.json").read_text())["splits"]["test"] == ["c"]
    assert [path.name for path in tmp_path.iterdir()] == ["dataset.json"]


def test_processes_adding_at_once_lose_nothing(tmp_path):
    context = multiprocessing.get_context("fork")
    workers = [
        context.Process(target=add_to_split, args=(tmp_path, "train", [f"n{index}"])) for index in range(8)
    ]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert read_dataset(tmp_path).splits["train"] == tuple(f"n{index}" for index in range(8))


def test_taken_and_doubled_names_are_refused(tmp_path):
    add_to_split(tmp_path, "train", ["hero"])
    (tmp_path / "loose").mkdir()
    info = read_dataset(tmp_path)
    with pytest.raises(DataError, match=r"hero \(split train\), loose \(in no split\)"):
        refuse_taken_names(info, ["hero", "loose", "new"])
    with pytest.raises(DataError, match="x: given more than once"):
        refuse_taken_names(info, ["x", "x"])
    with pytest.raises(DataError, match="rename"):
        refuse_taken_names(info, ["a b"])


def test_a_folder_of_other_things_is_no_data_set(tmp_path):
    (tmp_path / "thesis.txt").write_text("")
    with pytest.raises(DataError, match=r"is not empty and has no dataset\.json"):
        open_or_new(tmp_path)
    assert open_or_new(tmp_path / "new").splits == {}
