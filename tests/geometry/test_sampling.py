"""Samples along rays: stratified, merged, and drawn from histograms."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from charnerf.errors import ShapeError
from charnerf.geometry.sampling import (
    draw_bins,
    edges_from_t_vals,
    importance_t_vals,
    merge_t_vals,
    stratified_numbers,
    stratified_t_vals,
    usable_weights,
)

SETTINGS = settings(deadline=None, max_examples=80, database=None, derandomize=True)


def seeded(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def test_stratified_midpoints():
    t_vals = stratified_t_vals(torch.tensor(2.0), torch.tensor(4.0), 4)
    torch.testing.assert_close(t_vals, torch.tensor([2.25, 2.75, 3.25, 3.75]))


def test_stratified_draws_one_in_each_bin_evenly():
    near, far = torch.full((4000,), 1.0), torch.full((4000,), 3.0)
    t_vals = stratified_t_vals(near, far, 8, seeded())
    bins = ((t_vals - 1.0) / 0.25).floor().long()
    assert bins.eq(torch.arange(8)).all()
    within = (t_vals - 1.0) / 0.25 - torch.arange(8)
    torch.testing.assert_close(within.mean(0), torch.full((8,), 0.5), rtol=0, atol=4 * 0.29 / 4000**0.5)


def test_stratified_without_length_stays_put():
    t_vals = stratified_t_vals(torch.tensor([2.0]), torch.tensor([2.0]), 5, seeded())
    assert t_vals.eq(2.0).all()


@SETTINGS
@given(
    shape=st.lists(st.integers(1, 3), max_size=2),
    num_samples=st.integers(1, 65),
    start=st.floats(-6, 6),
    length=st.floats(-30, 30),
    jitter=st.booleans(),
    double=st.booleans(),
)
def test_stratified_for_any_shape_and_magnitude(*, shape, num_samples, start, length, jitter, double):
    dtype = torch.float64 if double else torch.float32
    near = torch.full(shape, 10.0**start, dtype=dtype, requires_grad=True)
    far = (near.detach() + 10.0**length).requires_grad_()
    t_vals = stratified_t_vals(near, far, num_samples, seeded() if jitter else None)
    assert t_vals.shape == (*shape, num_samples) and t_vals.dtype == dtype
    assert t_vals.diff(dim=-1).ge(0).all()
    assert t_vals.ge(near[..., None]).all() and t_vals.le(far[..., None]).all()
    t_vals.sum().backward()
    assert near.grad.isfinite().all() and far.grad.isfinite().all()


def test_stratified_gradcheck():
    near = torch.tensor([0.5, 1.0], dtype=torch.float64, requires_grad=True)
    far = torch.tensor([1.5, 1.25], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda a, b: stratified_t_vals(a, b, 3), (near, far))


@pytest.mark.parametrize("function", [stratified_t_vals, importance_t_vals])
def test_no_samples_is_refused(function):
    with pytest.raises(ValueError, match="num_samples"):
        function(torch.zeros(2), torch.ones(1), 0)


def test_edges_are_midpoints_within_near_and_far():
    edges = edges_from_t_vals(torch.tensor([[1.0, 2.0, 4.0]]), torch.tensor([0.5]), torch.tensor(5.0))
    torch.testing.assert_close(edges, torch.tensor([[0.5, 1.5, 3.0, 5.0]]))
    t_vals = torch.tensor([[1.0, 2.0, 4.0]], dtype=torch.float64, requires_grad=True)
    near = torch.zeros(1, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda t, n: edges_from_t_vals(t, n, n + 9.0), (t_vals, near))


@SETTINGS
@given(
    first=st.integers(1, 9), second=st.integers(1, 9), exponent=st.floats(-30, 30), seed=st.integers(0, 999)
)
def test_merge_sorts_and_keeps_every_sample(first, second, exponent, seed):
    a = torch.rand(3, first, generator=seeded(seed), dtype=torch.float64) * 10.0**exponent
    b = torch.rand(3, second, generator=seeded(seed + 1), dtype=torch.float64) * 10.0**exponent
    merged = merge_t_vals(a, b)
    assert merged.diff(dim=-1).ge(0).all()
    assert merged.shape == (3, first + second)
    torch.testing.assert_close(merged.sum(-1), a.sum(-1) + b.sum(-1))


def test_merge_gradcheck():
    a = torch.tensor([0.1, 0.5], dtype=torch.float64, requires_grad=True)
    b = torch.tensor([0.3, 0.9], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(merge_t_vals, (a, b))


def test_importance_follows_the_histogram():
    """Chi-squared over independent rays: 6 bins, 99.99 % quantile of 5 degrees of freedom is 25.7."""
    weights = torch.tensor([0.1, 0.0, 0.4, 0.05, 0.3, 0.15])
    edges = torch.tensor([0.0, 0.1, 0.5, 0.6, 1.0, 1.5, 2.0])
    rays = 20000
    t_vals = importance_t_vals(edges.expand(rays, 7), weights.expand(rays, 6), 1, seeded())
    counts = torch.histogram(t_vals.flatten(), bins=edges)[0]
    expected = weights * rays
    assert counts[1] == 0
    seen = expected > 0
    assert ((counts - expected).square()[seen] / expected[seen]).sum() < 25.7


def test_importance_without_generator_takes_equal_masses():
    t_vals = importance_t_vals(torch.tensor([0.0, 1.0, 2.0]), torch.tensor([1.0, 3.0]), 4)
    torch.testing.assert_close(t_vals, torch.tensor([0.5, 1.0 + 0.5 / 3, 1.5, 1.0 + 2.5 / 3]))


def test_one_bin_with_all_the_weight_gets_all_the_samples():
    weights = torch.zeros(3, 64)
    weights[0, 0], weights[1, 31], weights[2, 63] = 1e-38, 1.0, 1e38
    edges = torch.linspace(0.0, 1.0, 65).expand(3, 65)
    t_vals = importance_t_vals(edges, weights, 1000, seeded())
    for ray, chosen in enumerate((0, 31, 63)):
        assert t_vals[ray].ge(edges[0, chosen]).all() and t_vals[ray].le(edges[0, chosen + 1]).all()


@pytest.mark.parametrize("bad", [0.0, float("nan"), float("inf"), -1.0])
def test_rays_without_usable_weights_are_uniform_and_others_untouched(bad):
    edges = torch.tensor([0.0, 0.1, 1.0, 2.0]).expand(2, 4)
    weights = torch.tensor([[bad] * 3, [0.0, 1.0, 0.0]])
    t_vals = importance_t_vals(edges, weights, 4)
    torch.testing.assert_close(t_vals[0], torch.tensor([0.25, 0.75, 1.25, 1.75]))
    assert t_vals[1].ge(0.1).all() and t_vals[1].le(1.0).all()
    one_bad = torch.tensor([[1.0, float("nan"), 0.0], [0.0, 1.0, 0.0]])
    torch.testing.assert_close(
        importance_t_vals(edges, one_bad, 4)[0], torch.tensor([0.25, 0.75, 1.25, 1.75])
    )


def test_edges_without_any_width():
    t_vals = importance_t_vals(torch.full((1, 4), 2.0), torch.zeros(1, 3), 5, seeded())
    assert t_vals.eq(2.0).all()
    t_vals = importance_t_vals(torch.tensor([0.0, 1.0, 1.0, 2.0]), torch.tensor([0.0, 1.0, 0.0]), 5)
    assert t_vals.eq(1.0).all()


def test_importance_checks_shapes():
    with pytest.raises(ShapeError, match="t_edges"):
        importance_t_vals(torch.zeros(2, 3), torch.zeros(2, 3), 4)
    with pytest.raises(ShapeError, match="leading"):
        importance_t_vals(torch.zeros(3, 4), torch.zeros(2, 3), 4)


@SETTINGS
@given(
    shape=st.lists(st.integers(1, 3), max_size=2),
    bins=st.integers(1, 33),
    num_samples=st.integers(1, 33),
    spread=st.floats(0, 38),
    sparse=st.floats(0, 1),
    seed=st.integers(0, 9999),
    jitter=st.booleans(),
    double=st.booleans(),
)
def test_draws_lie_in_bins_with_weight(*, shape, bins, num_samples, spread, sparse, seed, jitter, double):
    """For any dynamic range, with empty and zero-width bins among them."""
    dtype = torch.float64 if double else torch.float32
    generator = seeded(seed)
    weights = 10.0 ** (-spread * torch.rand((*shape, bins), generator=generator, dtype=dtype))
    weights = weights * (torch.rand((*shape, bins), generator=generator) >= sparse)
    widths = torch.rand((*shape, bins), generator=generator, dtype=dtype).sub(0.2).clamp_min(0)
    edges = torch.cat((torch.zeros((*shape, 1), dtype=dtype), widths.cumsum(-1)), dim=-1)
    t_vals = importance_t_vals(edges, weights, num_samples, generator if jitter else None)
    assert t_vals.shape == (*shape, num_samples) and t_vals.dtype == dtype and t_vals.isfinite().all()
    assert t_vals.diff(dim=-1).ge(0).all()
    lower, upper = edges[..., None, :-1], edges[..., None, 1:]
    inside = (t_vals[..., None] >= lower) & (t_vals[..., None] <= upper)
    has_weight = (weights > 0) | (weights == 0).all(-1, keepdim=True)
    assert (inside & has_weight[..., None, :]).any(-1).all()


def test_helpers():
    torch.testing.assert_close(
        stratified_numbers(torch.zeros(1), (2, 2), None), torch.tensor([[0.25, 0.75]] * 2)
    )
    torch.testing.assert_close(
        usable_weights(torch.tensor([1e38, 2e38]), torch.ones(2)), torch.tensor([0.5, 1.0])
    )
    bins, share = draw_bins(torch.tensor([0.0, 1.0, 0.0, 1.0, 0.0]), 4, None)
    assert bins.tolist() == [1, 1, 3, 3] and share.tolist() == [0.25, 0.75, 0.25, 0.75]
