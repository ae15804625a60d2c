"""Samples around the expected depth."""

import pytest
import torch

from charnerf.errors import ConfigError
from charnerf.volume.quadrature.constant import PiecewiseConstant
from charnerf.volume.quadrature.guided import DepthGuided

EDGES = torch.linspace(0.0, 2.0, 41, dtype=torch.float64).expand(3, -1)
T_VALS = 0.5 * (EDGES[:, 1:] + EDGES[:, :-1])


def densities() -> torch.Tensor:
    """A wall at 1.5 m, a wall at the very end, nothing."""
    found = torch.zeros(3, 40, dtype=torch.float64)
    found[0, 30] = found[1, 39] = 1e4
    return found


def test_weights_are_the_piecewise_constant_ones():
    guided = DepthGuided(share=0.5, deviation=0.01)
    for one, other in zip(
        guided.weights(densities(), T_VALS, EDGES),
        PiecewiseConstant().weights(densities(), T_VALS, EDGES),
        strict=True,
    ):
        assert torch.equal(one, other)


@pytest.mark.parametrize("generator", [None, torch.Generator().manual_seed(0)])
def test_half_of_the_samples_are_normal_around_the_depth(generator):
    alone = DepthGuided(share=1.0, deviation=0.01)
    drawn = alone.importance_t_vals(densities(), T_VALS, EDGES, 2000, generator)
    assert drawn.shape == (3, 2000) and (drawn.diff(dim=-1) >= 0).all()
    assert abs(float(drawn[0].mean()) - 1.525) < 5e-4 and abs(float(drawn[0].std()) - 0.01) < 3e-4
    assert (drawn >= 0).all() and (drawn <= 2).all()
    assert abs(float(drawn[2].mean()) - 1.0) < 1e-3  # of a ray that sees nothing: the middle
    half = DepthGuided(share=0.5, deviation=0.01).importance_t_vals(densities(), T_VALS, EDGES, 16, None)
    expected = torch.cat(
        (
            alone.importance_t_vals(densities(), T_VALS, EDGES, 8, None),
            PiecewiseConstant().importance_t_vals(densities(), T_VALS, EDGES, 8, None),
        ),
        dim=-1,
    )
    torch.testing.assert_close(half, expected.sort(dim=-1).values)
    none = DepthGuided(share=0.0, deviation=0.01).importance_t_vals(densities(), T_VALS, EDGES, 8, None)
    assert torch.equal(none, PiecewiseConstant().importance_t_vals(densities(), T_VALS, EDGES, 8, None))


@pytest.mark.parametrize(("share", "deviation"), [(1.5, 0.01), (0.5, 0.0)])
def test_what_can_not_be(share, deviation):
    with pytest.raises(ConfigError, match="expected a share in"):
        DepthGuided(share=share, deviation=deviation)
