"""Which checkpoint a run goes on from, and what happens where it is broken, another's, or can not be written."""

import logging
import multiprocessing
import shutil
import sys
from multiprocessing.connection import Connection
from pathlib import Path

import pytest
import torch

from charnerf.capture.generated import generate_dataset
from charnerf.cli.train import main as train
from charnerf.errors import ConfigError, DataError
from charnerf.files import named_full_disk
from charnerf.inference.checkpoint_file import read_checkpoint, write_checkpoint
from charnerf.inference.weights import load_config
from charnerf.training import run as run_module
from charnerf.training import run_lock
from charnerf.training.checkpoint import find_checkpoint
from charnerf.training.run import run_training
from charnerf.training.run_lock import RunLock
from support import small_runs

SILENT = ("hydra/job_logging=none", "hydra/hydra_logging=none")  # these would stay for other tests
SMALL = ("encoder=single", "scale.steps=4", "validation.times=4")


@pytest.fixture
def no_finish(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs end with their training."""
    monkeypatch.setattr(run_module, "finish_run", lambda *_, **__: None)


@pytest.fixture(scope="module")
def done_run(figure_dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the smallest settings; read only."""
    folder = tmp_path_factory.mktemp("done") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run_module, "finish_run", lambda *_, **__: None)
        run_training(small_runs.smoke_config(figure_dataset, *SMALL), folder)
    return folder


@pytest.fixture
def my_run(done_run: Path, tmp_path: Path) -> Path:
    """The same, to go on with."""
    return shutil.copytree(done_run, tmp_path / "run")


def write_steps(folder: Path, last: int, previous: int | None = None) -> Path:
    checkpoints = folder / "checkpoints"
    write_checkpoint(checkpoints / "last.ckpt", {"global_step": last})
    if previous is not None:
        write_checkpoint(checkpoints / "previous.ckpt", {"global_step": previous})
    return checkpoints


