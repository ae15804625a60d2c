"""A training that is asked to end writes a checkpoint, from which the run goes on as if nothing had been."""

import os
import signal
import subprocess
import sys
import time
from functools import cache
from pathlib import Path

import lightning as L
import pytest
import torch

from charnerf.inference.checkpoint_file import read_checkpoint
from charnerf.interruption import Stopped, held, listening
from charnerf.training import run
from charnerf.training.cells import cells_of
from support import small_runs
from support.processes import begin_command

SMALL = ("encoder=single", "schedule=two_phase", "scale.steps=8", "validation.times=2")


class Asking(L.Callback):
    """Sends this process a signal, in a step or in the validation after it."""

    def __init__(self, *, step: int, in_validation: bool = False) -> None:
        self.step = step
        self.in_validation = in_validation

    def on_train_batch_start(self, trainer, pl_module, batch, batch_idx):
        if batch.step == self.step and not self.in_validation:
            os.kill(os.getpid(), signal.SIGTERM)

    def on_validation_batch_start(self, trainer, *_):
        if trainer.global_step == self.step + 1 and self.in_validation:
            os.kill(os.getpid(), signal.SIGTERM)


@pytest.fixture(scope="module")
def straight_run(figure_dataset, tmp_path_factory):
    """By settings, a run that nothing stops, and its folder; made once."""

    @cache
    def made(*settings: str) -> tuple[small_runs.SmallRun, Path]:
        folder = tmp_path_factory.mktemp("straight")
        cfg = small_runs.smoke_config(figure_dataset, *SMALL, *settings)
        return small_runs.assemble(cfg, folder).fit(), folder

    return made


@pytest.mark.parametrize(
    ("settings", "step", "in_validation", "done"),
    [
        ((), 1, False, 2),
        ((), 3, False, 4),  # a validation is due: the checkpoint follows it
        ((), 3, True, 4),
        (("averaging.decay=0.9", "batches.workers=1"), 5, False, 6),
    ],
)
def test_a_run_that_is_stopped_goes_on_as_the_straight_one(
    figure_dataset, tmp_path, caplog, straight_run, settings, step, in_validation, done
):
    cfg = small_runs.smoke_config(figure_dataset, *SMALL, *settings)
    straight, straight_folder = straight_run(*settings)
    stopped = small_runs.assemble(cfg, tmp_path / "run")
    stopped.trainer.callbacks.insert(1, Asking(step=step, in_validation=in_validation))
    with pytest.raises(Stopped) as stop, listening(), held():
        stopped.fit()
    assert stop.value.status == 143
    checkpoint = tmp_path / "run/checkpoints/last.ckpt"
    assert f"Stopped after step {done}; the checkpoint is {checkpoint}" in caplog.text
    assert read_checkpoint(checkpoint)["global_step"] == done

    resumed = small_runs.assemble(cfg, tmp_path / "run").fit(checkpoint)
    assert resumed.recorder.losses == straight.recorder.losses[done:]
    assert torch.equal(small_runs.weights(resumed.module.model), small_runs.weights(straight.module.model))
    curves = [
        (folder / "curve.csv").read_text().splitlines() for folder in (straight_folder, tmp_path / "run")
    ]
    assert [row.split(",")[0] for row in curves[0]] == [row.split(",")[0] for row in curves[1]]


def test_within_slurm_the_answer_is_the_same(figure_dataset, tmp_path, monkeypatch):
    """Lightning would write a checkpoint of its own, ask for a requeue and leave SIGTERM unanswered."""
    job = {"NTASKS": "1", "JOB_ID": "7", "JOB_NAME": "mine", "PROCID": "0", "LOCALID": "0", "NODEID": "0"}
    for key, value in (job | {"NTASKS_PER_NODE": "1", "NNODES": "1"}).items():
        monkeypatch.setenv(f"SLURM_{key}", value)
    stopped = small_runs.assemble(small_runs.smoke_config(figure_dataset, *SMALL), tmp_path)
    stopped.trainer.callbacks.insert(1, Asking(step=1))
    with pytest.raises(Stopped), listening(), held():
        stopped.fit()
    assert sorted(file.name for file in (tmp_path / "checkpoints").iterdir()) == ["last.ckpt"]
    assert read_checkpoint(tmp_path / "checkpoints/last.ckpt")["global_step"] == 2


