"""Cameras and rays by their properties: any pose, any magnitude of the world, both dtypes."""

import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from charnerf.geometry.cameras import (
    angles_from_direction,
    cameras_towards,
    direction_from_angles,
    directions_to_points,
    fibonacci_hemisphere,
    look_at,
    mirror_cameras,
    pixel_centres,
    pixel_rays,
    project,
    project_into_all,
    to_camera_frame,
)
from charnerf.geometry.hull import hull_contains, occupied_edges
from charnerf.geometry.rays import OccupiedLength, box_interval, points_along
from charnerf.types import Cameras, Hull, RayBundle

SETTINGS = settings(deadline=None, max_examples=40, database=None, derandomize=True)
WORLD = {
    "seed": st.integers(0, 9999),
    "exponent": st.floats(-3, 3),
    "offset": st.sampled_from([0.0, 1.0, 100.0]),
    "orthographic": st.booleans(),
    "double": st.booleans(),
}


def world(
    *, seed: int, exponent: float, offset: float, orthographic: bool, double: bool
) -> tuple[Cameras, torch.Generator, float, float]:
    """Four cameras around a point `offset` sizes away, in a world of size 10**exponent; and its rounding."""
    generator = torch.Generator().manual_seed(seed)
    size = 10.0**exponent
    towards = torch.randn(4, 3, generator=generator, dtype=torch.float64)
    towards = towards / towards.norm(dim=-1, keepdim=True)
    target = offset * size * torch.tensor([1.0, -0.5, 0.25], dtype=torch.float64)
    cameras = cameras_towards(
        towards,
        target=target,
        distance=4.0 * size,
        half_extent=1.2 * size,
        size=64,
        orthographic=orthographic,
    )
    dtype = torch.float64 if double else torch.float32
    return cameras.to(dtype), generator, size, torch.finfo(dtype).eps * (1.0 + offset)


@SETTINGS
@given(**WORLD)
def test_pixels_come_back(**settings_of_world):
    cameras, generator, size, rounding = world(**settings_of_world)
    dtype = cameras.focal.dtype
    pixels = 64 * torch.rand(5, 4, 2, generator=generator, dtype=dtype)
    distances = size * (2.0 + 4.0 * torch.rand(5, 4, generator=generator, dtype=dtype))
    rays = pixel_rays(cameras, pixels)
    torch.testing.assert_close(rays.directions.norm(dim=-1), torch.ones(5, 4, dtype=dtype), rtol=0, atol=1e-6)
    points = points_along(rays, distances[..., None])[..., 0, :]
    back, depth, in_front = project(cameras, points)
    assert in_front.all() and depth.gt(0).all()
    torch.testing.assert_close(back, pixels, rtol=0, atol=64 * 40 * rounding)


@SETTINGS
@given(**WORLD)
def test_all_ways_of_projecting_agree(**settings_of_world):
    cameras, generator, size, rounding = world(**settings_of_world)
    dtype = cameras.focal.dtype
    centre = (cameras.world_from_camera[..., :3, 3] - 4 * size * cameras.world_from_camera[..., :3, 2])[0]
    points = centre + 1.2 * size * (2 * torch.rand(6, 3, generator=generator, dtype=dtype) - 1)
    one, depth, in_front = project(cameras, points[:, None])
    every, depths, fronts = project_into_all(cameras, points)
    torch.testing.assert_close(every, one, rtol=0, atol=64 * 80 * rounding)
    torch.testing.assert_close(depths, depth, rtol=0, atol=80 * rounding * size)
    assert fronts.equal(in_front)
    directions = directions_to_points(cameras, points)
    torch.testing.assert_close(directions.norm(dim=-1), torch.ones_like(depth), rtol=0, atol=1e-6)
    local = to_camera_frame(cameras, points[:, None])
    expected = torch.ones_like(depth) if settings_of_world["orthographic"] else depth / local.norm(dim=-1)
    axis = -cameras.world_from_camera[..., :3, 2]
    torch.testing.assert_close((directions * axis).sum(-1), expected, rtol=0, atol=400 * rounding)


@SETTINGS
@given(**WORLD)
def test_mirroring_twice_changes_nothing(**settings_of_world):
    cameras, *_ = world(**settings_of_world)
    twice = mirror_cameras(mirror_cameras(cameras))
    assert twice.world_from_camera.equal(cameras.world_from_camera)
    assert twice.principal_point.equal(cameras.principal_point)


@SETTINGS
@given(azimuth=st.floats(0, 359.9), elevation=st.floats(-89, 89), distance=st.floats(1e-3, 1e3))
def test_angles_come_back_and_poses_are_rotations(azimuth, elevation, distance):
    angles = torch.tensor([azimuth, elevation], dtype=torch.float64)
    direction = direction_from_angles(*angles)
    back = torch.stack(angles_from_direction(distance * direction))
    turned = (back - angles + torch.tensor([180.0, 180.0])) % 360.0 - 180.0
    torch.testing.assert_close(turned, torch.zeros(2, dtype=torch.float64), rtol=0, atol=1e-9)
    pose = look_at(distance * direction, torch.zeros(3, dtype=torch.float64))
    rotation = pose[:3, :3]
    torch.testing.assert_close(rotation.T @ rotation, torch.eye(3, dtype=torch.float64), rtol=0, atol=1e-12)
    assert torch.linalg.det(rotation) > 0.999
    torch.testing.assert_close(rotation[:, 2], direction, rtol=0, atol=1e-12)


