import numpy as np
import pytest

from charnerf.surfaces.color import linear_from_bytes, linear_from_srgb, srgb_from_linear


def test_half_the_light_is_188():
    assert round(255 * float(srgb_from_linear(np.array(0.5)))) == 188


def test_both_ways_are_the_identity():
    values = np.linspace(0.0, 1.0, 1001)
    np.testing.assert_allclose(linear_from_srgb(srgb_from_linear(values)), values, atol=1e-12)
    back = np.rint(255 * srgb_from_linear(linear_from_bytes(np.arange(256, dtype=np.uint8)).astype(float)))
    np.testing.assert_array_equal(back, np.arange(256))


def test_values_outside_are_clipped():
    assert srgb_from_linear(np.array([-1.0, 2.0])).tolist() == pytest.approx([0.0, 1.0])
