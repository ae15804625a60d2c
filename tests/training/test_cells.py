"""Cells of a grid: finished ones are skipped, killed ones go on, failed ones are recorded."""

import json
import multiprocessing
import os
import shutil
import time
from multiprocessing.connection import Connection
from pathlib import Path

import pytest
from omegaconf import DictConfig, OmegaConf

from charnerf.config.grid import config_hash, grid_command
from charnerf.errors import ConfigError, DataError, GridError
from charnerf.reporting.runs import read_unfinished
from charnerf.training.cells import cells_of, read_cell, run_cell
from charnerf.training.grid import begin_grid, check_grid, report_grid


class Trainer:
    """Stands for a training: notes what it was asked for."""

    def __init__(self, *, error: Exception | None = None) -> None:
        self.error = error
        self.asked: list[tuple[str, str | None]] = []

    def __call__(self, cfg: DictConfig, folder: Path) -> None:
        self.asked.append((folder.name, cfg.ckpt_path))
        if self.error is not None:
            raise self.error
        (folder / "metrics.json").write_text("{}")


def config(**values: object) -> DictConfig:
    return OmegaConf.create({"name": "run", "ckpt_path": None, "seed": 0, **values})


def cell(grid: Path, trainer: Trainer, *, name: str = "seed-0", **values: object):
    return run_cell(config(**values), grid, name=name, job_folder=grid / ".jobs/0", train=trainer)


def test_a_finished_cell_is_skipped_whatever_its_name(tmp_path):
    trainer = Trainer()
    done = cell(tmp_path, trainer)
    assert (done.state, done.error) == ("done", None) and done.ended >= done.started
    assert cell(tmp_path, trainer) == done
    assert (
        cell(tmp_path, trainer, name="experiment-charnerf+seed-0") == done
    )  # another sweep, the same config
    assert len(trainer.asked) == 1
    assert (
        cell(tmp_path, trainer, seed=1, name="seed-0").state == "done"
    )  # another config, though called the same
    assert len(trainer.asked) == 2 and len({name for name, _ in trainer.asked}) == 2
    assert [one.state for one in cells_of(tmp_path)] == ["done", "done"]
    check_grid(tmp_path)


def test_a_failed_cell_is_recorded_and_tried_again(tmp_path):
    failed = cell(tmp_path, Trainer(error=ArithmeticError("loss: found nan")))
    assert failed.state == "failed" and failed.error == "ArithmeticError: loss: found nan"
    text = (tmp_path / failed.name / "error.txt").read_text()
    assert "Traceback" in text and "found nan" in text
    cell(tmp_path, Trainer(), seed=1)
    with pytest.raises(
        GridError, match=r"1 of 2 cells not done(.|\n)*failed, ArithmeticError: loss: found nan"
    ):
        check_grid(tmp_path)
    assert cell(tmp_path, Trainer()).state == "done"
    assert not (tmp_path / failed.name / "error.txt").exists()
    check_grid(tmp_path)


def test_only_what_this_sweep_asked_for_counts(tmp_path):
    """Defaults have changed: the failed cell of before is another one."""
    cell(tmp_path, Trainer(error=ArithmeticError("loss: found nan")), rate=1.0)
    time.sleep(0.05)
    since = begin_grid(tmp_path)
    time.sleep(0.05)
    cell(tmp_path, Trainer(), rate=2.0)
    check_grid(tmp_path, since=since)
    with pytest.raises(GridError, match="1 of 2"):
        check_grid(tmp_path)