def test_a_run_that_is_stopped_in_its_evaluation_is_trained(figure_dataset, tmp_path, monkeypatch, caplog):
    done = []

    def finish(*_, **__):
        os.kill(os.getpid(), signal.SIGINT)
        done.append("never")

    cfg = small_runs.smoke_config(figure_dataset, *SMALL)
    with monkeypatch.context() as patch, pytest.raises(Stopped) as stop, listening():
        patch.setattr(run, "finish_run", finish)
        run.run_training(cfg, tmp_path)
    assert stop.value.status == 130 and not done
    assert f"Stopped after training; the weights are {tmp_path / 'weights.safetensors'}" in caplog.text
    cfg.ckpt_path = "last"
    monkeypatch.setattr(run, "finish_run", lambda *_, **__: done.append("again"))
    run.run_training(cfg, tmp_path)
    assert done == ["again"]


def command(dataset: Path, folder: Path, *more: str) -> list[str]:
    settings = [f"data.root={dataset}", "validation.views=1", f"hydra.run.dir={folder}", *more]
    return ["train", "scale=smoke", "trainer=cpu", "data=folder", *settings]


def start(dataset: Path, folder: Path, *more: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "charnerf", *command(dataset, folder, *more)],
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
    )


def await_file(process: subprocess.Popen[bytes], file: Path, pattern: str | None = None) -> None:
    end = time.monotonic() + 300
    while not (file.is_file() if pattern is None else any(file.glob(pattern))):
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.05)


def children(process: int) -> list[int]:
    file = Path(f"/proc/{process}/task/{process}/children")
    return [int(one) for one in file.read_text().split()] if file.is_file() else []


def is_alive(process: int) -> bool:
    """Whether a process is there and no zombie."""
    file = Path(f"/proc/{process}/stat")
    return file.is_file() and file.read_text().rpartition(")")[2].split()[0] != "Z"


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGTERM, 143), pytest.param(signal.SIGINT, 130, marks=pytest.mark.slow)]
)
def test_the_command_ends_with_its_status_and_its_workers(figure_dataset, tmp_path, number, status):
    """The whole group of processes gets the signal, as from a terminal or a queue."""
    long = ("scale.steps=100000", "validation.times=20000", "batches.workers=1")
    log, last = tmp_path / "log", tmp_path / "run/checkpoints/last.ckpt"
    process = begin_command(command(figure_dataset, tmp_path / "run", *long), log)
    end = time.monotonic() + 300
    while not last.is_file():
        assert process.is_alive() and time.monotonic() < end, log.read_text()
        time.sleep(0.05)
    workers = children(process.pid)
    os.killpg(process.pid, number)
    process.join(120)
    said = log.read_text()
    assert process.exitcode == status, said
    assert workers and str(last) in said and "Traceback" not in said
    assert read_checkpoint(last)["global_step"] >= 5
    assert not any(is_alive(worker) for worker in workers)


@pytest.mark.slow
def test_workers_end_with_a_training_that_is_killed(figure_dataset, tmp_path):
    process = start(
        figure_dataset, tmp_path / "run", "scale.steps=100000", "validation.times=20000", "batches.workers=2"
    )
    await_file(process, tmp_path / "run/checkpoints/last.ckpt")
    workers = children(process.pid)
    process.kill()
    process.communicate(timeout=60)  # until nobody has its output open
    assert process.returncode == -signal.SIGKILL and len(workers) == 2
    assert not any(is_alive(worker) for worker in workers)


@pytest.mark.slow
@pytest.mark.parametrize("launcher", [None, "joblib"])
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_a_grid_ends_with_its_processes_and_goes_on(figure_dataset, tmp_path, number, launcher):
    """The command alone gets the signal."""
    more = []
    if launcher is not None:
        more = ["hydra/launcher=joblib", "hydra.launcher.n_jobs=2"]
    grid = tmp_path / "grid"
    command = [
        *more,
        "-m",
        "seed=0,1",
        "encoder=single",
        "scale.steps=60",
        "validation.times=30",
        "scale.eval_views=1",
    ]
    command.append(f"hydra.sweep.dir={grid}")
    process = start(figure_dataset, tmp_path, *command)
    await_file(process, grid, "*/checkpoints/last.ckpt")
    process.send_signal(number)
    _, err = process.communicate(timeout=120)  # until no process has its output open
    assert process.returncode == (-number if number == signal.SIGKILL else 128 + number), err.decode()
    assert any(cell.state == "interrupted" for cell in cells_of(grid))
    again = start(figure_dataset, tmp_path, *command)
    _, err = again.communicate(timeout=600)
    assert again.returncode == 0, err.decode()
    assert [cell.state for cell in cells_of(grid)] == ["done", "done"]
