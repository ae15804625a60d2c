"""Normalisation over the whole range of lengths."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from charnerf.errors import ShapeError
from charnerf.geometry.safe import full_precision, safe_normalize

DTYPES = (torch.float32, torch.float64)
SETTINGS = settings(deadline=None, max_examples=60, database=None, derandomize=True)


@pytest.mark.parametrize("exponent", range(-44, 39))
def test_every_length_of_float32_becomes_one(exponent):
    """From denormals to the largest float: unit length, right direction, finite gradient."""
    vector = (torch.tensor([3.0, -4.0, 12.0], dtype=torch.float64) * 10.0**exponent / 13.0).float()
    if vector.abs().max() == 0:
        pytest.skip("below the smallest denormal")
    vector.requires_grad_()
    unit = safe_normalize(vector)
    unit.sum().backward()
    exact = vector.detach().double() / vector.detach().double().norm()
    torch.testing.assert_close(unit.double(), exact, rtol=0, atol=2e-7)
    assert vector.grad.isfinite().all()


@pytest.mark.parametrize("length", [1e-30, 1e-8, 1.0, 1e8, 1e18])
def test_gradient_is_that_of_the_quotient(length):
    """The gradient equals (I - u u^T) / length to float32 rounding."""
    vector = torch.tensor([0.6, -0.3, 0.2]) * length
    jacobian = torch.autograd.functional.jacobian(safe_normalize, vector).double()
    exact = vector.double()
    unit = exact / exact.norm()
    expected = (torch.eye(3, dtype=torch.float64) - torch.outer(unit, unit)) / exact.norm()
    torch.testing.assert_close(jacobian * length, expected * length, rtol=0, atol=1e-6)


@pytest.mark.parametrize("dtype", DTYPES)
def test_zero_stays_zero_with_zero_gradient(dtype):
    vectors = torch.tensor([[0.0, 0.0, 0.0], [0.0, 3.0, 4.0]], dtype=dtype, requires_grad=True)
    unit = safe_normalize(vectors)
    unit.sum().backward()
    torch.testing.assert_close(unit, torch.tensor([[0.0, 0.0, 0.0], [0.0, 0.6, 0.8]], dtype=dtype))
    assert vectors.grad[0].eq(0).all() and vectors.grad.isfinite().all()


def test_half_precision_is_widened():
    assert safe_normalize(torch.tensor([300.0, 400.0], dtype=torch.float16)).dtype == torch.float32
    assert full_precision(torch.ones(1, dtype=torch.bfloat16)).dtype == torch.float32
    assert full_precision(torch.ones(1, dtype=torch.float64)).dtype == torch.float64


def test_scalar_is_refused():
    with pytest.raises(ShapeError, match="vectors"):
        safe_normalize(torch.tensor(1.0))


@SETTINGS
@given(
    shape=st.lists(st.integers(1, 4), max_size=2),
    size=st.integers(1, 5),
    exponent=st.floats(-30, 18),
    seed=st.integers(0, 2**31),
    double=st.booleans(),
)
def test_any_shape_and_magnitude(shape, size, exponent, seed, double):
    generator = torch.Generator().manual_seed(seed)
    dtype = torch.float64 if double else torch.float32
    vectors = torch.randn((*shape, size), generator=generator, dtype=dtype) * 10.0**exponent
    vectors.requires_grad_()
    unit = safe_normalize(vectors)
    unit.sum().backward()
    assert unit.shape == vectors.shape and unit.dtype == dtype and vectors.grad.isfinite().all()
    torch.testing.assert_close(unit.norm(dim=-1), torch.ones(tuple(shape), dtype=dtype), rtol=0, atol=4e-7)


def test_gradcheck():
    generator = torch.Generator().manual_seed(0)
    vectors = torch.randn(5, 3, generator=generator, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(safe_normalize, vectors)
