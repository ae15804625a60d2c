"""Quadratures against closed forms, with their orders measured."""

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from charnerf.geometry.sampling import edges_from_t_vals, stratified_t_vals
from charnerf.volume.quadrature import AbstractQuadrature, PiecewiseConstant, PiecewiseLinear

SETTINGS = settings(deadline=None, max_examples=60, database=None, derandomize=True)
QUADRATURES = [PiecewiseConstant(), PiecewiseLinear()]
ZERO, ONE = torch.zeros(1, dtype=torch.float64), torch.ones(1, dtype=torch.float64)


def fit_order(counts: list[int], errors: list[float]) -> float:
    """Slope of log error over log spacing."""
    x, y = -torch.tensor(counts, dtype=torch.float64).log(), torch.tensor(errors, dtype=torch.float64).log()
    return float(((x - x.mean()) * (y - y.mean())).sum() / (x - x.mean()).square().sum())


def color_error(quadrature: AbstractQuadrature, count: int, generator: torch.Generator | None) -> float:
    """RMS error of the composited colour c(t) = t^2 through the exponential density 6 exp(-2 t) on [0, 1]."""
    t = (torch.arange(1 << 17, dtype=torch.float64) + 0.5) / (1 << 17)
    depth = 3.0 * -torch.expm1(-2.0 * t)
    exact = (6.0 * torch.exp(-2.0 * t) * torch.exp(-depth) * t * t).mean()
    rays = 1 if generator is None else 200
    near, far = ZERO.expand(rays), ONE.expand(rays)
    t_vals = stratified_t_vals(near, far, count, generator)
    weights, _ = quadrature.weights(
        6.0 * torch.exp(-2.0 * t_vals), t_vals, edges_from_t_vals(t_vals, near, far)
    )
    return float(((weights * t_vals.square()).sum(-1) - exact).square().mean().sqrt())


@pytest.mark.parametrize("quadrature", QUADRATURES, ids=lambda q: type(q).__name__)
@pytest.mark.parametrize("jittered", [False, True])
def test_error_falls_with_the_square_of_the_spacing(quadrature, jittered):
    counts = [16, 32, 64, 128, 256]
    generator = torch.Generator().manual_seed(0) if jittered else None
    order = fit_order(counts, [color_error(quadrature, count, generator) for count in counts])
    assert order == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("quadrature", QUADRATURES, ids=lambda q: type(q).__name__)
def test_transmittance_of_an_exponential_density(quadrature):
    counts, errors = [8, 16, 32, 64], []
    for count in counts:
        t_vals = stratified_t_vals(ZERO, ONE, count)
        _, final = quadrature.weights(
            6.0 * torch.exp(-2.0 * t_vals), t_vals, edges_from_t_vals(t_vals, ZERO, ONE)
        )
        errors.append(abs(final.item() - math.exp(-3.0 * (1.0 - math.exp(-2.0)))))
    assert fit_order(counts, errors) == pytest.approx(2.0, abs=0.2)


def test_linear_density_is_exact_between_the_samples():
    """Any samples on the line, any edges between them: weights are differences of the exact transmittance."""
    t_vals = torch.tensor([[0.0, 0.1, 0.35, 0.4, 1.0]], dtype=torch.float64)
    edges = torch.tensor([[0.0, 0.02, 0.3, 0.39, 0.9, 1.0]], dtype=torch.float64)
    weights, final = PiecewiseLinear().weights(3.0 + 40.0 * t_vals, t_vals, edges)
    transmittance = torch.exp(-(3.0 * edges + 20.0 * edges.square()))
    torch.testing.assert_close(weights, -transmittance.diff(dim=-1), rtol=1e-12, atol=1e-14)
    torch.testing.assert_close(final, transmittance[:, -1], rtol=1e-12, atol=0)


@pytest.mark.parametrize("quadrature", QUADRATURES, ids=lambda q: type(q).__name__)
def test_constant_density_is_exact_for_both(quadrature):
    t_vals = stratified_t_vals(ZERO, ONE, 7, torch.Generator().manual_seed(3))
    edges = edges_from_t_vals(t_vals, ZERO, ONE)
    weights, final = quadrature.weights(torch.full_like(t_vals, 2.5), t_vals, edges)
    torch.testing.assert_close(weights, -torch.exp(-2.5 * edges).diff(dim=-1))
    assert final.item() == pytest.approx(math.exp(-2.5), rel=1e-14)


