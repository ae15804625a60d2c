"""Candidates are never missed; bins never straddle a gap."""

import pytest
import torch

from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.geometry.hull import build_hull, occupied_edges
from charnerf.geometry.occupied import candidates, coarse_occupancy, segment_bins
from charnerf.types import Hull, RayBundle
from support import helpers


@pytest.mark.parametrize("seed", range(4))
def test_no_ray_that_meets_a_cell_is_missed(seed):
    generator = torch.Generator().manual_seed(seed)
    cells = torch.rand(32, 32, 32, generator=generator) < 0.0006 * (seed + 1)
    maps = torch.zeros(1, 2, 2)
    hull = Hull(
        cells, torch.tensor((-1.0, -0.3, 0.0)), torch.tensor((1.0, 0.5, 2.0)), maps, maps, torch.ones(1)
    )
    origins = 3.0 * torch.randn(2000, 3, generator=generator)
    targets = torch.rand(2000, 3, generator=generator) * torch.tensor((2.0, 0.8, 2.0)) + hull.box_min
    directions = targets - origins
    rays = RayBundle(origins, directions / directions.norm(dim=-1, keepdim=True))
    t_edges, occupied = occupied_edges(hull, rays, 1500)
    found = candidates(hull, coarse_occupancy(hull.occupancy), rays)
    meets = occupied.any(-1)
    assert 0.01 < meets.float().mean() < 0.9
    assert not meets[~torch.isin(torch.arange(2000), found.index)].any()
    middle = 0.5 * (t_edges[:, 1:] + t_edges[:, :-1])[found.index]
    outside = (middle < found.near[:, None] - 1e-5) | (middle > found.far[:, None] + 1e-5)
    assert not (occupied[found.index] & outside).any()


def test_pooling_keeps_every_occupied_cell(person_views):
    hull = build_hull(
        person_views, box_min=torch.tensor((-1.8, -1.8, -0.8)), box_max=torch.tensor((1.8, 1.8, 2.8))
    )[0]
    coarse = coarse_occupancy(hull.occupancy)
    fine = coarse.repeat_interleave(4, 0).repeat_interleave(4, 1).repeat_interleave(4, 2)
    assert not (hull.occupancy & ~fine).any()
    assert coarse.float().mean() < 0.9
    rays = pixel_rays(helpers.target_cameras(3, size=16)[1], pixel_centres(16, 16).reshape(-1, 2))
    assert 0 < len(candidates(hull, coarse, rays).index) < 256


def test_bins_do_not_straddle_gaps():
    occupied = torch.tensor(
        [[1, 1, 0, 0, 1, 0, 1, 1, 1, 1], [0, 0, 1, 1, 1, 0, 0, 0, 0, 0]], dtype=torch.bool
    )
    lengths = torch.full((2, 10), 0.1)
    edges, begins = segment_bins(occupied, lengths, 0.15, 64)
    ends = [0.2, 0.3, 0.7]  # of the segments in occupied length, first ray
    for end in ends:
        assert (edges[0] - end).abs().min() < 1e-6
    torch.testing.assert_close(edges[:, -1], torch.tensor((0.7, 0.3)))
    assert (edges.diff(dim=-1) <= 0.15 + 1e-6).all() and (edges.diff(dim=-1) >= 0).all()
    starts = edges[0, :-1][begins[0] & (edges[0].diff() > 0)]
    torch.testing.assert_close(starts, torch.tensor((0.0, 0.2, 0.3)))
    assert int(begins[1, 0]) == 1


def test_long_rays_get_no_more_bins_than_allowed():
    edges, _ = segment_bins(torch.ones(1, 4, dtype=torch.bool), torch.ones(1, 4), 0.01, 32)
    assert edges.shape == (1, 33)
    torch.testing.assert_close(edges[0], torch.linspace(0, 4, 33))
