"""A grid by its command: killed cells go on, failed ones are listed, by every launcher."""

import json
import os
import shutil
import subprocess
import sys
import textwrap
import time
from datetime import timedelta
from pathlib import Path

import pytest
import torch

from charnerf.training import trainer
from charnerf.training.cells import read_cell, run_cell
from charnerf.training.checkpoint import find_checkpoint
from support import small_runs

ROOT = Path(__file__).resolve().parents[2]
STEPS = ("encoder=single", "scale.steps=24", "validation.times=12")
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}

TRAINED = """
    import sys
    from pathlib import Path
    from support import small_runs
    from charnerf.process import use_fastest_products
    from charnerf.training.cells import run_cell

    use_fastest_products()  # as tests/conftest.py and the doors do: other products round otherwise

    def train(cfg, folder):
        small_runs.assemble(cfg, folder).fit()

    cfg = small_runs.smoke_config(Path(sys.argv[1]), *sys.argv[3:])
    run_cell(cfg, Path(sys.argv[2]), name="cell", job_folder=Path(sys.argv[2]), train=train)
"""


@pytest.mark.slow
def test_a_cell_killed_in_the_middle_ends_as_the_one_that_was_not(figure_dataset, tmp_path):
    """kill -9 while it trains: the next start goes on from its checkpoint, to the same weights bit by bit."""
    grid = tmp_path / "grid"
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(TRAINED), str(figure_dataset), str(grid), *STEPS],
        env=ENVIRONMENT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    end = time.monotonic() + 300
    while not list(grid.glob("cell-*/checkpoints/last.ckpt")):
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.01)
    process.kill()
    process.wait()
    folder = next(grid.glob("cell-*"))
    found = read_cell(folder)
    assert found is not None and found.state == "running"  # nobody could say otherwise
    done = torch.load(folder / "checkpoints/last.ckpt", weights_only=True)["global_step"]
    assert 2 <= done < 24

    cfg = small_runs.smoke_config(figure_dataset, *STEPS)
    resumed: list[small_runs.SmallRun] = []

    def train(cfg, folder):
        resumed.append(small_runs.assemble(cfg, folder).fit(find_checkpoint(cfg.ckpt_path, folder)))

    assert run_cell(cfg, grid, name="cell", job_folder=grid, train=train).state == "done"
    assert [batch[0] for batch in resumed[0].recorder.batches] == list(range(done, 24))
    straight = small_runs.assemble(cfg, tmp_path / "straight").fit()
    assert torch.equal(small_runs.weights(resumed[0].module.model), small_runs.weights(straight.module.model))


def test_checkpoints_between_validations_resume_the_same_run(figure_dataset, tmp_path, monkeypatch):
    """One validation at the end of the run: what is kept comes from the clock."""
    monkeypatch.setattr(trainer, "CHECKPOINT_EVERY", timedelta(microseconds=1))
    settings = ("encoder=single", "scale.steps=8", "validation.times=1")
    cfg = small_runs.smoke_config(figure_dataset, *settings)
    cut = small_runs.assemble(cfg, tmp_path / "cut", cut_at=5)
    with pytest.raises(ConnectionAbortedError):
        cut.fit()
    monkeypatch.setattr(trainer, "CHECKPOINT_EVERY", timedelta(hours=1))
    straight = small_runs.assemble(cfg, tmp_path / "straight").fit()
    resumed = small_runs.assemble(cfg, tmp_path / "resumed").fit(tmp_path / "cut/checkpoints/last.ckpt")
    assert [batch[0] for batch in resumed.recorder.batches] == [5, 6, 7]
    assert resumed.recorder.losses == straight.recorder.losses[5:]
    assert torch.equal(small_runs.weights(resumed.module.model), small_runs.weights(straight.module.model))
    assert resumed.clock.steps == 8
    curves = [(tmp_path / name / "curve.csv").read_text().splitlines() for name in ("straight", "resumed")]
    assert [row.split(",")[0] for row in curves[0]] == [row.split(",")[0] for row in curves[1]]


LAUNCHERS = {
    "basic": [],
    "hydra_joblib_launcher": ["hydra/launcher=joblib", "hydra.launcher.n_jobs=2"],
    "hydra_submitit_launcher": ["hydra/launcher=submitit_local", "hydra.launcher.timeout_min=10"],
}


@pytest.mark.slow
@pytest.mark.parametrize("package", LAUNCHERS)
def test_a_grid_makes_the_characters_that_its_cells_need(tmp_path, package):
    """Two cells at once, nothing in the cache: one makes the characters, the other waits; batches come from a process."""
    count = ("data.train=2", "data.val=1", "data.test=1", "data.views=2", f"+data.cache={tmp_path / 'cache'}")
    short = ("scale.steps=2", "validation.times=1", "scale.eval_views=1", "batches.workers=1")
    command = [sys.executable, str(ROOT / "train.py"), "-m", "seed=0,1", "scale=smoke", "encoder=single"]
    command += ["trainer=cpu", *count, *short, *LAUNCHERS[package]]
    done = subprocess.run(command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (grid,) = (tmp_path / "outputs/grid").iterdir()
    assert [json.loads(file.read_text())["state"] for file in grid.glob("*/cell.json")] == ["done", "done"]
    assert (grid / "report.md").is_file() and not list(grid.rglob("*%j*"))


@pytest.mark.slow
@pytest.mark.parametrize("package", LAUNCHERS)
def test_a_grid_with_a_failing_cell(figure_dataset, tmp_path, package):
    root = shutil.copytree(figure_dataset, tmp_path / "set")
    content = json.loads((root / "dataset.json").read_text())
    content["splits"]["broken"] = content["splits"].pop("train")
    (root / "dataset.json").write_text(json.dumps(content))
    for picture in root.glob("[lm]*/images/*.png"):  # noticed when it is opened, not before
        picture.write_bytes(b"")
    command = [
        *(sys.executable, str(ROOT / "train.py"), "-m", "splits.train=[broken],[val]", "seed=3"),
        *("data=folder", f"data.root={root}", "trainer=cpu", "encoder=single", "scale=smoke"),
        *("scale.steps=2", "scale.eval_views=1", "validation.views=1", *LAUNCHERS[package]),
    ]
    first = subprocess.run(
        command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False
    )
    assert first.returncode == 1, first.stderr
    assert "1 of 2 cells are not done" in first.stderr and "failed, DataError" in first.stderr
    (grid,) = (tmp_path / "outputs/grid").iterdir()
    assert grid.name.startswith("splits.train-") and (grid / "report.md").is_file()
    states = {path.parent.name.rpartition("-")[0]: path for path in grid.glob("*/cell.json")}
    assert sorted(states) == ["splits.train-[broken]", "splits.train-[val]"]
    error = states["splits.train-[broken]"].parent / "error.txt"
    assert "Traceback" in error.read_text()
    metrics = states["splits.train-[val]"].parent / "metrics.json"
    before = metrics.stat().st_mtime_ns

    again = subprocess.run(
        command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False
    )
    assert again.returncode == 1 and "failed, DataError" in again.stderr
    assert metrics.stat().st_mtime_ns == before  # skipped
    assert list((tmp_path / "outputs/grid").iterdir()) == [grid]
