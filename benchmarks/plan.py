"""`python -m benchmarks.plan --data DATASET -o docs/machines`: what a large training needs, on paper, from a data set's files.

Sizes are measured; steps a second and prices of a GPU are assumed, and stand in the table as such. Writes plan.csv.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.csv_rows import write_rows

MOST_MEASURED = 100  # characters whose files are looked at
PAIR_BYTES = 2  # each gradient is sent about twice in a ring
SHARD_BYTES = 64 * 2**20
FILES_A_SECOND = 1000.0  # small files that a network file system opens for one process, assumed
DOLLARS_AN_HOUR = 3.0  # of a GPU, assumed


@dataclass(frozen=True)
class Character:
    """Means over a data set: bytes of its files, of its pictures' pixels when open (with an index each), and its files."""

    disk_bytes: float
    picture_bytes: float
    open_bytes: float
    files: float


def character_of(root: Path) -> Character:
    """Measure the files of a data set's characters, as many as MOST_MEASURED, spread over its first split."""
    info = json.loads((root / "dataset.json").read_text(encoding="utf-8"))
    names = next(iter(info["splits"].values()))
    names = names[:: max(1, len(names) // MOST_MEASURED)]
    files = [(name, file) for name in names for file in (root / name).rglob("*") if file.is_file()]
    sizes = {file: file.stat().st_size for _, file in files}
    cameras = [json.loads((root / name / "transforms.json").read_text(encoding="utf-8")) for name in names]
    pixels = sum(len(one["frames"]) * one["w"] * one["h"] for one in cameras) / len(names)
    count = len(names)
    return Character(
        disk_bytes=sum(sizes.values()) / count,
        picture_bytes=sum(
            size for file, size in sizes.items() if file.suffix == ".png" and file.parent.name != "mesh"
        )
        / count,
        open_bytes=8.0 * pixels,  # RGBA, and a flat index
        files=len(files) / count,
    )


def plan(
    one: Character,
    *,
    characters: int,
    gpus: int,
    steps: int,
    steps_a_second: float,
    window: int,
    weights_bytes: int,
) -> list[tuple[str, str, str]]:
    """Rows of the table: what, how much, how it comes about."""
    hours = steps / steps_a_second / 3600.0
    reads = gpus * steps_a_second
    return [
        (
            "bytes on disk",
            f"{characters * one.disk_bytes / 1e12:.2f} TB",
            f"{one.disk_bytes / 1e6:.2f} MB a character, measured",
        ),
        (
            "of them pictures",
            f"{characters * one.picture_bytes / 1e9:.0f} GB",
            f"{one.picture_bytes / 1e3:.0f} kB, measured; meshes are the rest",
        ),
        (
            "files as folders",
            f"{characters * one.files / 1e6:.0f} million",
            f"{one.files:.0f} a character, measured",
        ),
        ("files as shards", f"{characters * one.disk_bytes / SHARD_BYTES:.0f}", "of 64 MiB"),
        ("steps", f"{steps}", "of scale=paper; a character a step and process"),
        ("times each character is seen", f"{steps * gpus / characters:.1f}", "steps * GPUs / characters"),
        (
            "hours",
            f"{hours:.1f}",
            f"{steps_a_second:.0f} steps a second and GPU, assumed: a step is some thousand small kernels",
        ),
        (
            "cost",
            f"{hours * gpus * DOLLARS_AN_HOUR:.0f} dollars",
            f"{hours * gpus:.0f} GPU hours of {DOLLARS_AN_HOUR:.0f} dollars, assumed",
        ),
        (
            "reading, nothing kept",
            f"{reads * one.disk_bytes / 1e9:.2f} GB/s",
            f"{reads:.0f} characters a second over all",
        ),
        (
            "reading, pictures alone",
            f"{reads * one.picture_bytes / 1e6:.0f} MB/s",
            "a loss that reads no surface",
        ),
        (
            "memory of a process",
            f"{window * one.open_bytes / 1e9:.2f} GB",
            f"a window of {window} characters, {one.open_bytes / 1e6:.1f} MB each open",
        ),
        (
            "gradients of a process",
            f"{PAIR_BYTES * weights_bytes * steps_a_second / 1e6:.0f} MB/s",
            f"{weights_bytes / 1e6:.1f} MB of weights, each step, there and back",
        ),
        (
            "a look at every file",
            f"{characters * one.files / FILES_A_SECOND / 3600.0:.0f} h",
            f"as folders, {FILES_A_SECOND:.0f} files a second, assumed",
        ),
    ]


def main(arguments: Sequence[str]) -> None:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.plan", description=__doc__)
    add = parser.add_argument
    add("--data", type=Path, required=True, help="data set whose characters are like those meant")
    add(
        "--weights",
        type=Path,
        default=Path("src/charnerf/weights/released.safetensors"),
        help="of the model meant",
    )
    add("--characters", type=int, default=1_000_000)
    add("--gpus", type=int, default=64)
    add("--steps", type=int, default=400_000)
    add("--steps-a-second", type=float, default=30.0)
    add("--window", type=int, default=1024)
    add("-o", "--output", type=Path, default=Path("outputs/plan"))
    options = parser.parse_args(arguments)
    rows = plan(
        character_of(options.data),
        characters=options.characters,
        gpus=options.gpus,
        steps=options.steps,
        steps_a_second=options.steps_a_second,
        window=options.window,
        weights_bytes=options.weights.stat().st_size,
    )
    titles = (f"{options.characters} characters, {options.gpus} GPUs", "how much", "how it comes about")
    write_rows(options.output / "plan.csv", (dict(zip(titles, row, strict=True)) for row in rows))


if __name__ == "__main__":
    main(sys.argv[1:])
