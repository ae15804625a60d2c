"""A training in two processes, by its command: equal to one, ended whole, and never waiting for one that is gone."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

from charnerf.config.composition import compose_config
from charnerf.errors import ConfigError
from charnerf.inference.checkpoint_file import read_checkpoint
from charnerf.training.cells import cells_of
from charnerf.training.processes import check_alone, processes_to_begin

TWO = ("trainer=ddp", "trainer.accelerator=cpu", "trainer.devices=2")
FEW = ("encoder=single", "scale.eval_views=1", "validation.views=3")
LONG = ("scale.steps=100000", "validation.times=20000")
ALL_TERMS = (
    "loss.surface.rgb_weight=0.1",
    "loss.occupancy.weight=0.1",
    "loss.depth.weight=0.1",
    "surface_dirs=camera",
)
TWICE = (
    "scale.batch_characters=2",
    "scale.phase_rays=[128,256]",
    "scale.phase_surface_points=[128,256]",
    "scale.space_points=128",
)


def start(dataset: Path, folder: Path, *more: str) -> "subprocess.Popen[str]":
    command = [
        sys.executable,
        "-m",
        "charnerf",
        "train",
        "scale=smoke",
        "data=folder",
        f"data.root={dataset}",
    ]
    return subprocess.Popen(
        [*command, *FEW, f"hydra.run.dir={folder}", *more],
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        stderr=subprocess.STDOUT,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def train(dataset: Path, folder: Path, *more: str) -> str:
    process = start(dataset, folder, *more)
    said, _ = process.communicate(timeout=600)
    assert process.returncode == 0, said
    return said


def children(process: int) -> list[int]:
    """Processes that train, begun by a command; not the one that keeps count of multiprocessing's resources."""
    found = [int(one) for one in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    return [one for one in found if "resource_tracker" not in Path(f"/proc/{one}/cmdline").read_text()]


def ranks(process: "subprocess.Popen[str]") -> list[int]:
    """The two that train, in their order."""
    found = sorted(children(process.pid))
    assert len(found) == 2
    return found


def await_checkpoint(process: "subprocess.Popen[str]", folder: Path) -> Path:
    last = folder / "checkpoints/last.ckpt"
    end = time.monotonic() + 300
    while not last.is_file():
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.05)
    return last


def rows(folder: Path) -> list[dict[str, float]]:
    with (folder / "curve.csv").open() as file:
        return [{key: float(value or 0.0) for key, value in row.items()} for row in csv.DictReader(file)]


def test_only_what_asks_for_processes_begins_them(figure_dataset):
    def count(*settings: str) -> int:
        return processes_to_begin(compose_config(["data=folder", f"data.root={figure_dataset}", *settings]))

    assert count("trainer=cpu") == 1 and count(*TWO) == 2
    with pytest.raises(ConfigError, match=r"trainer\.num_nodes: found 2.*torchrun"):
        count(*TWO, "+trainer.num_nodes=2")
    with pytest.raises(ConfigError, match=r"trainer\.strategy: found ddp_spawn, expected ddp"):
        count(*TWO, "trainer.strategy=ddp_spawn")


def test_a_queue_s_one_task_begins_them_and_a_started_team_none(figure_dataset, monkeypatch):
    """Within a job of SLURM with one task the command begins them; where each has its own, no grid may begin."""
    cfg = compose_config(["data=folder", f"data.root={figure_dataset}", *TWO])
    job = {"NTASKS": "1", "JOB_ID": "7", "JOB_NAME": "mine", "PROCID": "0", "LOCALID": "0", "NODEID": "0"}
    with monkeypatch.context() as slurm:
        for key, value in job.items():
            slurm.setenv(f"SLURM_{key}", value)
        assert processes_to_begin(cfg) == 2
        check_alone(cfg)
    monkeypatch.setenv("LOCAL_RANK", "0")
    assert processes_to_begin(cfg) == 1
    with pytest.raises(ConfigError, match=r"-m: found several processes"):
        check_alone(cfg)


@pytest.mark.slow
def test_processes_that_torchrun_begins_make_one_run(figure_dataset, tmp_path):
    launcher = [
        sys.executable,
        "-m",
        "torch.distributed.run",
        "--nproc-per-node",
        "2",
        "-m",
        "charnerf",
        "train",
    ]
    data = ["scale=smoke", "data=folder", f"data.root={figure_dataset}", f"hydra.run.dir={tmp_path / 'run'}"]
    done = subprocess.run([*launcher, *data, *FEW, *TWO], capture_output=True, text=True, check=False)
    said = done.stdout + done.stderr
    assert done.returncode == 0, said
    assert said.count("Report: ") == 1 and rows(tmp_path / "run")[-1]["rays"] == 128
    again = subprocess.run([*launcher, *data, *FEW, *TWO], capture_output=True, text=True, check=False)
    assert again.returncode != 0 and "holds a run already" in again.stdout + again.stderr


