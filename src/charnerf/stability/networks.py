"""Cases of the combinators, the density activations, the surface's alpha and the losses."""

from collections.abc import Iterator
from copy import deepcopy
from typing import Any

import mpmath
import torch
from torch import Tensor, nn

from charnerf.losses.terms import (
    absolute_alpha_error,
    absolute_depth_error,
    balanced_occupancy_error,
    squared_color_error,
    squared_opacity_error,
)
from charnerf.models.activations import ReLU, ShiftedSoftplus, TruncatedExp
from charnerf.models.combinators.base import AbstractCombinator
from charnerf.models.combinators.learned import LearnedWeights
from charnerf.models.combinators.mean import Mean
from charnerf.models.combinators.self_attention import SelfAttention
from charnerf.models.combinators.view_attention import ViewAttention
from charnerf.stability.exact import exactly
from charnerf.stability.measure import Bounds, Errors, Target, count_non_finite, doubled, largest
from charnerf.stability.report import CheckRow
from charnerf.volume.compositing import alphas_from_densities, expected_depth, weights_from_densities

WIDTH = 16
FUSED = Bounds(2e-5, 1e-13)
POINTS = 6


def combinators() -> dict[str, AbstractCombinator]:
    """One of each, seeded, the learned one away from its start."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(0)
        plain: dict[str, Any] = {"width": WIDTH, "num_heads": 4, "attention_width": None, "lr_scale": 1.0}
        plain |= {"residual": False, "norm": True, "temperature": None}
        attention = plain | {"residual": True, "temperature": 4.0}
        built: dict[str, AbstractCombinator] = {
            "mean": Mean(),
            "sa": SelfAttention(**plain),
            "view_mha": ViewAttention(**plain, view_scale=1.0),
            "view_mha, residual": ViewAttention(**attention, view_scale=1.0),
            "learned": LearnedWeights(width=WIDTH, hidden=8),
        }
        nn.init.normal_(built["learned"].score.weight)  # type: ignore[union-attr, arg-type]
    return built


def _view_inputs() -> dict[str, tuple[Tensor, Tensor, Tensor]]:
    """Features (P, V, D), query directions (P, 3) and source directions (P, V, 3) of the extreme cases."""
    generator = torch.Generator().manual_seed(0)

    def features(views: int, scale: float = 1.0) -> Tensor:
        return scale * torch.randn(POINTS, views, WIDTH, generator=generator, dtype=torch.float64)

    def directions(*shape: int) -> Tensor:
        drawn = torch.randn(*shape, 3, generator=generator, dtype=torch.float64)
        return drawn / drawn.norm(dim=-1, keepdim=True)

    query = directions(POINTS)
    same = query[:, None].expand(POINTS, 4, 3)
    opposite = torch.stack((query, -query, query, -query), dim=1)
    identical = features(1).expand(POINTS, 4, WIDTH)
    return {
        "zero query direction": (
            features(4),
            torch.zeros(POINTS, 3, dtype=torch.float64),
            directions(POINTS, 4),
        ),
        "opposite directions": (features(4), query, opposite),
        "identical directions": (features(4), query, same),
        "identical features": (identical, query, directions(POINTS, 4)),
        "one view": (features(1), query, directions(POINTS, 1)),
        "eight views": (features(8), query, directions(POINTS, 8)),
        "zero features": (features(4, 0.0), query, directions(POINTS, 4)),
        "features of 1e-30": (features(4, 1e-30), query, directions(POINTS, 4)),
        "features of 1e15": (features(4, 1e15), query, directions(POINTS, 4)),
    }


def combinator_cases(target: Target) -> Iterator[CheckRow]:
    """Every combinator against its float64 self, its permuted views, and the finiteness of all gradients."""
    if target.is_half:
        return
    for name, built in combinators().items():
        module = deepcopy(built).to(target.device, target.dtype)
        reference = deepcopy(built).double()
        for case, inputs in _view_inputs().items():
            if name == "learned" and "1e15" in case:
                continue  # a softmax of scores of 1e15 is a choice of one view, not a number to compare
            rounded = [target.tensor(value) for value in inputs]
            leaves = [value.clone().requires_grad_() for value in rounded]
            valid = torch.ones(leaves[2].shape[:2], dtype=torch.bool, device=target.device)
            fused = module(*leaves, valid)
            gradients = torch.autograd.grad(fused.sum(), [*leaves, *module.parameters()], allow_unused=True)
            exact = reference(*(doubled(value) for value in rounded), valid.cpu())
            scale = exact.abs().amax().clamp_min(1e-30)
            error = (doubled(fused) - exact) / scale
            order = torch.arange(valid.shape[1] - 1, -1, -1, device=target.device)
            permuted = module(leaves[0][:, order], leaves[1], leaves[2][:, order], valid)
            error = torch.maximum(error.abs(), doubled(permuted - fused).abs() / scale)
            bad = count_non_finite(fused, *(g for g in gradients if g is not None))
            yield target.row(f"combinator {name}", case, Errors(largest(error), None, bad), FUSED)


def hidden_view_cases(target: Target) -> Iterator[CheckRow]:
    """Points that no view sees, and points that one view sees: finite, and equal to that view alone."""
    if target.is_half:
        return
    for name, built in combinators().items():
        module = deepcopy(built).to(target.device, target.dtype)
        features, query, sources = (target.tensor(value) for value in _view_inputs()["opposite directions"])
        leaf = features.clone().requires_grad_()
        none = torch.zeros(POINTS, 4, dtype=torch.bool, device=target.device)
        unseen = module(leaf, query, sources, none)
        (gradient,) = torch.autograd.grad(unseen.sum(), leaf)
        one = none.clone()
        one[:, 2] = True
        alone = module(features[:, 2:3], query, sources[:, 2:3], one[:, 2:3])
        error = doubled(module(features, query, sources, one) - alone)
        bad = count_non_finite(unseen, gradient)
        yield target.row(
            f"combinator {name}", "no view, one of four", Errors(largest(error), None, bad), FUSED
        )


def activation_cases(target: Target) -> Iterator[CheckRow]:
    """Densities of raw values from -1e4 to 1e4, relative, and gradients; the plain exponential beside."""
    half = torch.logspace(-6, 4, 41, dtype=torch.float64)
    raw = target.tensor(torch.cat((-half.flip(0), half)))
    exp = TruncatedExp(shift=-1.0, scale=20.0, limit=8.0)
    activations = {
        "relu": (ReLU(scale=20.0), lambda x: 20 * max(x, 0)),
        "softplus": (ShiftedSoftplus(shift=-1.0, scale=20.0), lambda x: 20 * mpmath.log1p(mpmath.exp(x - 1))),
        "truncated exp": (exp, lambda x: 20 * mpmath.exp(min(x - 1, 8)) * (1 + max(x - 9, 0))),
    }
    for name, (activation, formula) in activations.items():
        leaf = raw.clone().requires_grad_()
        densities = activation(leaf)
        (gradient,) = torch.autograd.grad(densities.sum(), leaf)
        exact = exactly(formula, raw)
        # where a density is below 1e-6 / m nothing of 2 m absorbs light: the shift's rounding may show there
        error = (doubled(densities) - exact).abs() / exact.clamp_min(1e-6)
        errors = Errors(largest(error), None, count_non_finite(densities, gradient))
        yield target.row("density activation", f"{name}, raw -1e4..1e4", errors, Bounds(2e-5, 1e-13))
    if not target.is_half:
        leaf = raw.clone().requires_grad_()
        weights, final = weights_from_densities(leaf.exp(), torch.full_like(leaf, 0.01))
        (gradient,) = torch.autograd.grad(weights.sum(), leaf)
        exact = exactly(mpmath.exp, raw.clamp_max(80.0))
        error = (doubled(leaf.exp()) - exact).abs() / exact
        errors = Errors(largest(error), None, count_non_finite(weights, final, gradient))
        yield target.row(
            "density activation", "plain exp, raw -1e4..1e4", errors, Bounds(2e-5, 1e-13), formula="naive"
        )


def surface_cases(target: Target) -> Iterator[CheckRow]:
    """The surface loss' alpha with delta = (far - near) / 192, and the L1 against 1, from empty to opaque."""
    densities = target.tensor(torch.logspace(-4 if target.is_half else -20, 4, 49, dtype=torch.float64))
    deltas = target.tensor(torch.full((49,), 2.0 / 192, dtype=torch.float64))
    leaf = densities.clone().requires_grad_()
    alphas = alphas_from_densities(leaf, deltas)
    (gradient,) = torch.autograd.grad(absolute_alpha_error(alphas, torch.ones_like(alphas)), leaf)
    exact = -torch.expm1(-(doubled(densities) * doubled(deltas)))
    error = (doubled(alphas) - exact).abs() / exact
    errors = Errors(largest(error), None, count_non_finite(alphas, gradient))
    yield target.row("surface alpha", "density 1e-20..1e4, relative", errors, Bounds(1e-6, 1e-15))


