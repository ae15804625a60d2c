"""Compositing against closed forms and 60-digit sums."""

import mpmath
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from charnerf.errors import ShapeError
from charnerf.volume.compositing import (
    absorbed_share,
    alphas_from_densities,
    composite,
    depth_over_background,
    expected_depth,
    optical_depths_before,
    transmittance_from_densities,
    weights_from_densities,
    weights_from_optical_depths,
)

SETTINGS = settings(deadline=None, max_examples=80, database=None, derandomize=True)
BOUNDS = {torch.float32: 5e-6, torch.float64: 1e-13}


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("num_samples", [1, 7, 64, 1000])
def test_constant_density_has_the_opacity_of_the_slab(dtype, num_samples):
    for tau in (1e-10, 1e-3, 0.7, 5.0, 300.0):
        deltas = torch.full((num_samples,), 2.0 / num_samples, dtype=dtype)
        weights, final = weights_from_densities(torch.full_like(deltas, tau / 2.0), deltas)
        eps = torch.finfo(dtype).eps
        exact = float(-mpmath.expm1(-mpmath.mpf(tau)))
        assert abs(weights.double().sum().item() - exact) <= (16 + num_samples) * eps * exact
        assert abs(final.item() - float(mpmath.exp(-tau))) <= (16 + num_samples) * eps


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_alpha_keeps_its_digits_at_every_product(dtype):
    """Relative error within 3 roundings from 1e-35 to infinity; the paper's misprint is something else."""
    products = torch.logspace(-35, 38, 300, dtype=torch.float64).to(dtype)
    alphas = alphas_from_densities(products, torch.ones_like(products))
    exact = torch.tensor(
        [float(-mpmath.expm1(-mpmath.mpf(p))) for p in products.tolist()], dtype=torch.float64
    )
    assert ((alphas.double() - exact).abs() / exact).max() <= 3 * torch.finfo(dtype).eps
    assert alphas_from_densities(torch.tensor([1e30]), torch.tensor([1e30])).item() == 1.0
    assert (
        alphas_from_densities(torch.tensor([2.0]), torch.tensor([1.0])) - torch.tensor(-2.0).exp()
    ).abs() > 0.7


def test_splitting_an_interval_changes_nothing():
    densities = torch.tensor([3.0, 1.0, 7.0], dtype=torch.float64)
    deltas = torch.tensor([0.2, 0.5, 0.1], dtype=torch.float64)
    weights, final = weights_from_densities(densities, deltas)
    split, split_final = weights_from_densities(
        densities.repeat_interleave(4), deltas.repeat_interleave(4) / 4
    )
    torch.testing.assert_close(split.view(3, 4).sum(-1), weights)
    torch.testing.assert_close(split_final, final)


def test_an_opaque_sample_hides_the_rest():
    densities = torch.tensor([0.5, 1e30, 4.0], requires_grad=True)
    weights, final = weights_from_densities(densities, torch.ones(3))
    assert weights[2] == 0 and final == 0
    weights.sum().backward()
    assert densities.grad.isfinite().all()
    transmittance = transmittance_from_densities(densities.detach(), torch.ones(3))
    torch.testing.assert_close(transmittance, torch.tensor([1.0, 0.60653066, 0.0]))


def test_empty_ray_shows_the_background_and_far():
    weights, final = weights_from_densities(torch.zeros(2, 5), torch.ones(2, 5))
    background = torch.tensor([0.1, 0.5, 1.0])
    torch.testing.assert_close(composite(weights, torch.rand(2, 5, 3), background), background.expand(2, 3))
    assert final.eq(1).all()
    t_vals = torch.linspace(0, 1, 5).expand(2, 5)
    assert expected_depth(weights, t_vals, torch.tensor(3.0)).eq(3.0).all()
    assert depth_over_background(weights, t_vals, torch.tensor([3.0, 4.0])).tolist() == [3.0, 4.0]


def test_composite_by_hand():
    weights = torch.tensor([0.5, 0.25])
    values = torch.tensor([[1.0, 0.0], [0.0, 1.0]])
    torch.testing.assert_close(
        composite(weights, values, torch.tensor([1.0, 1.0])), torch.tensor([0.75, 0.5])
    )
    torch.testing.assert_close(
        expected_depth(weights, torch.tensor([2.0, 5.0]), torch.tensor(9.0)), torch.tensor(3.0)
    )
    depth = depth_over_background(weights, torch.tensor([2.0, 5.0]), torch.tensor(9.0))
    torch.testing.assert_close(depth, torch.tensor(0.5 * 2 + 0.25 * 5 + 0.25 * 9))


