"""Rays against boxes by brute force, and the arc length along occupied steps against a loop."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from charnerf.geometry.rays import OccupiedLength, box_interval, points_along
from charnerf.types import RayBundle

SETTINGS = settings(deadline=None, max_examples=60, database=None, derandomize=True)
LOW, HIGH = (-1.0, -0.5, 0.0), (0.75, 1.25, 2.0)


def corners(dtype: torch.dtype) -> tuple[torch.Tensor, torch.Tensor]:
    """The box of these tests."""
    return torch.tensor(LOW, dtype=dtype), torch.tensor(HIGH, dtype=dtype)


@SETTINGS
@given(seed=st.integers(0, 9999), double=st.booleans())
def test_box_interval_against_brute_force(seed, double):
    """Of many points along each ray it holds those inside and no other; some rays start inside."""
    dtype = torch.float64 if double else torch.float32
    generator = torch.Generator().manual_seed(seed)
    low, high = corners(dtype)
    origins = 2.0 * torch.randn(40, 3, generator=generator, dtype=dtype)
    directions = torch.randn(40, 3, generator=generator, dtype=dtype)
    directions[:15] *= torch.randint(0, 2, (15, 3), generator=generator)  # parallel to one or two axes
    directions[directions.norm(dim=-1) == 0] = torch.tensor((0.0, 1.0, 0.0), dtype=dtype)
    rays = RayBundle(origins, directions / directions.norm(dim=-1, keepdim=True))
    near, far = box_interval(rays, low, high)
    assert near.isfinite().all() and far.isfinite().all() and (near >= 0).all() and (far >= near).all()
    t_vals = torch.linspace(0.0, 12.0, 2001, dtype=dtype).expand(40, -1)
    points = points_along(rays, t_vals)
    slack = 1e-5
    surely_in = ((points > low + slack) & (points < high - slack)).all(-1)
    surely_out = ((points < low - slack) | (points > high + slack)).any(-1)
    inside = (t_vals >= near[:, None]) & (t_vals <= far[:, None]) & (far > near)[:, None]
    assert not (surely_in & ~inside).any()
    assert not (surely_out & inside).any()


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_box_interval_by_hand(dtype):
    low, high = corners(dtype)
    cases = [
        ((-3.0, 0.0, 1.0), (1.0, 0.0, 0.0), 2.0, 3.75),  # parallel to two axes, between their faces
        ((-3.0, 2.0, 1.0), (1.0, 0.0, 0.0), 0.0, 0.0),  # parallel, outside
        ((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 0.0, 1.0),  # starts inside
        ((0.0, 0.0, 3.0), (0.0, 0.0, 1.0), 0.0, 0.0),  # the box is behind
        ((-3.0, -0.5, 1.0), (1.0, 0.0, 0.0), 2.0, 3.75),  # along a face
        ((-3.0, 0.0, 1.0), (1.0, -0.0, 0.0), 2.0, 3.75),  # minus zero
        ((-3.0, 0.0, 1.0), (1.0, 1e-42, 0.0), 2.0, 3.75),  # a slope without a finite inverse in float32
    ]
    origins, directions, near, far = (
        torch.tensor(column, dtype=dtype) for column in zip(*cases, strict=True)
    )
    found = box_interval(RayBundle(origins, directions), low, high)
    torch.testing.assert_close(found[0], near)
    torch.testing.assert_close(found[1], far)


def test_box_interval_has_a_finite_gradient():
    low, high = corners(torch.float64)
    origins = torch.tensor(((-3.0, 0.1, 1.0), (-3.0, 2.0, 1.0), (0.0, 0.0, 1.0)), dtype=torch.float64)
    directions = torch.tensor(((1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.6, 0.8)), dtype=torch.float64)
    origins.requires_grad_()
    directions.requires_grad_()
    near, far = box_interval(RayBundle(origins, directions), low, high)
    gradients = torch.autograd.grad(near.sum() + far.sum(), (origins, directions))
    assert all(gradient.isfinite().all() for gradient in gradients)
    check = lambda o, d: box_interval(RayBundle(o, d), low, high)  # noqa: E731
    assert torch.autograd.gradcheck(check, (origins[2:], directions[2:]))


def by_loop(t_edges: list[float], occupied: list[bool], s: float) -> float:
    """Walk along the occupied steps until their length is s."""
    walked, last = 0.0, None
    for start, end, counts in zip(t_edges, t_edges[1:], occupied, strict=False):
        if not counts:
            continue
        if walked + (end - start) > s:
            return start + (s - walked)
        walked += end - start
        last = end
    return t_edges[0] if last is None else last


@SETTINGS
@given(
    seed=st.integers(0, 9999),
    occupied=st.lists(st.booleans(), min_size=1, max_size=12),
    share=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=6),
)
def test_occupied_to_t_against_a_loop(seed, occupied, share):
    generator = torch.Generator().manual_seed(seed)
    lengths = torch.rand(len(occupied), generator=generator, dtype=torch.float64) + 0.01
    t_edges = torch.cat((torch.tensor([1.5]), 1.5 + lengths.cumsum(0)))
    flags = torch.tensor(occupied)
    total = float((lengths * flags).sum())
    s_vals = torch.tensor(sorted(share), dtype=torch.float64) * total
    found = OccupiedLength.of(t_edges[None], flags[None]).t_vals(s_vals[None])[0]
    for s, t in zip(s_vals.tolist(), found.tolist(), strict=True):
        expected = by_loop(t_edges.tolist(), occupied, s)
        if abs(t - expected) > 1e-9:  # on an edge, the end of one step and the start of the next are one s
            assert any(abs(t - edge) < 1e-9 for edge in t_edges.tolist())
            assert by_loop(t_edges.tolist(), occupied, s - 1e-9) == pytest.approx(t, abs=1e-8) or by_loop(
                t_edges.tolist(), occupied, s + 1e-9
            ) == pytest.approx(t, abs=1e-8)
    assert (found.diff() >= -1e-12).all()
    inside = ((found[:, None] >= t_edges[:-1] - 1e-9) & (found[:, None] <= t_edges[1:] + 1e-9) & flags).any(
        -1
    )
    assert inside.all() or not any(occupied)


def test_occupied_to_t_by_hand():
    t_edges = torch.tensor((((2.0, 3.0, 4.0, 5.0)),) * 2)
    occupied = torch.tensor(((True, False, True), (False, False, False)))
    s_vals = torch.tensor(((0.25, 1.5, 2.0), (0.0, 0.0, 0.0)))
    torch.testing.assert_close(
        OccupiedLength.of(t_edges, occupied).t_vals(s_vals), torch.tensor(((2.25, 4.5, 5.0), (2.0, 2.0, 2.0)))
    )


def test_no_rays_at_all():
    none = RayBundle(torch.zeros(0, 3), torch.zeros(0, 3))
    assert box_interval(none, *corners(torch.float32))[0].shape == (0,)
    flags = torch.zeros(0, 4, dtype=torch.bool)
    assert OccupiedLength.of(torch.zeros(0, 5), flags).t_vals(torch.zeros(0, 3)).shape == (0, 3)