def test_linear_draws_invert_the_continuous_cdf():
    """Deterministic draws sit at equal shares of the light that the linear density absorbs."""
    t_vals = torch.tensor([[0.0, 0.5, 1.0]], dtype=torch.float64)
    edges = torch.tensor([[0.0, 0.25, 0.75, 1.0]], dtype=torch.float64)
    for slope in (1e-6, 1.0, 50.0, 1e8):
        drawn = PiecewiseLinear().importance_t_vals(slope * t_vals, t_vals, edges, 40)
        absorbed = torch.expm1(-0.5 * slope * drawn.square()) / math.expm1(-0.5 * slope)
        torch.testing.assert_close(
            absorbed, ((torch.arange(40, dtype=torch.float64) + 0.5) / 40)[None], rtol=0, atol=1e-9
        )


@pytest.mark.parametrize("quadrature", QUADRATURES, ids=lambda q: type(q).__name__)
def test_draws_follow_the_weights_and_empty_rays_are_uniform(quadrature):
    t_vals = stratified_t_vals(ZERO, ONE, 8, torch.Generator().manual_seed(0))
    edges = edges_from_t_vals(t_vals, ZERO, ONE)
    densities = 10.0 * torch.rand(1, 8, dtype=torch.float64, generator=torch.Generator().manual_seed(1))
    weights, _ = quadrature.weights(densities, t_vals, edges)
    drawn = quadrature.importance_t_vals(densities, t_vals, edges, 20000)
    counts = torch.histogram(drawn[0], bins=edges[0])[0] / 20000
    torch.testing.assert_close(counts, (weights / weights.sum())[0], rtol=0, atol=2e-4)
    for useless in (torch.zeros_like(densities), torch.full_like(densities, torch.nan)):
        drawn = quadrature.importance_t_vals(useless, t_vals, edges, 4)
        torch.testing.assert_close(drawn, torch.tensor([[0.125, 0.375, 0.625, 0.875]], dtype=torch.float64))


@SETTINGS
@given(
    shape=st.lists(st.integers(1, 3), max_size=2),
    num_samples=st.integers(1, 33),
    exponent=st.floats(-30, 30),
    span=st.floats(0, 8),
    equal=st.booleans(),
    seed=st.integers(0, 9999),
    double=st.booleans(),
)
@pytest.mark.parametrize("quadrature", QUADRATURES, ids=lambda q: type(q).__name__)
def test_any_stiffness(*, quadrature, shape, num_samples, exponent, span, equal, seed, double):
    """Weights sum to one, gradients are finite, draws sorted and inside; also where samples coincide."""
    dtype = torch.float64 if double else torch.float32
    generator = torch.Generator().manual_seed(seed)
    near, far = torch.zeros(shape, dtype=dtype), torch.ones(shape, dtype=dtype)
    t_vals = stratified_t_vals(near, far, num_samples, generator)
    if equal:
        t_vals = t_vals[..., :1].expand_as(t_vals).clone()
    t_vals.requires_grad_()
    exponents = exponent + span * torch.rand(t_vals.shape, generator=generator, dtype=dtype)
    densities = (10.0**exponents).requires_grad_()
    edges = edges_from_t_vals(t_vals, near, far)
    weights, final = quadrature.weights(densities, t_vals, edges)
    bound = 1e-13 if double else 5e-6
    assert (weights.sum(-1) + final - 1).abs().max() <= bound and weights.ge(0).all()
    (weights.square().sum() + final.sum()).backward()
    assert densities.grad.isfinite().all() and t_vals.grad.isfinite().all()
    drawn = quadrature.importance_t_vals(densities, t_vals, edges, 9, generator)
    assert not drawn.requires_grad and drawn.diff(dim=-1).ge(0).all()
    assert drawn.ge(0).all() and drawn.le(1).all()


@pytest.mark.parametrize("quadrature", QUADRATURES, ids=lambda q: type(q).__name__)
def test_gradcheck(quadrature):
    t_vals = torch.tensor([[0.1, 0.3, 0.8]], dtype=torch.float64, requires_grad=True)
    densities = torch.tensor([[2.0, 0.5, 9.0]], dtype=torch.float64, requires_grad=True)
    edges = torch.tensor([[0.0, 0.2, 0.7, 1.0]], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(quadrature.weights, (densities, t_vals, edges))
