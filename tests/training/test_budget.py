"""What ends a run, and a run that is over."""

import csv
import signal
from collections.abc import Iterator
from contextlib import contextmanager

import torch

from support import small_runs

SHORT = ("encoder=single", "splits.train=[val]", "scale.phase_rays=[16,16]")


@contextmanager
def at_most(seconds: int) -> Iterator[None]:
    """Fail instead of running for ever."""

    def stop(*_: object) -> None:
        raise TimeoutError(f"did not end within {seconds} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def test_a_budget_of_seconds_ends_the_run_and_measures_its_end(figure_dataset, tmp_path):
    cfg = small_runs.smoke_config(
        figure_dataset, *SHORT, "scale.steps=null", "scale.seconds=1.5", "validation.times=3"
    )
    with at_most(60):
        run = small_runs.assemble(cfg, tmp_path).fit()
    steps = len(run.recorder.losses)
    assert [batch[0] for batch in run.recorder.batches] == list(range(steps)) and run.clock.steps == steps
    assert run.clock.seconds >= 1.5
    with (tmp_path / "curve.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert int(rows[-1]["step"]) == steps and float(rows[-1]["seconds"]) >= 1.5
    assert 1 <= len(rows) <= 4
    content = torch.load(tmp_path / "checkpoints/last.ckpt", weights_only=True)
    assert content["global_step"] == steps


def test_going_on_from_a_run_that_is_over_ends_at_once(figure_dataset, tmp_path):
    """Its weights are what the first run left; more budget goes on from there."""
    small = ("scale.steps=2", "validation.times=1")
    cfg = small_runs.smoke_config(figure_dataset, *SHORT, *small)
    first = small_runs.assemble(cfg, tmp_path / "first").fit()
    checkpoint = tmp_path / "first/checkpoints/last.ckpt"
    with at_most(60):
        again = small_runs.assemble(cfg, tmp_path / "again").fit(checkpoint)
    assert again.recorder.losses == [] and again.clock.steps == 2
    assert torch.equal(small_runs.weights(again.module.model), small_runs.weights(first.module.model))
    more = small_runs.smoke_config(figure_dataset, *SHORT, "scale.steps=4", "validation.times=1")
    with at_most(60):
        longer = small_runs.assemble(more, tmp_path / "longer").fit(checkpoint)
    assert [batch[0] for batch in longer.recorder.batches] == [2, 3]


def test_seconds_go_on_after_a_resume_between_two_validations(figure_dataset, tmp_path):
    """No epoch starts there; a clock that waits for one never ends the run."""

    def config(seconds):
        timed = ("scale.steps=null", f"scale.seconds={seconds}", "validation.times=1")
        return small_runs.smoke_config(figure_dataset, *SHORT, *timed)

    run = small_runs.assemble(config(600.0), tmp_path / "cut", cut_at=3)
    try:
        run.fit()
    except ConnectionAbortedError:
        run.trainer.save_checkpoint(tmp_path / "mid.ckpt")
    with at_most(60):
        seconds = run.clock.seconds + 0.5
        resumed = small_runs.assemble(config(seconds), tmp_path / "resumed").fit(tmp_path / "mid.ckpt")
    assert resumed.clock.seconds >= seconds and resumed.recorder.batches[0][0] == 3
