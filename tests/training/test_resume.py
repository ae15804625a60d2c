"""A run that is cut off and goes on is the run that was never cut off, bit by bit."""

import torch

from support import small_runs

TWO_PHASES = (
    "loss=charnerf",
    "surface=area",
    "schedule=two_phase",  # until 0.57 of eight steps: the sixth is the first of the second phase
    "scale.steps=8",
    "validation.times=4",
)


def test_a_resumed_run_is_the_same_run(figure_dataset, tmp_path):
    cfg = small_runs.smoke_config(figure_dataset, *TWO_PHASES)
    straight = small_runs.assemble(cfg, tmp_path / "straight").fit()
    cut = small_runs.assemble(cfg, tmp_path / "cut", cut_at=7)
    try:
        cut.fit()
    except ConnectionAbortedError:
        pass
    checkpoint = tmp_path / "cut/checkpoints/last.ckpt"
    assert checkpoint.is_file() and len(cut.recorder.losses) == 7
    torch.manual_seed(123)  # whatever the process did before
    resumed = small_runs.assemble(cfg, tmp_path / "resumed").fit(checkpoint)
    steps = [batch[0] for batch in resumed.recorder.batches]
    assert steps == [6, 7]  # the last mark before the cut was at six steps
    assert resumed.recorder.losses == straight.recorder.losses[6:]
    assert resumed.recorder.batches == straight.recorder.batches[6:]
    assert torch.equal(small_runs.weights(resumed.module.model), small_runs.weights(straight.module.model))
    assert resumed.clock.steps == 8 and resumed.clock.seconds > 0
    assert len(straight.recorder.losses) == 8

    # counts change at the exact batch: rays and surface points of scale=smoke
    assert straight.recorder.batches == [(k, 0, 64, 64) for k in range(5)] + [
        (k, 1, 128, 128) for k in (5, 6, 7)
    ]
    curve = (tmp_path / "resumed/curve.csv").read_text().splitlines()
    assert [row.split(",")[:2] for row in curve[1:]] == [
        ["2", "0.0"],
        ["4", "0.0"],
        ["6", "1.0"],
        ["8", "1.0"],
    ]


def test_a_cut_within_the_first_phase_changes_phase_at_the_same_batch(figure_dataset, tmp_path):
    cfg = small_runs.smoke_config(figure_dataset, *TWO_PHASES)
    cut = small_runs.assemble(cfg, tmp_path / "cut", cut_at=3)
    try:
        cut.fit()
    except ConnectionAbortedError:
        pass
    resumed = small_runs.assemble(cfg, tmp_path / "resumed").fit(tmp_path / "cut/checkpoints/last.ckpt")
    phases = [(batch[0], batch[1]) for batch in resumed.recorder.batches]
    assert phases == [(2, 0), (3, 0), (4, 0), (5, 1), (6, 1), (7, 1)]


def test_the_last_checkpoint_is_the_last_one_also_where_nothing_got_better(figure_dataset, tmp_path):
    """A learning rate of nearly nothing: both validations measure the same."""
    cfg = small_runs.smoke_config(
        figure_dataset,
        "encoder=single",
        "splits.train=[val]",
        "optimizer=adam",
        "optimizer.lr=1.0e-30",
        "scale.steps=2",
        "validation.times=2",
    )
    small_runs.assemble(cfg, tmp_path).fit()
    done = {
        name: torch.load(tmp_path / f"checkpoints/{name}.ckpt", weights_only=True)["global_step"]
        for name in ("best", "last")
    }
    assert done == {"best": 1, "last": 2}
