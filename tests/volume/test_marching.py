"""Samples on the occupied part of rays, and answers inside of bounds, by hand."""

import torch

from charnerf.geometry.bounds import Bounds
from charnerf.scene import FunctionField
from charnerf.types import FieldOutput, RayBundle
from charnerf.volume.marching import (
    LEAST_POINTS,
    POINTS_AT_ONCE,
    OccupiedRays,
    coarse_samples,
    densities_inside,
    finer_samples,
    in_chunks,
    points_at_once,
    points_in_memory,
)
from charnerf.volume.quadrature import PiecewiseConstant
from support.analytic_scenes import box_hull

LOW, HIGH = torch.zeros(3), torch.tensor([8.0, 1.0, 1.0])


def _bounds() -> Bounds:
    """A box 8 m long whose hull has a gap between x = 2 and x = 6."""
    occupancy = torch.ones(8, 8, 8, dtype=torch.bool)
    occupancy[2:6] = False
    return Bounds(LOW, HIGH, box_hull(occupancy, LOW, HIGH))


def _rays() -> RayBundle:
    """One ray along the box from 1 m before it, and one that misses it."""
    origins = torch.tensor([[-1.0, 0.5, 0.5], [-1.0, 3.0, 0.5]])
    return RayBundle(origins, torch.tensor([[1.0, 0.0, 0.0]] * 2))


def test_samples_step_over_the_gap():
    """Four bins of 1 m: two before the gap, two behind; 1 m of air before the box."""
    bounds = _bounds()
    seen = OccupiedRays.of(bounds, _rays(), 64)
    torch.testing.assert_close(seen.length, torch.tensor([4.0, 0.0]))
    samples = coarse_samples(bounds, seen, 4)
    torch.testing.assert_close(samples.t_vals[0], torch.tensor([1.5, 2.5, 7.5, 8.5]))
    torch.testing.assert_close(samples.points[0, :, 0], torch.tensor([0.5, 1.5, 6.5, 7.5]))
    torch.testing.assert_close(samples.s_edges[0], torch.arange(5.0))
    assert samples.inside.tolist() == [[True] * 4, [False] * 4]
    assert samples.view_dirs.shape == (2, 4, 3)


def test_finer_samples_are_drawn_where_the_light_goes_and_keep_the_coarse_ones():
    bounds = _bounds()
    seen = OccupiedRays.of(bounds, _rays(), 64)
    coarse = coarse_samples(bounds, seen, 4)
    densities = torch.tensor([[0.0, 0.0, 1e3, 0.0]] * 2)
    finer = finer_samples(bounds, seen, coarse, densities, quadrature=PiecewiseConstant(), num_samples=8)
    assert finer.s_vals.shape == (2, 12) and bool((finer.s_vals.diff(dim=-1) >= 0).all())
    assert bool(torch.isin(coarse.s_vals[0], finer.s_vals[0]).all())
    assert int(((finer.s_vals[0] >= 2.0) & (finer.s_vals[0] <= 3.0)).sum()) == 9
    torch.testing.assert_close(finer.s_edges[0, [0, -1]], torch.tensor([0.0, 4.0]))


def test_only_points_inside_are_asked_chunk_by_chunk():
    asked: list[torch.Tensor] = []

    def field(points: torch.Tensor, view_dirs: torch.Tensor) -> FieldOutput:
        asked.append(points)
        return FieldOutput(rgb=view_dirs, densities=points[:, 0])

    wide = FunctionField(field, bytes_per_point=2**30)
    points = torch.rand(3, 200, 3)
    inside = points[..., 1] > 0.5
    densities = densities_inside(wide, points, points, inside)
    assert max(len(one) for one in asked) == LEAST_POINTS and torch.equal(torch.cat(asked), points[inside])
    assert torch.equal(densities, torch.where(inside, points[..., 0], 0.0))
    asked.clear()
    assert densities_inside(wide, points, points, torch.zeros_like(inside)).eq(0.0).all() and asked == []
    answer = in_chunks(wide, points[0], points[1], 64)
    assert [len(one) for one in asked] == [64, 64, 64, 8] and torch.equal(answer.rgb, points[1])
    assert in_chunks(wide, points[0, :0], points[0, :0], 64).rgb.shape == (0, 3)


def test_chunks_are_bounded_by_memory_and_by_the_caches():
    light, heavy = (
        FunctionField(lambda p, d: FieldOutput(p, p[:, 0]), bytes_per_point=n) for n in (1, 2**20)
    )
    assert points_at_once(light) == POINTS_AT_ONCE and points_at_once(heavy) == LEAST_POINTS
    assert points_in_memory(heavy, 512) == 512 and points_in_memory(heavy, 1) == LEAST_POINTS
