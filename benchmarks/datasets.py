"""`python -m benchmarks.datasets`: what data sets cost to capture, to keep, and to train from, out of folder, cache and shards.

Seconds are those of the processor, one thread: they hold on a busy machine too.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import torch

from benchmarks.csv_rows import write_rows
from charnerf.capture.character import CaptureOptions, capture_character
from charnerf.capture.generated import character_seed, generate_dataset
from charnerf.capture.renderers.blender import Blender
from charnerf.config.composition import compose_config
from charnerf.data.layout import read_dataset
from charnerf.data.mixed import MixedDataset
from charnerf.data.packing import pack
from charnerf.data.sampler import BatchRequest, Share
from charnerf.data.shards_data import ShardsData
from charnerf.data.store import CharacterStore
from charnerf.data.window import Window, groups_of
from charnerf.errors import DependencyError
from charnerf.geometry.framing import SOURCE_ORDER
from charnerf.inference.build import build_model
from charnerf.losses.base import Needs
from charnerf.procedural import make_character
from charnerf.surfaces.raycast import RayCaster
from charnerf.training.run import training_renderer

CHARACTERS, VIEWS, SIZE = 20, 12, 128  # of the set that is trained on
HELD = 2  # characters of the window, a tenth
EXCHANGED = 32  # steps, as `batches.window_steps`
TURNS, STEPS = 2, 32
CAPTURED = 2  # characters, by each number of views
SHARD_MIB = 0.3  # two characters


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    measure: str
    value: float
    unit: str


def main(arguments: Sequence[str]) -> None:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.datasets", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/datasets.csv"))
    output = parser.parse_args(arguments).output
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as folder:
        write_rows(
            output,
            (
                {
                    "measure": row.measure,
                    "value": f"{row.value:.3g}" if row.value < 1000 else f"{row.value:.0f}",
                    "unit": row.unit,
                }
                for part in (capture_rows, blender_rows, partial(dataset_rows, Path(folder)))
                for row in part()
            ),
        )


def capture_rows() -> list[Row]:
    """Seconds a character and rays a second of the built-in capture, in one process."""
    rows = []
    for views in (48, 300):
        counted, seconds = _Rays(), []
        for index in range(CAPTURED):
            scene = make_character(character_seed(0, "test", index))
            begun = time.process_time()
            with counted:
                capture_character(scene, CaptureOptions(views=views, size=SIZE))
            seconds.append(time.process_time() - begun)
        rows.append(Row(f"capture, {views} views of {SIZE} px", statistics.median(seconds), "s a character"))
        rows.append(Row(f"capture, {views} views of {SIZE} px", counted.rays / sum(seconds), "rays a second"))
    return rows


def blender_rows() -> list[Row]:
    """The same of Blender, by Cycles and with its start, of one character; none where there is no Blender."""
    renderer = Blender()
    try:
        renderer.check()
    except DependencyError as err:
        sys.stderr.write(f"{err}\n")
        return []
    rows, scene = [], make_character(character_seed(0, "test", 0))
    for views in (48, 300):
        begun = os.times()
        capture_character(scene, CaptureOptions(views=views, size=SIZE, renderer=renderer))
        ended = os.times()
        seconds = sum(
            getattr(ended, name) - getattr(begun, name)
            for name in ("user", "system", "children_user", "children_system")
        )
        rays = (views + len(SOURCE_ORDER)) * SIZE**2 * renderer.samples
        rows.append(Row(f"capture by Blender, {views} views of {SIZE} px", seconds, "s a character"))
        rows.append(Row(f"capture by Blender, {views} views of {SIZE} px", rays / seconds, "rays a second"))
    return rows


class _Rays:
    """Counts the rays that are traced while it is entered."""

    def __init__(self) -> None:
        self.rays = 0

    def __enter__(self) -> None:
        self._traced = RayCaster.pixel_hits
        counted, traced = self, RayCaster.pixel_hits

        def counting(caster: RayCaster, camera: object, pixels: torch.Tensor) -> object:
            counted.rays += len(pixels)
            return traced(caster, camera, pixels)  # type: ignore[arg-type]

        RayCaster.pixel_hits = counting  # type: ignore[assignment, method-assign]

    def __exit__(self, *_: object) -> None:
        RayCaster.pixel_hits = self._traced  # type: ignore[method-assign]


def dataset_rows(folder: Path) -> list[Row]:
    """Bytes a character, and rays a second of training, in turns: all in memory, a tenth in memory, and that from shards."""
    root = folder / "set"
    generate_dataset(root, CHARACTERS, 0, 0, 0, views=VIEWS, size=SIZE, processes=1)
    begun = time.process_time()
    index = pack(root, folder / "shards", shard_mib=SHARD_MIB, packed=lambda _: None)
    seconds = time.process_time() - begun
    kept = sum(file.stat().st_size for file in root.rglob("*") if file.is_file())
    packed = sum(shard.size for shard in index.shards)
    cache = ShardsData(
        root=str(folder / "shards"),
        cache=str(folder / "cache"),
        cache_mib=2.5 * packed / CHARACTERS * HELD / 2**20,
    )
    each = CHARACTERS / len(index.shards)
    names = read_dataset(root).splits["train"]
    ways = {
        "a folder, all in memory": _Training(root, names, None),
        "a folder, a tenth in memory": _Training(
            root, names, Window(groups_of(names, None), HELD, EXCHANGED, 0)
        ),
        "shards, a tenth in memory and on disk": _Training(
            cache.prepare(),
            names,
            Window(
                groups_of(names, [shard.names for shard in index.shards]),
                max(1, round(HELD / each)),
                round(EXCHANGED * each),
                0,
            ),
        ),
    }
    speeds = _in_turns({name: one.rays_a_second for name, one in ways.items()})
    first = speeds["a folder, all in memory"]
    return [
        Row(
            f"{VIEWS} views of {SIZE} px with mesh, in a folder", kept / CHARACTERS / 1024, "KiB a character"
        ),
        Row(
            f"{VIEWS} views of {SIZE} px with mesh, in shards", packed / CHARACTERS / 1024, "KiB a character"
        ),
        Row("packing", seconds / CHARACTERS, "s a character"),
        *(Row(f"training from {name}", speed, "rays a second") for name, speed in speeds.items()),
        *(
            Row(f"training from {name}", 100.0 * speed / first, "% of all in memory")
            for name, speed in list(speeds.items())[1:]
        ),
    ]


def _in_turns(ways: dict[str, Callable[[], float]]) -> dict[str, float]:
    """The mean of a few turns, taken one after the other, after one that warms up; as many characters come in each."""
    turns = [{name: measure() for name, measure in ways.items()} for _ in range(TURNS + 1)][1:]
    return {name: statistics.mean(turn[name] for turn in turns) for name in ways}


class _Training:
    """Steps (batch, encode, render, gradient, Adam) at scale=small on a data set, going on from turn to turn."""

    def __init__(self, root: Path, names: Sequence[str], window: Window | None) -> None:
        cfg = compose_config(["scale=small"])
        self._network = build_model(cfg).train()
        self._renderer = training_renderer(cfg)
        self._rays = int(cfg.scale.phase_rays[0])
        self._optimizer = torch.optim.Adam(self._network.parameters(), lr=1e-4)
        self._step = 0
        store = CharacterStore(root=root, names=names, carve=self._network.carve, memory_mib=4096.0)
        self._dataset = MixedDataset(
            store=store,
            characters=1,
            foreground_share=0.75,
            needs=Needs(),
            used_views=self._network.views,
            augmentation=lambda batch, _: batch,
            seed=0,
            share=Share(),
            window=window,
        )
        if window is None:
            for name in names:
                store.open(name)
        else:
            store.memory_bytes = (HELD + 1.5) * store.open(names[0]).size_bytes

    def rays_a_second(self) -> float:
        """Of a turn of steps."""
        begun = time.process_time()
        for _ in range(STEPS):
            request = BatchRequest(
                step=self._step, rays=self._rays, surface_points=0, square=0, phase=0, loss_weights={}
            )
            batch = self._dataset[request]
            scene = self._network.scene(self._network.encode(batch.views, batch.hull), 0)
            rendered = self._renderer.render(scene, batch.rays[0], torch.Generator().manual_seed(self._step))
            loss = (rendered.finest.rgb - batch.rgb[0]).square().mean()
            self._optimizer.zero_grad()
            loss.backward()
            self._optimizer.step()
            self._step += 1
        return STEPS * self._rays / (time.process_time() - begun)


if __name__ == "__main__":
    main(sys.argv[1:])