@pytest.mark.slow
@pytest.mark.parametrize("more", [(), ("averaging.decay=0.9", "batches.workers=1", "augmentation=[drawing]")])
def test_two_processes_are_one_of_twice_the_batch(figure_dataset, tmp_path, more):
    settings = (*ALL_TERMS, "schedule=two_phase", "scale.steps=8", "validation.times=4", *more)
    said = train(figure_dataset, tmp_path / "two", *TWO, *settings)
    train(figure_dataset, tmp_path / "one", "trainer=cpu", *settings, *TWICE)
    two, one = rows(tmp_path / "two"), rows(tmp_path / "one")
    assert [row["step"] for row in two] == [2, 4, 6, 8]
    assert [row["rays"] for row in two] == [128, 128, 256, 256] and [row["phase"] for row in two] == [
        0,
        0,
        1,
        1,
    ]
    for here, there in zip(two, one, strict=True):
        values = {key: value for key, value in there.items() if key != "seconds"}
        assert {key: here[key] for key in values} == pytest.approx(values, rel=1e-4)
    weights = [load_file(tmp_path / name / "weights.safetensors") for name in ("two", "one")]
    flat = [torch.cat([one[name].flatten() for name in sorted(one)]) for one in weights]
    assert (flat[0] - flat[1]).norm() < 1e-4 * flat[1].norm()
    metrics = [json.loads((tmp_path / name / "metrics.json").read_text()) for name in ("two", "one")]
    assert metrics[0]["psnr"] == pytest.approx(metrics[1]["psnr"], abs=0.01)
    assert said.count("training, 0 %") == 1 and said.count("Report: ") == 1 and "Warning" not in said
    assert sorted(one.name for one in (tmp_path / "two").iterdir()) == sorted(
        one.name for one in (tmp_path / "one").iterdir()
    )


@pytest.mark.slow
def test_seconds_are_those_of_the_first_process(figure_dataset, tmp_path):
    """One that decided by its own clock would wait for ever, or step alone."""
    train(figure_dataset, tmp_path, *TWO, "scale.steps=null", "scale.seconds=3", "schedule=two_phase")
    assert rows(tmp_path)[-1]["seconds"] >= 3.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "whom"),
    [(signal.SIGTERM, "all"), (signal.SIGINT, "all"), (signal.SIGTERM, 0), (signal.SIGINT, 1)],
)
def test_a_signal_to_all_or_one_ends_all_with_a_checkpoint(figure_dataset, tmp_path, number, whom):
    process = start(figure_dataset, tmp_path, *TWO, *LONG)
    last = await_checkpoint(process, tmp_path)
    both = ranks(process)
    if whom == "all":  # as from a terminal
        os.killpg(process.pid, number)
    else:
        os.kill(both[whom], number)
    said, _ = process.communicate(timeout=120)
    assert process.returncode == 128 + number, said
    assert said.count(f"the checkpoint is {last}") == 1 and "Traceback" not in said
    done = read_checkpoint(last)["global_step"]
    assert not any(Path(f"/proc/{one}").exists() for one in both)

    steps = (f"scale.steps={done + 2}", "validation.times=1", "ckpt_path=last")
    one = ("trainer.devices=1",) if whom == 1 else ()  # another number of processes
    train(figure_dataset, tmp_path, *TWO, *steps, *one)
    assert read_checkpoint(last)["global_step"] == done + 2
    assert rows(tmp_path)[-1]["rays"] == (64 if whom == 1 else 128)


@pytest.mark.slow
@pytest.mark.parametrize("whom", [0, 1])
def test_one_that_is_killed_ends_all(figure_dataset, tmp_path, whom):
    process = start(figure_dataset, tmp_path, *TWO, *LONG)
    last = await_checkpoint(process, tmp_path)
    both = ranks(process)
    os.kill(both[whom], signal.SIGKILL)
    said, _ = process.communicate(timeout=60)
    assert process.returncode == 1, said
    assert f"error: process {whom} of 2 was ended by SIGKILL" in said and "Traceback" not in said
    assert read_checkpoint(last)["global_step"] >= 5
    assert not any(Path(f"/proc/{one}").exists() for one in both)


@pytest.mark.slow
def test_both_end_with_a_command_that_is_killed(figure_dataset, tmp_path):
    process = start(figure_dataset, tmp_path, *TWO, *LONG)
    await_checkpoint(process, tmp_path)
    process.kill()
    process.communicate(timeout=90)  # until nobody has its output open


@pytest.mark.slow
def test_an_error_of_one_is_the_error_of_the_run(figure_dataset, tmp_path):
    """The second character alone can not be read; whichever process opens it, the message is its own."""
    root = tmp_path / "dataset"
    root.symlink_to(figure_dataset)
    copy = tmp_path / "copy"
    subprocess.run(["cp", "-rL", str(root), str(copy)], check=True)
    picture = sorted((copy / "lefty/images").glob("*.png"))[0]
    picture.write_bytes(b"no picture")
    process = start(copy, tmp_path / "run", *TWO, "scale.steps=20")
    said, _ = process.communicate(timeout=120)
    assert process.returncode == 1, said
    assert said.count("error: ") == 1 and picture.name in said and "Traceback" not in said


@pytest.mark.slow
def test_a_grid_trains_each_cell_in_two_processes(figure_dataset, tmp_path):
    grid = tmp_path / "grid"
    command = (*TWO, "-m", "seed=0,1", "scale.steps=2", f"hydra.sweep.dir={grid}")
    train(figure_dataset, tmp_path / "job", *command)
    assert [cell.state for cell in cells_of(grid)] == ["done", "done"]
    for cell in cells_of(grid):
        assert (grid / cell.name / "metrics.json").is_file()
        assert {row["rays"] for row in rows(grid / cell.name)} == {128}
        assert "Report: " in (grid / cell.name / "train.log").read_text()
    assert "skipped" in train(figure_dataset, tmp_path / "job", *command)
