"""What stops or warns a training that went wrong."""

import logging

import lightning as L
import pytest
import torch

from charnerf.errors import NumericalError
from charnerf.training.guards import PATIENCE, WhiteAlarm
from support import small_runs


class Poison(L.Callback):
    """Makes the weights not a number before a step."""

    def on_train_batch_start(self, trainer, pl_module, batch, batch_idx):
        if batch.step == 2:
            with torch.no_grad():
                next(iter(pl_module.model.coarse.head.parameters())).fill_(torch.nan)


def test_a_loss_that_is_no_number_stops_with_its_batch_saved(figure_dataset, tmp_path):
    cfg = small_runs.smoke_config(
        figure_dataset, "encoder=single", "splits.train=[val]", "splits.val=val",
        "validation.times=1", "scale.steps=5",
    )  # fmt: skip
    run = small_runs.assemble(cfg, tmp_path)
    run.trainer.callbacks.append(Poison())
    with pytest.raises(NumericalError, match=r"at step 2: found .*nan.*rods.*nonfinite_batch_0000002\.pt"):
        run.fit()
    assert len(run.recorder.losses) <= 3
    saved = torch.load(tmp_path / "nonfinite_batch_0000002.pt", weights_only=True)
    assert saved["step"] == 2 and saved["names"] == ("rods",) and saved["rgb"].shape[-1] == 3


def test_the_white_alarm_fires_once_after_its_patience(figure_dataset, tmp_path, caplog):
    run = small_runs.assemble(small_runs.smoke_config(figure_dataset, "encoder=single"), tmp_path)
    alarm = WhiteAlarm()

    def steps(count: int, opacity: float) -> int:
        for _ in range(count):
            run.module.logged = {"train/opacity_foreground": opacity}
            alarm.on_train_batch_end(run.trainer, run.module)
        return caplog.text.count("collapsed to white")

    with caplog.at_level(logging.WARNING):
        assert steps(PATIENCE - 1, 0.001) == 0
        assert steps(1, 0.5) == 0  # the character is seen again: counting starts anew
        assert steps(PATIENCE - 1, 0.001) == 0
        assert steps(3, float("nan")) == 0  # batches that do not show it say nothing
        assert steps(1, 0.001) == 1
        assert steps(5 * PATIENCE, 0.0) == 1
    assert "batches.foreground_share" in caplog.text