def test_whoever_stops_the_sweep_stops_it(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        cell(tmp_path, Trainer(error=KeyboardInterrupt()))  # type: ignore[arg-type]
    assert [one.state for one in cells_of(tmp_path)] == ["interrupted"]
    assert [one.state for one in read_unfinished(tmp_path)] == ["interrupted"]


def test_a_cell_goes_on_from_its_own_checkpoint(tmp_path):
    trainer = Trainer(error=OSError("disk full"))
    folder = tmp_path / cell(tmp_path, trainer).name
    (folder / "checkpoints").mkdir()
    (folder / "checkpoints/last.ckpt").touch()
    trainer.error = None
    assert cell(tmp_path, trainer).state == "done"
    assert [checkpoint for _, checkpoint in trainer.asked] == [None, "last"]


def test_hydras_notes_and_the_log_go_along(tmp_path):
    (tmp_path / ".jobs/0/.hydra").mkdir(parents=True)
    (tmp_path / ".jobs/0/.hydra/overrides.yaml").write_text("- seed=0\n")
    folder = tmp_path / cell(tmp_path, Trainer()).name
    assert (folder / ".hydra/overrides.yaml").read_text() == "- seed=0\n"
    assert (folder / "train.log").is_file()
    assert report_grid(tmp_path / "nothing") is None


def _in_work(grid: Path, tell: Connection) -> None:
    def train(cfg: DictConfig, folder: Path) -> None:
        tell.send("begun")
        tell.recv()

    run_cell(config(), grid, name="seed-0", job_folder=grid, train=train)


def test_a_cell_in_work_is_left_alone_and_a_killed_one_is_not(tmp_path):
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe()
    process = context.Process(target=_in_work, args=(tmp_path, there))
    process.start()
    assert here.recv() == "begun"
    trainer = Trainer()
    assert cell(tmp_path, trainer).state == "running"
    assert [one.state for one in cells_of(tmp_path)] == ["running"]
    assert [one.state for one in read_unfinished(tmp_path)] == ["running"]
    process.kill()
    process.join()
    assert [one.state for one in cells_of(tmp_path)] == ["interrupted"]
    assert [one.state for one in read_unfinished(tmp_path)] == ["interrupted"]
    with pytest.raises(GridError, match="interrupted"):
        check_grid(tmp_path)
    assert trainer.asked == []
    assert cell(tmp_path, trainer).state == "done"


def test_a_broken_state_is_named(tmp_path):
    folder = tmp_path / cell(tmp_path, Trainer()).name
    (folder / "cell.json").write_text(json.dumps({"state": "done"}))
    with pytest.raises(ValueError, match="expected a cell's state"):
        read_cell(folder)


@pytest.mark.parametrize("kind", ["folder", "pipe"])
def test_a_state_that_is_no_file_is_named(tmp_path, kind):
    state = tmp_path / cell(tmp_path, Trainer()).name / "cell.json"
    state.unlink()
    state.mkdir() if kind == "folder" else os.mkfifo(state)
    for look in (lambda: cell(tmp_path, Trainer()), lambda: cells_of(tmp_path)):
        with pytest.raises(DataError, match=rf"cell.json: found a {kind}.*expected a file"):
            look()


def test_a_file_in_the_place_of_a_cells_folder_is_named(tmp_path):
    trainer, folder = Trainer(), tmp_path / cell(tmp_path, Trainer()).name
    shutil.rmtree(folder)
    folder.write_text("a note")
    with pytest.raises(DataError, match=r"found a file, expected a folder"):
        cell(tmp_path, trainer)
    assert trainer.asked == [] and folder.read_text() == "a note"


def test_where_a_run_begins_is_not_what_it_is():
    assert config_hash(config()) == config_hash(config(ckpt_path="last"))
    assert config_hash(config()) != config_hash(config(seed=1))


# The command line.


def folder_of(*arguments: str) -> str:
    grid = grid_command(["-m", *arguments])
    assert grid is not None
    return grid.folder.as_posix()


def test_the_same_command_means_the_same_folder():
    usual = folder_of("experiment=glob(*)", "scale=smoke", "seed=0,1")
    assert usual.startswith("outputs/grid/experiment+seed-")
    assert usual == folder_of("seed=0,1", "scale=smoke", "experiment=glob(*)")
    assert usual == folder_of("seed=0,1", "scale=smoke", "experiment=glob(*)", "hydra/launcher=joblib")
    assert usual != folder_of("experiment=glob(*)", "scale=small", "seed=0,1")
    assert folder_of("seed=0,1", "hydra.sweep.dir=my/grid") == "my/grid"


def test_the_order_of_swept_values_means_nothing():
    assert folder_of("surface_dirs=random,zero") == folder_of("surface_dirs=zero,random")
    assert folder_of("surface_dirs=random,zero") != folder_of("surface_dirs=random,camera")
    assert folder_of("augmentation=[],[mirror,recolor]") == folder_of("augmentation=[mirror,recolor],[]")
    assert folder_of("augmentation=[],[mirror,recolor]") != folder_of("augmentation=[],[recolor,mirror]")
    assert folder_of("seed=range(0,3)") != folder_of("seed=range(0,4)")


def test_submitit_gets_a_folder_whose_name_is_filled_in():
    command = ["-m", "seed=0,1", "hydra.sweep.dir=mine", "hydra/launcher=submitit_local"]
    assert "hydra.launcher.submitit_folder='mine/.submitit'" in grid_command(command).arguments
    typed = [*command, "hydra.launcher.submitit_folder=jobs/%j"]
    for arguments in (typed, command[:3]):
        assert not any("mine/.submitit" in one for one in grid_command(arguments).arguments)


def test_only_what_is_swept_names_the_cells():
    grid = grid_command(["-m", "experiment=glob(*)", "data.root=/a/b", "hydra/launcher=joblib"])
    assert grid is not None
    assert grid.arguments[-1] == "hydra.job.config.override_dirname.exclude_keys=['data.root']"
    mine = grid_command(["-m", "seed=0,1", "hydra.job.config.override_dirname.exclude_keys=[x]"])
    assert mine is not None and len(mine.arguments) == 4


@pytest.mark.parametrize("arguments", [["scale=smoke"], ["-m", "--cfg", "job"], ["--help"]])
def test_what_is_no_grid(arguments):
    assert grid_command(arguments) is None


def test_an_override_that_can_not_be_read():
    with pytest.raises(ConfigError, match="seed=\\[: can not be read"):
        grid_command(["-m", "seed=["])
