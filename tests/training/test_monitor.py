"""What a run shows."""

from types import SimpleNamespace
from typing import Any, cast

import pytest
import torch
from torch.utils.tensorboard import SummaryWriter

from charnerf.progress import reported_to
from charnerf.training.monitor import BudgetBar, _nearness
from charnerf.types import RenderOutput
from support import small_runs


def test_depth_is_drawn_of_what_is_seen():
    """White is nearest; rays that show nothing are black, whatever depth they carry."""
    depth = torch.tensor(((0.0, 3.0), (4.0, 9.0)))
    opacity = torch.tensor(((0.0, 1.0), (0.9, 0.2)))
    output = RenderOutput(torch.zeros(2, 2, 3), opacity, depth)
    assert _nearness(output).tolist() == [[0.0, 1.0], [0.25, 0.0]]
    assert _nearness(RenderOutput(output.rgb, 0.0 * opacity, depth)).eq(0).all()


def test_the_time_left_of_a_resumed_run_is_not_negative():
    clock = SimpleNamespace(budget_seconds=100.0, budget_steps=None, seconds=40.6, steps=10)
    bar, moments = BudgetBar(clock=cast(Any, clock)), []
    trainer = cast(Any, SimpleNamespace(callback_metrics={}, is_global_zero=True))
    with reported_to(moments.append):
        bar.on_train_start(trainer, cast(Any, None))
        clock.seconds = 70.3
        bar.on_train_batch_end(trainer, cast(Any, None))
        clock.seconds = 101.0
        bar.on_train_batch_end(trainer, cast(Any, None))
        bar.teardown(trainer, cast(Any, None), "fit")
    assert [one.share for one in moments] == pytest.approx([0.406, 0.703, 1.0])
    assert moments[0].left_s == pytest.approx(59.4) and moments[-1].left_s == 0.0
    assert moments[1].note == "step 10, loss -"


def test_the_picture_that_is_shown_is_the_one_that_was_measured(figure_dataset, tmp_path, monkeypatch):
    """A validation renders each of its views once, drawn or not."""
    cfg = small_runs.smoke_config(
        figure_dataset, "encoder=single", "validation.times=1", "validation.views=2"
    )
    run = small_runs.assemble(cfg, tmp_path)
    rendered, shown = [], []
    render = run.module.eval_renderer.render_camera

    def render_camera(*arguments):
        rendered.append(render(*arguments))
        return rendered[-1]

    monkeypatch.setattr(run.module, "eval_renderer", SimpleNamespace(render_camera=render_camera))
    monkeypatch.setattr(SummaryWriter, "add_image", lambda _, tag, image, step: shown.append((tag, image)))
    run.fit()
    assert len(rendered) == 2 * len(run.data.val_store)
    first = dict(shown)["val/truth_prediction_depth_opacity/0"][:, :, 32:64]
    torch.testing.assert_close(first, rendered[0].finest.rgb.clamp(0, 1).permute(2, 0, 1))
