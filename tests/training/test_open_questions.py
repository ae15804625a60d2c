"""Options for what the paper leaves open: a rate for the combinator, directions and delta of surface points."""

import pytest
import torch

from charnerf.errors import ConfigError
from charnerf.training.run import surface_delta
from support import small_runs

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
    rule = run.module.surface_dirs
    run.module.surface_dirs = lambda *arguments: seen.append(rule(*arguments)) or seen[-1]  # type: ignore[assignment, func-returns-value]
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
    assert surface_delta(small_runs.smoke_config(figure_dataset, "sampling.surface_delta=0.02")) == 0.02
    assert surface_delta(small_runs.smoke_config(figure_dataset)) == pytest.approx(3.6 / 4)
