"""The loss of a step: weights, passes, phases, and what is not computed."""

from dataclasses import replace

import pytest
import torch

from charnerf.errors import ConfigError
from charnerf.losses.total import TERMS, PassOutput, WeightedLosses
from charnerf.types import (
    Cameras,
    RayBundle,
    RenderOutput,
    SourceViews,
    SpacePoints,
    SurfacePoints,
    TrainBatch,
)


def batch(**changes) -> TrainBatch:
    """Two rays, one surface point, two labelled points of one character."""
    flags = torch.ones(1, 1, dtype=torch.bool)
    cameras = Cameras(torch.eye(4)[None, None], torch.ones(1, 1, 2), torch.ones(1, 1, 2), flags, 2, 2)
    made = TrainBatch(
        names=("hero",),
        views=SourceViews(torch.zeros(1, 1, 4, 2, 2), cameras, flags, ~flags),
        hull=None,
        rays=RayBundle(torch.zeros(1, 2, 3), torch.ones(1, 2, 3)),
        rgb=torch.tensor((((1.0, 1.0, 1.0), (0.0, 0.0, 0.0)),)),
        alpha=torch.tensor(((0.0, 1.0),)),
        depth=torch.tensor(((0.0, 4.0),)),
        surface=SurfacePoints(torch.zeros(1, 1, 3), torch.tensor((((0.5, 0.5, 0.5),),))),
        space=SpacePoints(torch.zeros(1, 2, 3), torch.tensor(((1.0, 0.0),))),
        phase=0,
        loss_weights={},
        step=0,
    )
    return replace(made, **changes)


def answered(**changes) -> PassOutput:
    """An answer whose every term is known."""
    rays = RenderOutput(
        rgb=torch.tensor((((1.0, 1.0, 0.0), (0.0, 0.0, 0.0)),)),
        opacity=torch.tensor(((0.5, 1.0),)),
        depth=torch.tensor(((9.0, 3.0),)),
    )
    made = PassOutput(
        rays=rays,
        surface_rgb=torch.tensor((((0.5, 0.0, 0.5),),)),
        surface_alpha=torch.tensor(((0.25,),)),
        space_alpha=torch.tensor(((0.5, 0.0),)),
    )
    return replace(made, **changes)


BY_HAND = {
    "reconstruction": 0.5,
    "surface_rgb": 0.25,
    "surface_alpha": 0.75,
    "opacity": 0.125,
    "depth": 1.0,
    "occupancy": 0.125,
}


def test_every_term_by_hand_and_their_weighted_sum():
    weights = {term: 0.1 * (k + 1) for k, term in enumerate(TERMS)}
    total, terms = WeightedLosses(weights=weights)([answered()], batch())
    assert terms.keys() == BY_HAND.keys() == set(TERMS)
    for term, value in terms.items():
        assert value.item() == pytest.approx(BY_HAND[term]), term
    assert total.item() == pytest.approx(sum(weights[term] * BY_HAND[term] for term in TERMS))


def test_coarse_and_fine_add_up():
    total, terms = WeightedLosses(weights={"reconstruction": 2.0})([answered(), answered()], batch())
    assert terms["reconstruction"].item() == 1.0 and total.item() == 2.0


def test_a_term_of_weight_zero_is_not_computed():
    """Its numbers may be anything: none of them reaches the loss or its gradient."""
    poison = torch.full((1, 1), torch.nan, requires_grad=True)
    rgb = torch.zeros(1, 2, 3, requires_grad=True)
    one = answered(surface_alpha=poison)
    one = replace(one, rays=replace(one.rays, rgb=rgb, depth=torch.full((1, 2), torch.nan)))
    losses = WeightedLosses(weights={"reconstruction": 1.0, "surface_alpha": 0.0, "depth": 0.0})
    total, terms = losses([one], batch())
    assert set(terms) == {"reconstruction"}
    total.backward()
    assert total.isfinite() and poison.grad is None and rgb.grad.isfinite().all()
    assert losses.reads("reconstruction") and not losses.reads("depth") and not losses.reads("opacity")


def test_a_phase_overrides_weights_both_ways():
    losses = WeightedLosses(weights={"reconstruction": 1.0, "opacity": 0.1})
    total, terms = losses([answered()], batch(loss_weights={"opacity": 0.0, "surface_alpha": 2.0}))
    assert set(terms) == {"reconstruction", "surface_alpha"}
    assert total.item() == pytest.approx(0.5 + 2.0 * 0.75)
    again, _ = losses([answered()], batch())
    assert again.item() == pytest.approx(0.5 + 0.1 * 0.125)  # nothing of a phase stays
    assert losses.active({"opacity": 0.3}) == {"reconstruction": 1.0, "opacity": 0.3}


def test_terms_without_data_are_left_out():
    """A character without a mesh trains by its rays."""
    losses = WeightedLosses(weights=dict.fromkeys(TERMS, 1.0))
    bare = answered(surface_rgb=None, surface_alpha=None, space_alpha=None)
    total, terms = losses([bare], batch(surface=None, space=None, depth=None))
    assert set(terms) == {"reconstruction", "opacity"}
    assert total.item() == pytest.approx(0.625)


def test_an_unknown_term_is_named():
    with pytest.raises(
        ConfigError, match=r"loss\.weights\.colour: found an unknown term, expected one of recons"
    ):
        WeightedLosses(weights={"reconstruction": 1.0, "colour": 1.0})
