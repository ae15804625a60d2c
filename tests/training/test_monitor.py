"""What a run tells."""

from types import SimpleNamespace
from typing import Any, cast

import pytest
import torch

from charnerf.progress import reported_to
from charnerf.training.module import TrainingModule
from charnerf.training.monitor import BudgetBar


def test_the_time_left_of_a_resumed_run_is_not_negative():
    clock = SimpleNamespace(budget_seconds=100.0, budget_steps=None, seconds=40.6, steps=10)
    bar, moments = BudgetBar(clock=cast(Any, clock)), []
    trainer = cast(Any, SimpleNamespace(callback_metrics={}, is_global_zero=True))
    module = TrainingModule.__new__(TrainingModule)
    torch.nn.Module.__init__(module)
    module.logged = {}
    with reported_to(moments.append):
        bar.on_train_start(trainer, module)
        clock.seconds = 70.3
        bar.on_train_batch_end(trainer, module)
        clock.seconds = 101.0
        bar.on_train_batch_end(trainer, module)
        bar.teardown(trainer, module, "fit")
    assert [one.share for one in moments] == pytest.approx([0.406, 0.703, 1.0])
    assert moments[0].left_s == pytest.approx(59.4) and moments[-1].left_s == 0.0
    assert moments[1].note == "step 10, loss -"
