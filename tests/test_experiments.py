"""Experiments are the rows of the paper's Table II, and each differs in what its name says."""

from pathlib import Path
from typing import Any

import pytest
from omegaconf import OmegaConf

from charnerf.config.composition import compose_config
from charnerf.training.run import build_losses

ROOT = Path(__file__).resolve().parents[1]
EXPERIMENT_ROWS = {"charnerf", "pixelnerf", "single_encoder", "no_mha", "no_mha_depth", "no_view"}


def test_experiments_are_rows_of_the_table() -> None:
    there = {option.stem for option in (ROOT / "conf/experiment").glob("*.yaml")}
    assert there == EXPERIMENT_ROWS


def flat(node: Any, key: str = "") -> dict[str, Any]:
    """Values of a composed config by their full keys."""
    if not isinstance(node, dict | list):
        return {key: node}
    items = node.items() if isinstance(node, dict) else enumerate(node)
    values: dict[str, Any] = {}
    for name, value in items:
        values |= flat(value, f"{key}.{name}" if key else str(name))
    return values


ENCODER = {
    f"encoder.{part}_{what}" for part in ("coarse", "fine") for what in ("stacks", "width", "channels")
}
ENCODER |= {"encoder._target_", "encoder.reduction"}
ATTENTION = {"num_heads", "attention_width", "residual", "norm", "lr_scale", "temperature", "view_scale"}
ATTENTION = {f"combinator.{key}" for key in ATTENTION} | {"combinator._target_"}
SURFACE = {"loss.surface.rgb_weight", "loss.surface.alpha_weight"}
PIXELNERF = {
    *ENCODER,
    *("encoder.depth", "encoder.stride", "encoder.pretrained"),
    *ATTENTION,
    *SURFACE,
    *("single_view._target_", "single_view.octaves", "single_view.factor"),
    *("density._target_", "model.activation._target_", "model.activation.shift", "model.activation.scale"),
    *(
        "quadrature._target_",
        "quadrature.share",
        "quadrature.deviation",
        "renderer.num_fine",
        "loss.surface.num_fine",
    ),
    *("scale.num_multi_view_blocks", "model.num_multi_view_blocks"),
}
ROWS = {
    "single_encoder": {*ENCODER, "encoder.num_stacks", "encoder.width", "encoder.out_channels"},
    "no_mha": ATTENTION,
    "no_mha_depth": {*ATTENTION, "loss.depth.weight"},
    "no_view": {"combinator._target_", "combinator.view_scale"},
    "pixelnerf": PIXELNERF,
}


@pytest.mark.parametrize("row", ROWS)
def test_experiments_differ_from_the_paper_only_in_their_name(row: str) -> None:
    """At a scale where every difference shows: key by key, and only the loss, the mean or the encoder that the row names."""
    paper = flat(OmegaConf.to_container(compose_config(["experiment=charnerf", "scale=smoke"]), resolve=True))
    other = flat(OmegaConf.to_container(compose_config([f"experiment={row}", "scale=smoke"]), resolve=True))
    differing = {key for key in paper.keys() | other.keys() if paper.get(key, "-") != other.get(key, "-")}
    assert differing == {"name", *ROWS[row]}
    assert other["name"] == row


def test_pixelnerf_is_pixelnerf_at_the_papers_scale() -> None:
    """Its published defaults (the widths of its encoder are fixed; see the encoder's own test)."""
    cfg = compose_config(["experiment=pixelnerf", "scale=paper"])
    assert (cfg.renderer.num_coarse, cfg.scale.train_num_coarse, cfg.renderer.num_fine) == (64, 64, 32)
    assert (cfg.quadrature.share, cfg.quadrature.deviation) == (0.5, 0.01)
    assert (cfg.single_view.octaves, cfg.single_view.factor) == (6, 1.5)
    assert (cfg.model.num_single_view_blocks, cfg.model.num_multi_view_blocks) == (3, 2)
    assert (cfg.model.width, cfg.scale.learning_rate, cfg.scale.batch_characters) == (512, 1e-4, 4)
    assert build_losses(cfg)[0].active({}) == {"reconstruction": 1.0}
    for group, name in (("encoder", "ResNet34"), ("combinator", "Mean"), ("head", "RadianceHead")):
        assert cfg[group]._target_.endswith(f".{name}")
    assert cfg.model.activation._target_.endswith(".ReLU") and cfg.density._target_.endswith(
        ".ViewInF1Density"
    )


def test_only_the_row_with_depth_reads_it() -> None:
    for row in EXPERIMENT_ROWS:
        cfg = compose_config([f"experiment={row}"])
        assert build_losses(cfg)[1].depth == (row == "no_mha_depth")
        both = compose_config([f"experiment={row}", "loss=opacity"])  # the table once more, with another loss
        assert both.loss.opacity.weight == 0.1


def test_overrides_win_over_an_experiment() -> None:
    cfg = compose_config(["experiment=no_mha", "combinator=sa", "scale=base", "seed=3"])
    assert cfg.combinator._target_.endswith("SelfAttention")
    assert (cfg.scale.width, cfg.seed) == (compose_config(["scale=base"]).scale.width, 3)
