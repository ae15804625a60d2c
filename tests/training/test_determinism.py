"""The same seed gives the same files, byte by byte, on one machine with one number of threads."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

TIMED = {  # what holds seconds, dates or settings that may differ
    "best.ckpt",
    "last.ckpt",
    "previous.ckpt",
    "config.yaml",
    "curve.csv",
    "curve.png",
    "metrics.json",
    "report.html",
    "report.md",
    "train.log",
}


def trained(dataset: Path, folder: Path, *, threads: int, workers: int, hash_seed: int) -> Path:
    command = [sys.executable, "-m", "charnerf", "train", "scale=smoke", "trainer=cpu", "data=folder"]
    settings = [f"data.root={dataset}", f"batches.workers={workers}", f"hydra.run.dir={folder}"]
    small = ["loss=charnerf", "schedule=two_phase", "scale.eval_views=1", "validation.views=1"]
    environment = {"OMP_NUM_THREADS": str(threads), "PYTHONHASHSEED": str(hash_seed)}
    subprocess.run(
        [*command, *settings, *small], env={**os.environ, **environment}, check=True, capture_output=True
    )
    return folder


def files(folder: Path) -> dict[str, bytes]:
    found = (path for path in folder.rglob("*") if path.is_file() and ".hydra" not in path.parts)
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in found
        if path.name not in TIMED and not path.name.startswith("events.out")
    }


def untimed(value: Any) -> Any:
    """Without seconds, memory and the machine."""
    if not isinstance(value, dict):
        return value
    return {
        key: untimed(inner)
        for key, inner in value.items()
        if "second" not in key and "memory" not in key and key != "environment"
    }


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "curve.csv").open() as file:
        return [
            {key: value for key, value in row.items() if key != "seconds"} for row in csv.DictReader(file)
        ]


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 2])
def test_a_seed_gives_the_same_files(figure_dataset, tmp_path, threads):
    """Whatever the order of Python's sets, and however many workers make batches."""
    one, other = (
        trained(figure_dataset, tmp_path / str(workers), threads=threads, workers=workers, hash_seed=workers)
        for workers in (1, 2)
    )
    first, second = files(one), files(other)
    assert {"weights.safetensors", "views.csv", "meshes/twin.glb", "images/twin/000.png"} <= first.keys()
    assert first.keys() == second.keys()
    assert [name for name in first if first[name] != second[name]] == []
    assert rows(one) == rows(other)
    metrics = [untimed(json.loads((folder / "metrics.json").read_text())) for folder in (one, other)]
    assert metrics[0] == metrics[1] and metrics[0]["psnr"] > 0
