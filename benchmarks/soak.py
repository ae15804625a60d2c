"""`python -m benchmarks.soak --seconds 3600`: train, capture and reconstruct in one process, again and again; what does it hold?

Writes soak.csv, a line a round while it runs; then soak.json and soak.png. Needs Linux, which tells a process's handles.
"""

from __future__ import annotations

import argparse
import csv
import json
import logging
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from matplotlib.figure import Figure

from charnerf.bench.plots import save_figure
from charnerf.capture.character import CaptureOptions
from charnerf.capture.dataset import capture_dataset
from charnerf.config.composition import compose_config
from charnerf.data.layout import read_dataset
from charnerf.evaluation.environment import environment
from charnerf.files import write_text
from charnerf.inference import weights
from charnerf.meshing.export import save_mesh
from charnerf.procedural import make_character
from charnerf.process import keep_freed_memory, use_fastest_products
from charnerf.training.run import run_training

SIZE = 32  # pixels of drawings and pictures: what leaks does so by the call, not by the pixel
WARM = 10  # rounds after which memory should stay as it is
SPLITS = {"train": 2, "val": 1, "test": 1}
SHORT = (
    "scale=smoke",
    "trainer=cpu",
    "scale.steps=12",
    "validation.times=2",
    "scale.eval_views=2",
    "batches.workers=1",
)
_PROCESS = Path("/proc/self")


@dataclass(frozen=True)
class Held:
    """What the process holds after a round.

    Attributes:
        round: Its number, from 1.
        seconds: Since the first one began.
        resident_mib: Resident memory, MiB.
        handles: Open files, pipes and sockets.
        threads: Of the process.
        children: Processes that it began and that are there.
    """

    round: int
    seconds: float
    resident_mib: float
    handles: int
    threads: int
    children: int


def held(number: int, seconds: float) -> Held:
    """What this process holds now."""
    status = dict(line.split(":", 1) for line in (_PROCESS / "status").read_text().splitlines())
    listed = sum(1 for _ in (_PROCESS / "fd").iterdir()) - 1  # without the listing's own
    children = [one.read_text().split() for one in (_PROCESS / "task").glob("*/children")]
    return Held(
        round=number,
        seconds=round(seconds, 1),
        resident_mib=round(int(status["VmRSS"].split()[0]) / 1024.0, 1),
        handles=listed,
        threads=int(status["Threads"]),
        children=sum(map(len, children)),
    )


def soak(
    work: Sequence[Callable[[], object]], *, seconds: float, least: int, note: Callable[[Held], None]
) -> list[Held]:
    """Do all the work round by round, for so many seconds and rounds at least; `note` gets what is held after each."""
    rounds: list[Held] = []
    begun = time.monotonic()
    while len(rounds) < least or time.monotonic() - begun < seconds:
        for one in work:
            one()
        rounds.append(held(len(rounds) + 1, time.monotonic() - begun))
        note(rounds[-1])
    return rounds


def summary(rounds: Sequence[Held], *, warm: int = WARM) -> dict[str, Any]:
    """How memory and handles went after the first rounds.

    Args:
        rounds: All of them, in order.
        warm: How many are left out; what is held after the last of them is what later ones are compared with.
    """
    later = rounds[warm - 1 :]
    memory = [one.resident_mib for one in later]
    return {
        "rounds": len(rounds),
        "minutes": rounds[-1].seconds / 60.0,
        "warm": warm,
        "warm_mib": memory[0],
        "last_mib": memory[-1],
        "largest_rise": max(memory) / memory[0] - 1.0,
        "handles": [f(one.handles for one in later) for f in (min, max)],
        "threads": [f(one.threads for one in later) for f in (min, max)],
        "children": [f(one.children for one in later) for f in (min, max)],
    }


def works(folder: Path) -> list[Callable[[], object]]:
    """What a round does: a training with evaluation and report, a capture in two processes, a reconstruction; each written anew."""
    meshes: dict[str, list[Path]] = {}
    for index, (split, count) in enumerate(SPLITS.items()):
        meshes[split] = [folder / "meshes" / f"{split}{number}.glb" for number in range(count)]
        for number, file in enumerate(meshes[split]):
            file.parent.mkdir(exist_ok=True)
            make_character(10 * index + number).export(file)
        _capture(meshes[split], folder / "set", split)
    return [
        partial(_train, folder / "set", folder / "run"),
        partial(_capture_anew, meshes["train"], folder / "captured"),
        partial(_reconstruct, folder / "set", folder / "hero.glb"),
    ]


def _train(dataset: Path, folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    run_training(compose_config([*SHORT, "data=folder", f"data.root={dataset}"]), folder)


def _capture(meshes: Sequence[Path], root: Path, split: str) -> None:
    options = CaptureOptions(views=4, size=SIZE)
    report = capture_dataset(meshes, root, split, options=options, up="z", facing="-y", processes=2)
    assert not report.failed, report.failed


def _capture_anew(meshes: Sequence[Path], root: Path) -> None:
    shutil.rmtree(root, ignore_errors=True)
    _capture(meshes, root, "train")


def _reconstruct(dataset: Path, file: Path) -> None:
    """With the released weights, loaded anew."""
    name = read_dataset(dataset).splits["test"][0]
    front, side, back = (dataset / name / "sources" / f"{view}.png" for view in ("front", "side", "back"))
    hero = weights.load().encode(front=front, side=side, back=back)
    assert np.isfinite(hero.render(azimuth_deg=45, size=64)).all()
    save_mesh(hero.mesh(resolution=48, num_cameras=2, faces=2000), file)


def plot(rounds: Sequence[Held], path: Path) -> Path:
    """Draw memory and handles over minutes."""
    figure = Figure(figsize=(7, 4.2), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    minutes = [one.seconds / 60.0 for one in rounds]
    above.plot(minutes, [one.resident_mib for one in rounds], lw=1)
    above.set(ylabel="resident memory, MiB", ylim=(0, None))
    for name in ("handles", "threads", "children"):
        below.plot(minutes, [getattr(one, name) for one in rounds], lw=1, label=name)
    below.set(xlabel="minutes", ylabel="count", ylim=(0, None))
    below.legend(fontsize=8)
    for axes in (above, below):
        axes.grid(True, alpha=0.3)
    return save_figure(figure, path)


def main(arguments: Sequence[str]) -> None:
    """Soak for as long as the command line says."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soak", description=__doc__)
    parser.add_argument("--seconds", type=float, default=3600.0, help="rounds begin for so long")
    parser.add_argument(
        "-o", "--output", type=Path, default=Path("outputs/soak"), help="folder for figures and diagram"
    )
    parser.add_argument(
        "--note", default="", help="stands beside the figures: what else the machine did, say"
    )
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    keep_freed_memory()
    use_fastest_products()
    logging.basicConfig(level=logging.ERROR)
    with tempfile.TemporaryDirectory() as folder, (options.output / "soak.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, [one.name for one in fields(Held)], lineterminator="\n")
        writer.writeheader()

        def note(one: Held) -> None:
            writer.writerow(asdict(one))
            file.flush()

        rounds = soak(works(Path(folder)), seconds=options.seconds, least=WARM + 1, note=note)
    facts = {"note": options.note, "environment": environment(torch.device("cpu")), **summary(rounds)}
    write_text(options.output / "soak.json", json.dumps(facts, indent=2) + "\n")
    plot(rounds, options.output / "soak.png")


if __name__ == "__main__":
    main(sys.argv[1:])
