"""Options for what the paper leaves open: a rate for the combinator, directions and delta of surface points."""

import pytest
import torch

from charnerf.errors import ConfigError
from charnerf.losses.surface import Surface
from charnerf.losses.total import WeightedLosses
from charnerf.training.run import build_losses
from support import small_runs


def surface_of(losses: WeightedLosses) -> Surface:
    (term,) = (one for one in losses.terms if isinstance(one, Surface))
    return term


PAPER = ("experiment=charnerf", "encoder=single", "scale.steps=2", "validation.times=1")


def test_a_combinator_learns_at_its_own_rate_and_points_are_seen_from_cameras(figure_dataset, tmp_path):
    cfg = small_runs.smoke_config(figure_dataset, *PAPER, "combinator.lr_scale=0.25", "surface_dirs=camera")
    run = small_runs.assemble(cfg, tmp_path)
    others, own = run.module.configure_optimizers().param_groups
    assert own["lr"] == 0.25 * others["lr"] == 0.25 * cfg.scale.learning_rate
    mine = {id(p) for p in run.module.model.coarse.combinator.parameters()}
    assert {id(p) for p in own["params"]} == mine
    assert len(others["params"]) + len(mine) == len(list(run.module.model.parameters()))
    seen: list[torch.Tensor] = []
    term = surface_of(run.module.losses)
    rule = term.directions
    term.directions = lambda *arguments: seen.append(rule(*arguments)) or seen[-1]  # type: ignore[assignment, func-returns-value]
    run.fit()
    assert len(seen) == 2 and all((dirs.norm(dim=-1) - 1).abs().amax() < 1e-5 for dirs in seen)
    first, second = run.trainer.optimizers[0].param_groups
    assert second["lr"] == pytest.approx(0.25 * first["lr"])


def test_one_rate_for_all_is_one_group_and_muon_takes_no_other(figure_dataset, tmp_path):
    cfg = small_runs.smoke_config(figure_dataset, *PAPER)
    assert len(small_runs.assemble(cfg, tmp_path / "one").module.configure_optimizers().param_groups) == 1
    cfg = small_runs.smoke_config(figure_dataset, *PAPER, "optimizer=muon", "combinator.lr_scale=0.25")
    with pytest.raises(
        ConfigError, match=r"combinator\.lr_scale: found 0\.25, but this optimizer takes no groups"
    ):
        small_runs.assemble(cfg, tmp_path / "two").module.configure_optimizers()


def test_delta_of_surface_points(figure_dataset):
    def delta(*overrides):
        losses, _ = build_losses(small_runs.smoke_config(figure_dataset, *overrides))
        return surface_of(losses).delta

    assert delta("loss.surface.delta=0.02") == 0.02
    assert delta() == pytest.approx(3.6 / 4)
    assert delta("scale.num_coarse=24", "scale.train_num_coarse=6") == pytest.approx(3.6 / 6)
    with pytest.raises(ConfigError, match=r"loss\.surface\.delta: found 0, expected more than 0"):
        delta("loss.surface.delta=0")
