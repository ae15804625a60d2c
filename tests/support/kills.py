"""Trainings that are killed again and again: `python -m support.kills DATASET FOLDER KILLS SEED [key=value ...]`.

Short trainings are killed at random moments by SIGKILL, SIGTERM and SIGINT, each goes on by `ckpt_path=last` until it is
done, and then has to be the training that nobody killed: the same weights, bit by bit, and the same curve. Of a training in
several processes the signal goes to the command, to one of those that train, or to all at once. Prints what happened as JSON.
"""

import csv
import json
import os
import random
import signal
import sys
import time
import traceback
from collections import Counter
from contextlib import suppress
from datetime import timedelta
from pathlib import Path
from typing import Any

from omegaconf import DictConfig
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from charnerf.interruption import Stopped, listening
from charnerf.process import use_fastest_products
from charnerf.training import run, trainer
from charnerf.training.board import BY_TIME
from support import small_runs

SIGNALS = (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
_TRAINS = b"spawn_main"  # on the command line of a process that a training begins
NOT_STEPS = ("seconds",)  # columns of the curve


def main(dataset: Path, folder: Path, kills: int, seed: int, settings: list[str]) -> dict[str, Any]:
    """Kill so many times; counts of how attempts ended, and the runs that came out otherwise."""
    begin_process()
    cfg = small_runs.smoke_config(dataset, "ckpt_path=last", *settings)
    rng = random.Random(seed)
    begun = time.monotonic()
    assert _wait(_start(cfg, folder / "straight")) == 0, (folder / "straight.log").read_text()
    seconds = time.monotonic() - begun
    ends: Counter[str] = Counter()
    runs: list[str] = []
    while (killed := sum(ends.values())) < kills:
        name = f"run{len(runs)}"
        ends += _until_done(cfg, folder / name, rng, seconds, at_most=kills - killed)
        runs.append(name)
    wrong = [name for name in runs if _result(folder / name) != _result(folder / "straight")]
    return {"kills": sum(ends.values()), "runs": len(runs), "ends": dict(ends), "wrong": wrong}


def begin_process() -> None:
    """Set a process for the training alone, with checkpoints between validations too."""
    use_fastest_products()
    run.finish_run = lambda *_, **__: None
    trainer.CHECKPOINT_EVERY = timedelta(seconds=0.3)


def _until_done(
    cfg: DictConfig, folder: Path, rng: random.Random, seconds: float, *, at_most: int
) -> Counter[str]:
    """Start and kill a training until it gets to its end."""
    ends: Counter[str] = Counter()
    while True:
        process = _start(cfg, folder)
        kill = sum(ends.values()) < at_most
        status = _wait(process, rng.uniform(0.0, seconds) if kill else None)
        if status is None:
            number, whom = rng.choice(SIGNALS), _whom(process, rng)
            for one in whom:
                with suppress(ProcessLookupError):
                    os.kill(one, number)
            status = _wait(process)
            # 0: it was done just before; a negative status of others than SIGKILL: it did not listen yet
            expected = {0, -number} | ({128 + number} if number != signal.SIGKILL else set())
            if process not in whom and number == signal.SIGKILL:
                expected = {0, 1}  # the command says which of its processes was killed
            assert status in expected, f"{number.name}: {status}\n{folder.with_suffix('.log').read_text()}"
            ends[f"{number.name} {'all' if len(whom) > 1 else 'command' if process in whom else 'one'}"] += 1
            if status != 0:
                continue
        assert status == 0, folder.with_suffix(".log").read_text()
        return ends


def _whom(process: int, rng: random.Random) -> list[int]:
    """The command, one of the processes that it has begun to train, or all."""
    team = []
    with suppress(OSError):  # some have ended meanwhile
        for one in Path(f"/proc/{process}/task/{process}/children").read_text().split():
            if _TRAINS in Path(f"/proc/{one}/cmdline").read_bytes():
                team.append(int(one))
    return rng.choice([[process], *([one] for one in team), [process, *team]]) if team else [process]


def _start(cfg: DictConfig, folder: Path) -> int:
    """Train in a process of its own, which has everything imported; its id."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    process = os.fork()
    if process:
        return process
    log = os.open(folder.with_suffix(".log"), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(log, 1)
    os.dup2(log, 2)
    status = 1
    try:
        with listening():
            run.run_training(cfg, folder, begin_process=begin_process)
        status = 0
    except Stopped as stop:
        status = stop.status
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(status)


def _wait(process: int, seconds: float | None = None) -> int | None:
    """Status of a process's end, negative where a signal ended it; None where it is still there after so long."""
    end = None if seconds is None else time.monotonic() + seconds
    while end is None or time.monotonic() < end:
        done, status = os.waitpid(process, 0 if end is None else os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.002)
    return None


def _result(folder: Path) -> tuple[bytes, list[dict[str, str]], list[tuple[str, int]]]:
    """Weights, curve and TensorBoard's points of a run, seconds left out."""
    with (folder / "curve.csv").open() as file:
        rows = [
            {key: one for key, one in row.items() if key not in NOT_STEPS} for row in csv.DictReader(file)
        ]
    return (folder / "weights.safetensors").read_bytes(), rows, _points(folder / "tensorboard")


def _points(folder: Path) -> list[tuple[str, int]]:
    """Tags and steps as TensorBoard's own reader finds them, one that comes twice twice."""
    events = EventAccumulator(str(folder), size_guidance={"scalars": 0}, purge_orphaned_data=False).Reload()
    tags = [tag for tag in events.Tags()["scalars"] if not tag.startswith(BY_TIME)]
    return sorted((tag, event.step) for tag in tags for event in events.Scalars(tag))


if __name__ == "__main__":
    report = main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]), sys.argv[5:])
    sys.stdout.write(f"{json.dumps(report)}\n")