@SETTINGS
@given(count=st.integers(1, 500))
def test_lattice_points_are_units_above_the_ground(count):
    points = fibonacci_hemisphere(count)
    torch.testing.assert_close(points.norm(dim=-1), torch.ones(count, dtype=torch.float64))
    assert points[:, 2].ge(0).all() and pixel_centres(count, 2).shape == (2, count, 2)


@SETTINGS
@given(seed=st.integers(0, 9999), exponent=st.floats(-3, 3), flat=st.integers(0, 2), double=st.booleans())
def test_box_intervals_lie_in_the_box(seed, exponent, flat, double):
    """Also for rays with slopes of exactly zero; those that miss have no length."""
    generator = torch.Generator().manual_seed(seed)
    dtype = torch.float64 if double else torch.float32
    size = 10.0**exponent
    origins = size * 3 * torch.randn(40, 3, generator=generator, dtype=dtype)
    directions = size * torch.randn(40, 3, generator=generator, dtype=dtype) - origins
    directions[:10, :flat] = 0.0
    directions = directions / directions.norm(dim=-1, keepdim=True)
    low = torch.full((3,), -size, dtype=dtype)
    near, far = box_interval(RayBundle(origins, directions), low, -low)
    assert near.ge(0).all() and far.ge(near).all() and near.isfinite().all() and far.isfinite().all()
    hit = far > near
    for t in (near, 0.5 * (near + far), far):
        points = points_along(RayBundle(origins, directions), t[:, None])[:, 0]
        assert points[hit].abs().le(size * (1 + 200 * torch.finfo(dtype).eps)).all()


@SETTINGS
@given(seed=st.integers(0, 9999), steps=st.integers(1, 30), share=st.floats(0, 1), double=st.booleans())
def test_occupied_length_maps_into_occupied_steps(seed, steps, share, double):
    """Ascending, and inside steps that count, for any pattern of them."""
    generator = torch.Generator().manual_seed(seed)
    dtype = torch.float64 if double else torch.float32
    widths = torch.rand(8, steps, generator=generator, dtype=dtype)
    t_edges = torch.cat((torch.zeros(8, 1, dtype=dtype), widths.cumsum(-1)), dim=-1) + 2.0
    occupied = torch.rand(8, steps, generator=generator) < share
    total = (torch.diff(t_edges, dim=-1) * occupied).sum(-1, keepdim=True)
    s_vals = total * ((torch.arange(9, dtype=dtype) + 0.5) / 9)
    t_vals = OccupiedLength.of(t_edges, occupied).t_vals(s_vals)
    assert t_vals.diff(dim=-1).ge(-1e-5).all() and t_vals.isfinite().all()
    slack = 1e-4
    inside = (t_vals[..., None] >= t_edges[:, None, :-1] - slack) & (
        t_vals[..., None] <= t_edges[:, None, 1:] + slack
    )
    some = occupied.any(-1)
    assert (inside & occupied[:, None]).any(-1)[some].all()
    assert t_vals[~some].eq(t_edges[~some, :1]).all()


@SETTINGS
@given(seed=st.integers(0, 9999), exponent=st.floats(-3, 3), side=st.integers(1, 6))
def test_hull_answers_agree_along_rays(seed, exponent, side):
    """A step counts exactly where the hull contains its midpoint."""
    generator = torch.Generator().manual_seed(seed)
    size = 10.0**exponent
    low = torch.full((3,), -size, dtype=torch.float64)
    nothing = low.new_zeros(0)
    occupancy = torch.rand(side, side, side, generator=generator) < 0.5
    hull = Hull(occupancy, low, -low, nothing, nothing, nothing)
    origins = 3 * size * torch.randn(20, 3, generator=generator, dtype=torch.float64)
    aim = 0.5 * size * torch.randn(20, 3, generator=generator, dtype=torch.float64) - origins
    rays = RayBundle(origins, aim / aim.norm(dim=-1, keepdim=True))
    t_edges, occupied = occupied_edges(hull, rays, 17)
    middle = points_along(rays, 0.5 * (t_edges[:, 1:] + t_edges[:, :-1]))
    hit = (t_edges[:, -1] > t_edges[:, 0])[:, None]
    assert (occupied == (hull_contains(hull, middle) & hit)).double().mean() > 0.99
    assert not hull_contains(hull, 1.001 * size * torch.ones(3, dtype=torch.float64))


def test_gradcheck():
    cameras, generator, *_ = world(seed=1, exponent=0.0, offset=0.0, orthographic=False, double=True)
    points = torch.rand(2, 4, 3, generator=generator, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda p: project(cameras, p)[:2], points)
    assert torch.autograd.gradcheck(lambda p: project_into_all(cameras, p[0])[:2], points)
    assert torch.autograd.gradcheck(lambda p: directions_to_points(cameras, p[0]), points)
    pixels = (64 * torch.rand(2, 4, 2, generator=generator, dtype=torch.float64)).requires_grad_()

    def ends(value: torch.Tensor) -> torch.Tensor:
        rays = pixel_rays(cameras, value)
        return points_along(rays, torch.full((2, 4, 1), 2.0, dtype=torch.float64))

    assert torch.autograd.gradcheck(ends, pixels)
    low = torch.full((3,), -1.0, dtype=torch.float64)
    origins = torch.tensor([[0.1, 0.2, 3.0]], dtype=torch.float64, requires_grad=True)
    slope = torch.tensor([[0.05, 0.02, -1.0]], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda o, d: box_interval(RayBundle(o, d), low, -low), (origins, slope))
