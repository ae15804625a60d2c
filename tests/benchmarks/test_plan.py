"""A plan on paper: what is measured is that of the files, and the rest follows from it."""

import csv
import json
from pathlib import Path

import pytest

from benchmarks.plan import Character, character_of, main, plan


def test_a_characters_files_are_counted(figure_dataset: Path) -> None:
    info = json.loads((figure_dataset / "dataset.json").read_text())
    names = next(iter(info["splits"].values()))
    every = [file for name in names for file in (figure_dataset / name).rglob("*") if file.is_file()]
    one = character_of(figure_dataset)
    assert one.files == len(every) / len(names)
    assert one.disk_bytes == sum(file.stat().st_size for file in every) / len(names)
    assert 0 < one.picture_bytes < one.disk_bytes
    assert one.open_bytes == 8 * 32 * 32 * 8  # pictures of 32 pixels, RGBA and an index


def test_the_rest_follows() -> None:
    one = Character(disk_bytes=2e6, picture_bytes=1e6, open_bytes=3e6, files=10)
    rows = plan(
        one, characters=1000, gpus=4, steps=3600, steps_a_second=2.0, window=10, weights_bytes=1_000_000
    )
    found = {what: how_much for what, how_much, _ in rows}
    assert found["times each character is seen"] == "14.4"
    assert (found["hours"], found["cost"]) == ("0.5", "6 dollars")
    assert (found["reading, nothing kept"], found["gradients of a process"]) == ("0.02 GB/s", "4 MB/s")
    assert (found["memory of a process"], found["files as folders"]) == ("0.03 GB", "0 million")


def test_the_table_is_written(figure_dataset: Path, tmp_path: Path) -> None:
    main(["--data", str(figure_dataset), "--gpus", "2", "--characters", "10", "-o", str(tmp_path)])
    with (tmp_path / "plan.csv").open(newline="") as file:
        head, *rows = csv.reader(file)
    assert head[0] == "10 characters, 2 GPUs" and len(rows) == 13
    with pytest.raises(SystemExit):
        main([])