@pytest.mark.parametrize(
    "function", [alphas_from_densities, transmittance_from_densities, weights_from_densities]
)
def test_shapes_must_agree(function):
    with pytest.raises(ShapeError, match="densities and deltas"):
        function(torch.zeros(3), torch.zeros(4))


@pytest.mark.parametrize("dtype", [torch.bfloat16, torch.float16])
def test_half_precision_is_computed_in_float32(dtype):
    """In bfloat16 a product of 1e-4 would vanish."""
    densities = torch.full((1, 8), 1e-4, dtype=dtype)
    weights, _ = weights_from_densities(densities, torch.ones_like(densities))
    assert weights.dtype == torch.float32
    torch.testing.assert_close(weights, densities.float(), rtol=2e-3, atol=0)
    assert (
        composite(weights.to(dtype), torch.ones(1, 8, 3, dtype=dtype), torch.ones(3)).dtype == torch.float32
    )


@SETTINGS
@given(
    shape=st.lists(st.integers(1, 3), max_size=2),
    num_samples=st.integers(1, 200),
    low=st.floats(-30, 30),
    span=st.floats(0, 60),
    seed=st.integers(0, 9999),
    double=st.booleans(),
)
def test_weights_partition_the_light(*, shape, num_samples, low, span, seed, double):
    """Any products in [0, inf): sum to one, in range, non-increasing transmittance, finite gradients."""
    dtype = torch.float64 if double else torch.float32
    generator = torch.Generator().manual_seed(seed)
    exponents = low + span * torch.rand((*shape, num_samples), generator=generator, dtype=dtype)
    densities = (10.0 ** exponents.clamp_max(30.0)).requires_grad_()
    deltas = torch.rand((*shape, num_samples), generator=generator, dtype=dtype).requires_grad_()
    weights, final = weights_from_densities(densities, deltas)
    transmittance = transmittance_from_densities(densities, deltas)
    assert weights.shape == densities.shape and final.shape == tuple(shape)
    assert (weights.sum(-1) + final - 1).abs().max() <= BOUNDS[dtype]
    assert (
        weights.ge(0).all() and transmittance.diff(dim=-1).le(0).all() and transmittance[..., 0].eq(1).all()
    )
    alphas = alphas_from_densities(densities, deltas)
    torch.testing.assert_close(weights, transmittance * alphas)
    t_vals = deltas.cumsum(-1)
    depth = expected_depth(weights, t_vals, t_vals[..., -1]) + depth_over_background(
        weights, t_vals, t_vals[..., -1]
    )
    color = composite(weights, torch.rand((*shape, num_samples, 3), dtype=dtype), torch.ones(3, dtype=dtype))
    assert color.min() >= -BOUNDS[dtype] and color.max() <= 1 + BOUNDS[dtype]
    (depth.sum() + color.sum() + final.sum()).backward()
    assert densities.grad.isfinite().all() and deltas.grad.isfinite().all()


def test_gradcheck():
    generator = torch.Generator().manual_seed(1)
    densities = (5 * torch.rand(2, 4, generator=generator, dtype=torch.float64)).requires_grad_()
    deltas = torch.rand(2, 4, generator=generator, dtype=torch.float64).requires_grad_()
    values = torch.rand(2, 4, 3, generator=generator, dtype=torch.float64, requires_grad=True)
    background = torch.rand(3, generator=generator, dtype=torch.float64, requires_grad=True)
    t_vals = torch.rand(2, 4, generator=generator, dtype=torch.float64, requires_grad=True)
    far = torch.full((2,), 2.0, dtype=torch.float64, requires_grad=True)
    for function in (alphas_from_densities, transmittance_from_densities, weights_from_densities):
        assert torch.autograd.gradcheck(function, (densities, deltas))
    assert torch.autograd.gradcheck(optical_depths_before, (densities,))
    assert torch.autograd.gradcheck(weights_from_optical_depths, (densities,))
    weights = (torch.rand(2, 4, generator=generator, dtype=torch.float64) / 4).requires_grad_()
    assert torch.autograd.gradcheck(composite, (weights, values, background))
    assert torch.autograd.gradcheck(expected_depth, (weights, t_vals, far))
    assert torch.autograd.gradcheck(depth_over_background, (weights, t_vals, far))


def test_gradient_of_alpha_lives_until_the_exponential_underflows():
    """expm1's own derivative is 0 from a product of 17 on in float32."""
    products = torch.logspace(-20, 1.93, 60, dtype=torch.float64).float().requires_grad_()
    absorbed_share(products).sum().backward()
    exact = torch.exp(-products.detach().double())
    assert ((products.grad.double() - exact).abs() / exact).max() < 1e-5