def flip(file: Path) -> None:
    raw = bytearray(file.read_bytes())
    raw[len(raw) // 2] ^= 1
    file.write_bytes(raw)


def test_a_broken_last_one_is_named_and_the_one_before_is_taken(tmp_path, caplog):
    checkpoints = write_steps(tmp_path, last=8, previous=6)
    flip(checkpoints / "last.ckpt")
    with caplog.at_level(logging.WARNING):
        file = find_checkpoint("last", tmp_path)
    assert file == checkpoints / "previous.ckpt" and read_checkpoint(file)["global_step"] == 6
    assert (
        "last.ckpt: can not be read" in caplog.text and f"Goes on from the one before, {file}" in caplog.text
    )
    # what the run writes next does not put the broken one in the place of the good one
    assert not (checkpoints / "last.ckpt").exists() and (checkpoints / "last.ckpt.broken").is_file()


def test_where_both_are_broken_or_there_is_no_other_that_is_said(tmp_path):
    checkpoints = write_steps(tmp_path, last=8)
    flip(checkpoints / "last.ckpt")
    with pytest.raises(DataError, match=r"last\.ckpt: can not be read.*There is none before it"):
        find_checkpoint("last", tmp_path)
    write_steps(tmp_path, last=8, previous=6)
    for name in ("last", "previous"):
        flip(checkpoints / f"{name}.ckpt")
    with pytest.raises(
        DataError, match=r"last\.ckpt: can not be read.*previous\.ckpt: can not be read.*Remove both"
    ):
        find_checkpoint("last", tmp_path)
    with pytest.raises(DataError, match=r"last\.ckpt: can not be read"):
        find_checkpoint(str(checkpoints / "last.ckpt"), tmp_path)


def test_a_neighbours_checkpoint_is_taken_only_when_it_is_named(tmp_path, caplog):
    checkpoints = write_steps(tmp_path / "neighbour", last=8)
    with caplog.at_level(logging.WARNING):
        assert find_checkpoint("last", tmp_path / "mine") is None
    assert "mine holds no checkpoint, so the run begins" in caplog.text
    assert f"hydra.run.dir={tmp_path / 'neighbour'}" in caplog.text
    named = str(checkpoints / "last.ckpt")
    assert find_checkpoint(named, tmp_path / "mine") == Path(named)


@pytest.mark.parametrize(
    "there", ["checkpoints/last.ckpt", "checkpoints/previous.ckpt", "weights.safetensors"]
)
def test_a_new_run_takes_no_folder_of_another(tmp_path, there):
    (tmp_path / there).parent.mkdir(exist_ok=True)
    (tmp_path / there).touch()
    with pytest.raises(ConfigError, match=rf"holds a run already \({there}\).*ckpt_path=last"):
        find_checkpoint(None, tmp_path)


def test_a_run_keeps_its_last_two_and_says_whose_they_are(figure_dataset, my_run, no_finish):
    steps = {file.name: read_checkpoint(file)["global_step"] for file in (my_run / "checkpoints").iterdir()}
    assert (steps["last.ckpt"], steps["previous.ckpt"]) == (4, 3)
    assert set(steps) == {"last.ckpt", "previous.ckpt", "best.ckpt"}
    run = read_checkpoint(my_run / "checkpoints/last.ckpt")["charnerf"]
    assert run["format"] == "charnerf-checkpoint-1" and set(run["data"]) == {"train", "val"}
    assert run["config"]["scale.width"] == 16

    config = (my_run / "config.yaml").read_text()
    other = small_runs.smoke_config(
        figure_dataset, *SMALL, "ckpt_path=last", "batches.foreground_share=0.7", "seed=1"
    )
    with pytest.raises(ConfigError, match=r"of a run with settings of its own") as error:
        run_training(other, my_run)
    keys = [line.split(":")[0].strip() for line in str(error.value).splitlines()[1:]]
    assert keys == ["batches.foreground_share", "seed"]
    assert (my_run / "config.yaml").read_text() == config  # of the state that is there

    free = (
        "budget.steps=5",
        "validation.times=1",
        "batches.memory_mib=100",
        "name=other",
        "scale.eval_views=1",
    )
    run_training(small_runs.smoke_config(figure_dataset, *SMALL, "ckpt_path=last", *free), my_run)
    assert read_checkpoint(my_run / "checkpoints/last.ckpt")["global_step"] == 5
    assert load_config(my_run).budget.steps == 5


def test_the_order_of_augmentations_is_a_setting(figure_dataset, my_run, no_finish):
    """Of the default's, which is the run's."""
    cfg = small_runs.smoke_config(figure_dataset, *SMALL, "augmentation=[mirror,recolor]", "ckpt_path=last")
    with pytest.raises(ConfigError, match=r"augmentation: found mirror recolor, expected recolor mirror"):
        run_training(cfg, my_run)


def test_another_data_set_is_refused_wherever_it_lies(my_run, tmp_path, no_finish):
    generate_dataset(tmp_path / "set", 1, 1, 1, seed=5, views=2, size=32, processes=1)
    cfg = small_runs.smoke_config(tmp_path / "set", *SMALL, "ckpt_path=last")
    with pytest.raises(
        ConfigError, match=r"a data set of its own.*\n  digest of split train: found \w+, expected"
    ):
        run_training(cfg, my_run)


def test_a_checkpoint_that_does_not_say_whose_it_is_begins_nothing(figure_dataset, tmp_path, no_finish):
    write_steps(tmp_path, last=3)
    cfg = small_runs.smoke_config(figure_dataset, *SMALL, "ckpt_path=last")
    with pytest.raises(ConfigError, match="does not say of which run it is"):
        run_training(cfg, tmp_path)


def test_what_was_typed_is_kept_once_a_run_is_accepted(figure_dataset, tmp_path, monkeypatch, capsys):
    """Hydra would write it before the run is refused, and print all overrides before the message."""
    typed = ["scale=smoke", "trainer=cpu", "data=folder", f"data.root={figure_dataset}", "ckpt_path=last"]
    typed += [f"hydra.run.dir={tmp_path}", *SILENT]
    monkeypatch.setattr(sys, "argv", ["train.py"])
    monkeypatch.setenv("HYDRA_FULL_ERROR", "0")
    with monkeypatch.context() as patch:
        patch.setattr(run_module, "run_training", lambda cfg, folder, *, accepted, **_: accepted())
        assert train([*typed, "seed=1"]) == 0
    kept = {file.name: file.read_text() for file in (tmp_path / ".hydra").iterdir()}
    assert (
        sorted(kept) == ["config.yaml", "hydra.yaml", "overrides.yaml"] and "seed=1" in kept["overrides.yaml"]
    )
    write_steps(tmp_path, last=3)
    capsys.readouterr()
    monkeypatch.setenv("HYDRA_FULL_ERROR", "0")  # the door has set it
    assert train([*typed, "seed=2"]) == 2
    told = capsys.readouterr().err
    assert told.startswith("error: ckpt_path: ") and "does not say of which run it is" in told
    assert {file.name: file.read_text() for file in (tmp_path / ".hydra").iterdir()} == kept


def test_a_run_that_goes_on_from_the_one_before_ends_as_the_straight_one(
    figure_dataset, done_run, my_run, no_finish
):
    flip(my_run / "checkpoints/last.ckpt")
    run_training(small_runs.smoke_config(figure_dataset, *SMALL, "ckpt_path=last"), my_run)
    ends = [read_checkpoint(folder / "checkpoints/last.ckpt")["state_dict"] for folder in (done_run, my_run)]
    assert all(torch.equal(value, ends[1][key]) for key, value in ends[0].items())


def test_a_run_that_can_not_write_its_checkpoint_fails(figure_dataset, tmp_path, no_finish):
    """Lightning's own writer swallows PermissionError: the run would end well without any."""
    if not Path("/sys/kernel").is_dir():
        pytest.skip("needs a folder that refuses everybody")
    (tmp_path / "checkpoints").symlink_to("/sys/kernel")
    with pytest.raises(DataError, match=r"checkpoints/\w+\.ckpt: the checkpoint can not be written"):
        run_training(small_runs.smoke_config(figure_dataset, *SMALL), tmp_path)
    assert not (tmp_path / "weights.safetensors").exists()


def test_a_disk_that_takes_no_checkpoint_is_one_message_and_status_1(
    figure_dataset, tmp_path, capsys, monkeypatch
):
    """The kernel refuses every file above 100 kB."""
    resource = pytest.importorskip("resource")
    monkeypatch.setattr(sys, "argv", ["train.py"])
    monkeypatch.setenv("HYDRA_FULL_ERROR", "0")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    settings = ["scale=smoke", "trainer=cpu", "data=folder", f"data.root={figure_dataset}", *SMALL, *SILENT]
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        status = train([*settings, f"hydra.run.dir={tmp_path / 'run'}"])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    told = capsys.readouterr().err
    assert status == 1, told
    errors = [line for line in told.splitlines() if line.startswith("error: ")]
    assert len(errors) == 1, told
    assert "the checkpoint can not be written (File too large)" in errors[0]
    assert "Traceback" not in told
    assert not list((tmp_path / "run/checkpoints").iterdir())


def test_two_commands_do_not_work_in_one_folder(figure_dataset, tmp_path, no_finish, monkeypatch):
    cfg = small_runs.smoke_config(figure_dataset, "ckpt_path=last", *SMALL)
    monkeypatch.setattr(run_lock, "PATIENCE", 0.2)
    with RunLock(tmp_path) as other:
        other.take()
        with pytest.raises(ConfigError, match=r"hydra\.run\.dir: .* is worked in by another command"):
            run_training(cfg, tmp_path)
        assert [file.name for file in tmp_path.iterdir()] == [".run.lock"]
    with RunLock(tmp_path) as free:
        free.take()


def _stay(lock: RunLock, tell: Connection) -> None:
    tell.send(lock.folder)
    tell.recv()


@pytest.mark.slow
def test_a_folder_is_free_once_the_last_process_of_a_command_has_ended(tmp_path, monkeypatch):
    monkeypatch.setattr(run_lock, "PATIENCE", 0.2)
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    with RunLock(tmp_path) as command:
        command.take()
        process = context.Process(target=_stay, args=(command, there))
        process.start()
        assert here.recv() == tmp_path
    with RunLock(tmp_path) as next_one, pytest.raises(ConfigError, match="another command"):
        next_one.take()
    here.send("end")
    process.join()
    with RunLock(tmp_path) as next_one:
        next_one.take()


def test_a_full_disk_is_named_by_its_folder(tmp_path):
    with pytest.raises(DataError, match=r"run: can not be written to \(No space left on device\)"):
        with named_full_disk(tmp_path / "run"):
            raise OSError(28, "No space left on device")
    with pytest.raises(FileNotFoundError), named_full_disk(tmp_path):
        (tmp_path / "gone").read_bytes()
