"""What a run shows."""

from types import SimpleNamespace
from typing import Any, cast

import torch

from charnerf.training.monitor import BudgetBar, _nearness
from charnerf.types import RenderOutput


def test_depth_is_drawn_of_what_is_seen():
    """White is nearest; rays that show nothing are black, whatever depth they carry."""
    depth = torch.tensor(((0.0, 3.0), (4.0, 9.0)))
    opacity = torch.tensor(((0.0, 1.0), (0.9, 0.2)))
    output = RenderOutput(torch.zeros(2, 2, 3), opacity, depth)
    assert _nearness(output).tolist() == [[0.0, 1.0], [0.25, 0.0]]
    assert _nearness(RenderOutput(output.rgb, 0.0 * opacity, depth)).eq(0).all()


def test_the_time_left_of_a_resumed_run_is_not_negative():
    clock = SimpleNamespace(budget_seconds=100.0, budget_steps=None, seconds=40.6, steps=7)
    bar = BudgetBar(clock=cast(Any, clock))
    bar.on_train_start(cast(Any, None), cast(Any, None))
    clock.seconds = 40.7
    bar.on_train_batch_end(SimpleNamespace(callback_metrics={}), cast(Any, None))
    assert bar.bar.n == clock.seconds > bar.bar.initial
    bar.on_train_end(cast(Any, None), cast(Any, None))
