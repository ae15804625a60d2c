"""Positional encoding against exact phases."""

import math

import mpmath
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from charnerf.geometry.encoding import positional_encoding

SETTINGS = settings(deadline=None, max_examples=60, database=None, derandomize=True)


def test_layout_is_sines_then_cosines_for_each_octave():
    x = torch.tensor([0.25, -0.5])
    expected = [math.sin(math.pi / 4), -1.0, math.cos(math.pi / 4), 0.0, 1.0, 0.0, 0.0, -1.0]
    torch.testing.assert_close(positional_encoding(x, 2), torch.tensor(expected), rtol=0, atol=2e-7)


@pytest.mark.parametrize(("dtype", "bound"), [(torch.float32, 4e-7), (torch.float64, 8e-16)])
def test_phase_stays_exact_at_every_octave(dtype, bound):
    """Unlike sin(2^k pi x) as written, which loses one bit an octave."""
    x = torch.tensor([0.1, 0.777, -0.999, 1e-7, 12345.678], dtype=dtype)
    encoded = positional_encoding(x, 20).unflatten(-1, (20, 2, 5))
    with mpmath.workdps(60):
        for k in range(20):
            for i, value in enumerate(x.tolist()):
                phase = mpmath.mpf(2) ** k * mpmath.mpf(value)
                assert abs(float(mpmath.sinpi(phase)) - encoded[k, 0, i].item()) <= bound
                assert abs(float(mpmath.cospi(phase)) - encoded[k, 1, i].item()) <= bound
    naive = torch.sin(2.0**19 * math.pi * x)
    assert (naive - encoded[19, 0]).abs().max() > 100 * bound


def test_half_precision_is_widened_before_the_phase():
    """In bfloat16 the phase of the sixth octave would be off by most of a turn (0.84 measured)."""
    x = torch.rand(1000, generator=torch.Generator().manual_seed(0)).bfloat16()[:, None]
    encoded = positional_encoding(x, 7)
    assert encoded.dtype == torch.float32
    torch.testing.assert_close(encoded.double(), positional_encoding(x.double(), 7), rtol=0, atol=4e-7)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        torch.testing.assert_close(positional_encoding(x.float(), 7), encoded, rtol=0, atol=0)


def test_no_octaves_and_negative_octaves():
    assert positional_encoding(torch.zeros(4, 3), 0).shape == (4, 0)
    with pytest.raises(ValueError, match="num_frequencies"):
        positional_encoding(torch.zeros(3), -1)


@SETTINGS
@given(
    shape=st.lists(st.integers(0, 3), max_size=2),
    channels=st.integers(1, 3),
    octaves=st.integers(0, 12),
    exponent=st.floats(-30, 30),
    double=st.booleans(),
)
def test_any_shape_and_magnitude(shape, channels, octaves, exponent, double):
    dtype = torch.float64 if double else torch.float32
    x = (torch.rand((*shape, channels), dtype=dtype) - 0.5) * 10.0**exponent
    x.requires_grad_()
    encoded = positional_encoding(x, octaves)
    assert encoded.shape == (*shape, 2 * channels * octaves) and encoded.dtype == dtype
    assert encoded.abs().le(1.0).all()
    encoded.sum().backward()
    assert x.grad.isfinite().all()


def test_gradcheck():
    x = torch.tensor([[0.1, -0.7, 0.33]], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda value: positional_encoding(value, 4), x)
