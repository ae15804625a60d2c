"""The loss of a step: weights, passes, phases, and what is not computed."""

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from charnerf.errors import ConfigError
from charnerf.losses.base import Needs
from charnerf.losses.depth import Depth
from charnerf.losses.directions import NoDirections
from charnerf.losses.occupancy import Occupancy
from charnerf.losses.opacity import Opacity
from charnerf.losses.reconstruction import Reconstruction
from charnerf.losses.surface import Surface
from charnerf.losses.total import Pass, WeightedLosses
from charnerf.scene import FunctionField
from charnerf.schedule import Phase, PhaseSchedule
from charnerf.types import FieldOutput, RenderOutput, TrainBatch
from support.batches import small_batch


def field(points: Tensor, directions: Tensor) -> FieldOutput:
    """Answers the surface point by a quarter of alpha in an interval of 1 m, the labelled points by a half and by none."""
    alphas = torch.tensor((0.25,) if len(points) == 1 else (0.5, 0.0))
    return FieldOutput(torch.tensor((0.5, 0.0, 0.5)).expand(len(points), 3), -torch.log1p(-alphas))


def answered(answers=field, **changes) -> Pass:
    """A pass whose every value is known."""
    rays = RenderOutput(
        rgb=torch.tensor((((1.0, 1.0, 0.0), (0.0, 0.0, 0.0)),)),
        opacity=torch.tensor(((0.5, 1.0),)),
        depth=torch.tensor(((9.0, 3.0),)),
    )
    return Pass(replace(rays, **changes), [FunctionField(answers)])


def losses(**weights: float) -> WeightedLosses:
    """All terms; values that are not named weigh 0."""
    weight = dict.fromkeys(BY_HAND, 0.0) | weights
    surface = Surface(
        rgb_weight=weight["surface_rgb"], alpha_weight=weight["surface_alpha"], directions=NoDirections(),
        delta=1.0, box_half_extent=1.8, num_coarse=4, num_fine=0,
    )  # fmt: skip
    return WeightedLosses(
        {
            "reconstruction": Reconstruction(weight=weight["reconstruction"]),
            "surface": surface,
            "opacity": Opacity(weight=weight["opacity"]),
            "depth": Depth(weight=weight["depth"]),
            "occupancy": Occupancy(weight=weight["occupancy"], num_points=2, delta=1.0),
        }
    )


def add_up(loss: WeightedLosses, passes: list[Pass], batch: TrainBatch) -> tuple[Tensor, dict[str, Tensor]]:
    return loss(passes, batch, [torch.Generator()])


BY_HAND = {
    "reconstruction": 0.5,
    "surface_rgb": 0.25,
    "surface_alpha": 0.75,
    "opacity": 0.125,
    "depth": 1.0,
    "occupancy": 0.125,
}


def test_every_term_by_hand_and_their_weighted_sum():
    weights = {name: 0.1 * (k + 1) for k, name in enumerate(BY_HAND)}
    loss = losses(**weights)
    total, values = add_up(loss, [answered()], small_batch())
    assert loss.names == tuple(values) == tuple(BY_HAND)
    for name, value in values.items():
        assert value.item() == pytest.approx(BY_HAND[name]), name
    assert total.item() == pytest.approx(sum(weights[name] * BY_HAND[name] for name in BY_HAND))


def test_coarse_and_fine_add_up():
    total, values = add_up(losses(reconstruction=2.0), [answered(), answered()], small_batch())
    assert values["reconstruction"].item() == 1.0 and total.item() == 2.0


def test_what_weighs_zero_reaches_neither_loss_nor_gradient():
    """Its numbers may be anything."""
    poison = torch.full((1,), torch.nan, requires_grad=True)
    rgb = torch.zeros(1, 2, 3, requires_grad=True)
    one = answered(
        lambda points, _: FieldOutput(torch.zeros_like(points), poison),
        rgb=rgb,
        depth=torch.full((1, 2), torch.nan),
    )
    total, values = add_up(losses(reconstruction=1.0, surface_rgb=1.0), [one], small_batch())
    assert set(values) == {"reconstruction", "surface_rgb"}
    total.backward()
    assert total.isfinite() and poison.grad is None and rgb.grad.isfinite().all()


def test_a_field_is_not_queried_for_a_term_of_weight_zero():
    def refuses(points: Tensor, directions: Tensor) -> FieldOutput:
        raise AssertionError

    add_up(losses(reconstruction=1.0, opacity=0.1, depth=0.1), [answered(refuses)], small_batch())


def test_a_phase_overrides_weights_both_ways():
    loss = losses(reconstruction=1.0, opacity=0.1)
    total, values = add_up(
        loss, [answered()], small_batch(loss_weights={"opacity": 0.0, "surface_alpha": 2.0})
    )
    assert set(values) == {"reconstruction", "surface_alpha"}
    assert total.item() == pytest.approx(0.5 + 2.0 * 0.75)
    again, _ = add_up(loss, [answered()], small_batch())
    assert again.item() == pytest.approx(0.5 + 0.1 * 0.125)  # nothing of a phase stays
    assert loss.active({"opacity": 0.3}) == {"reconstruction": 1.0, "opacity": 0.3}


def test_terms_without_data_are_left_out():
    """A character without a mesh trains by its rays."""
    loss = losses(**dict.fromkeys(BY_HAND, 1.0))
    total, values = add_up(loss, [answered()], small_batch(surface=None, space=None, depth=None))
    assert set(values) == {"reconstruction", "opacity"}
    assert total.item() == pytest.approx(0.625)


def schedule(*overrides: dict[str, float]) -> PhaseSchedule:
    """A phase for each override of weights."""
    ends = [{"steps": k + 1} for k in range(len(overrides) - 1)] + [None]
    return PhaseSchedule(
        phases=[
            Phase(rays=8, surface_points=8, loss_weights=weights, until=end)
            for weights, end in zip(overrides, ends, strict=True)
        ]
    )


def test_only_what_some_phase_weighs_needs_data():
    assert losses(reconstruction=1.0, opacity=1.0).needs(schedule({})) == Needs()
    assert losses(depth=1.0, surface_alpha=1.0).needs(schedule({})) == Needs(depth=True, surface=True)
    assert losses(depth=1.0).needs(schedule({"depth": 0.0}, {"depth": 0.0, "occupancy": 0.1})) == Needs(
        space_points=2
    )
    assert losses(depth=1.0).needs(schedule({"depth": 0.0}, {})) == Needs(depth=True)


def test_a_phase_that_weighs_what_is_not_there_is_named():
    expected = r"schedule\.phases\.1\.loss_weights\.surface: found no such value, expected one of recons"
    with pytest.raises(ConfigError, match=expected):
        losses().needs(schedule({}, {"surface": 1.0}))


def test_two_values_of_one_name_are_refused():
    with pytest.raises(ConfigError, match=r"loss\.again: found a second value named depth"):
        WeightedLosses({"depth": Depth(weight=1.0), "again": Depth(weight=0.0)})
