"""A term of the loss from outside: one class and one line of config."""

import csv

from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from support import small_runs

TERM = '''"""Fields shall be thin at the character's feet."""

import torch

from charnerf.losses.base import AbstractTerm, Needs, Query


class Thin(AbstractTerm):
    """Mean density at the origin, 1/m."""

    def __init__(self, *, weight: float) -> None:
        self.weights = {"thin": weight}
        self.needs = Needs()

    def query(self, batch, generators):
        origin = torch.zeros(len(batch.names), 1, 3)
        return Query(origin, origin)

    def values(self, rays, answer, batch):
        return {"thin": answer.densities.mean()}
'''


def test_a_term_from_outside_is_trained_logged_and_weighed_by_phases(figure_dataset, tmp_path, monkeypatch):
    (tmp_path / "thin_lab.py").write_text(TERM)
    monkeypatch.syspath_prepend(str(tmp_path))
    mine = (
        "trusted_targets=[thin_lab]",
        "+loss.thin={_target_:thin_lab.Thin,weight:0.5}",
        "validation.times=2",
    )
    phases = (
        "schedule=two_phase",
        "schedule.phases.0.until.share=0.5",
        "+schedule.phases.1.loss_weights={thin:0}",
    )
    small_runs.assemble(small_runs.smoke_config(figure_dataset, *mine, *phases), tmp_path / "run").fit()
    events = EventAccumulator(str(tmp_path / "run" / "tensorboard")).Reload()
    assert "train/loss/thin" in events.Tags()["scalars"]
    with (tmp_path / "run/curve.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0])[-2:] == ["perceptual", "thin"]
    assert float(rows[0]["thin"]) > 0.0
    assert rows[1]["thin"] == ""  # of the second phase
