"""Batches made ahead by another process are the same batches, and its errors the same errors."""

import multiprocessing
import shutil

import pytest
import torch

from charnerf.errors import ConfigError, DataError
from support import small_runs

SETTINGS = (
    "loss=charnerf",
    "surface=area",
    "schedule=two_phase",
    "augmentation=[stretch,recolor,mirror]",
    "scale.steps=6",
    "validation.times=3",
)
forks = pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="this system can not fork processes"
)


@forks
def test_workers_make_the_same_run(figure_dataset, tmp_path):
    runs = [
        small_runs.assemble(
            small_runs.smoke_config(figure_dataset, *SETTINGS, f"batches.workers={workers}"),
            tmp_path / str(workers),
        ).fit()
        for workers in (0, 2)
    ]
    alone, ahead = runs
    assert ahead.recorder.batches == alone.recorder.batches and len(alone.recorder.batches) == 6
    assert ahead.recorder.losses == alone.recorder.losses
    assert torch.equal(small_runs.weights(ahead.module.model), small_runs.weights(alone.module.model))
    # its characters are opened there alone, once for all epochs
    assert alone.data.train_store._open and not ahead.data.train_store._open


@forks
def test_an_error_of_a_worker_is_the_same_error(figure_dataset, tmp_path):
    root = tmp_path / "dataset"
    shutil.copytree(figure_dataset, root)
    picture = sorted((root / "lefty/images").glob("*.png"))[0]
    picture.write_bytes(b"no picture")
    cfg = small_runs.smoke_config(root, *SETTINGS)
    said = []
    for workers in (0, 1):
        cfg.batches.workers = workers
        with pytest.raises(DataError, match=picture.name) as caught:
            small_runs.assemble(cfg, tmp_path / str(workers)).fit()
        said.append(str(caught.value))
    assert said[0] == said[1]


def test_a_cpu_makes_its_batches_itself_unless_told_otherwise(figure_dataset, tmp_path):
    run = small_runs.assemble(small_runs.smoke_config(figure_dataset), tmp_path)
    run.data.trainer = run.trainer
    loader = run.data.train_dataloader()
    assert loader.num_workers == 0 and not loader.pin_memory


def test_workers_where_nothing_forks_are_refused(figure_dataset, tmp_path, monkeypatch):
    monkeypatch.setattr(multiprocessing, "get_all_start_methods", lambda: ["spawn"])
    with pytest.raises(ConfigError, match=r"batches\.workers: found 2.*batches\.workers=0"):
        small_runs.assemble(small_runs.smoke_config(figure_dataset, "batches.workers=2"), tmp_path)