def loss_cases(target: Target) -> Iterator[CheckRow]:
    """Terms at the ends of their domains: perfect, empty, no known depth, all inside or all outside."""
    if target.is_half:
        return
    zero, one = target.tensor(torch.zeros(8)), target.tensor(torch.ones(8))
    colors = target.tensor(torch.rand(8, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64))
    cases = {
        "colour, perfect": (squared_color_error, colors, colors, 0.0),
        "alpha, perfect": (absolute_alpha_error, one, one, 0.0),
        "alpha, all wrong": (absolute_alpha_error, zero, one, 1.0),
        "opacity, all wrong": (squared_opacity_error, one, zero, 1.0),
        "depth, none known": (_opaque_depth_error, one, zero, 0.0),
        "depth, 1 m off": (_opaque_depth_error, 3.0 * one, 2.0 * one, 1.0),
        "occupancy, all inside": (balanced_occupancy_error, one, one, 0.0),
        "occupancy, all outside, all wrong": (balanced_occupancy_error, one, zero, 0.5),
    }
    for name, (term, computed, wanted, exact) in cases.items():
        leaf = computed.clone().requires_grad_()
        value = term(leaf, wanted)
        (gradient,) = torch.autograd.grad(value, leaf)
        errors = Errors(largest(doubled(value) - exact), None, count_non_finite(value, gradient))
        yield target.row("loss", name, errors, Bounds(1e-6, 1e-15))


def depth_loss_cases(target: Target) -> Iterator[CheckRow]:
    """Steepest gradient of the depth term on a ray that sees next to nothing, over the length of the ray."""
    if target.is_half:
        return
    for formula in ("ours", "naive"):
        weights = target.tensor([[1e-12, 0.0], [1e-3, 0.0], [0.5, 0.5]]).requires_grad_()
        depth = expected_depth(weights, target.tensor([[2.0, 3.0]]), target.tensor([4.0]))
        opacity = weights.sum(-1) if formula == "ours" else torch.ones_like(depth)
        term = absolute_depth_error(depth, target.tensor([2.0, 2.0, 2.0]), opacity)
        (gradient,) = torch.autograd.grad(3.0 * term, weights)
        errors = Errors(largest(gradient) / 2.0, None, count_non_finite(depth, gradient))
        yield target.row(
            "loss", "depth of an empty ray, gradient / m", errors, Bounds(1.0, 1.0), formula=formula
        )


def _opaque_depth_error(depth: Tensor, wanted: Tensor) -> Tensor:
    return absolute_depth_error(depth, wanted, torch.ones_like(depth))


CASES = (combinator_cases, hidden_view_cases, activation_cases, surface_cases, loss_cases, depth_loss_cases)
