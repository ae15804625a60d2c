"""Cameras: projection and rays are inverse, and every convention of the frames, stated as pictures."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from charnerf.errors import ShapeError
from charnerf.geometry.cameras import (
    angles_from_direction,
    cameras_towards,
    direction_from_angles,
    directions_to_points,
    fibonacci_hemisphere,
    look_at,
    mirror_cameras,
    pixel_centres,
    pixel_planes,
    pixel_rays,
    project,
    project_into_all,
    to_camera_frame,
)
from charnerf.types import Cameras
from support import helpers

SETTINGS = settings(deadline=None, max_examples=40, database=None, derandomize=True)
CENTRE = torch.tensor((0.0, 0.0, 1.0), dtype=torch.float64)


def random_cameras(seed: int, count: int, *, orthographic: bool, dtype: torch.dtype) -> Cameras:
    """Cameras around the character, each with its own focal lengths and principal point."""
    generator = torch.Generator().manual_seed(seed)
    directions = torch.randn(count, 3, generator=generator, dtype=torch.float64)
    directions = directions / directions.norm(dim=-1, keepdim=True)
    framed = cameras_towards(
        directions, target=CENTRE, distance=4.0, half_extent=1.2, size=64, orthographic=orthographic
    )
    noise = torch.rand(2, count, 2, generator=generator, dtype=torch.float64)
    return Cameras(
        world_from_camera=framed.world_from_camera,
        focal=framed.focal * (0.5 + noise[0]),
        principal_point=framed.principal_point + 20.0 * (noise[1] - 0.5),
        orthographic=framed.orthographic,
        width=64,
        height=48,
    ).to(dtype)


@SETTINGS
@given(seed=st.integers(0, 9999), orthographic=st.booleans(), double=st.booleans())
def test_projection_and_rays_are_inverse(seed, orthographic, double):
    """A point on a pixel's ray projects to the pixel, at its depth."""
    dtype = torch.float64 if double else torch.float32
    tolerance = {torch.float64: 1e-11, torch.float32: 2e-4}[dtype]
    cameras = random_cameras(seed, 5, orthographic=orthographic, dtype=dtype)
    generator = torch.Generator().manual_seed(seed + 1)
    pixels = torch.rand(5, 2, generator=generator, dtype=dtype) * 64.0
    t_vals = 0.5 + 6.0 * torch.rand(5, generator=generator, dtype=dtype)
    rays = pixel_rays(cameras, pixels)
    assert rays.origins.dtype == rays.directions.dtype == dtype
    torch.testing.assert_close(rays.directions.norm(dim=-1), torch.ones(5, dtype=dtype))
    points = rays.origins + t_vals[:, None] * rays.directions
    back, depth, in_front = project(cameras, points)
    assert in_front.all()
    torch.testing.assert_close(back, pixels, atol=10 * tolerance, rtol=0)
    axis = -cameras.world_from_camera[:, :3, 2]
    torch.testing.assert_close(depth, t_vals * (axis * rays.directions).sum(-1), atol=tolerance, rtol=0)
    all_pixels, all_depths, all_front = project_into_all(cameras, points)
    same = torch.arange(5)
    torch.testing.assert_close(all_pixels[same, same], back, atol=10 * tolerance, rtol=0)
    torch.testing.assert_close(all_depths[same, same], depth, atol=tolerance, rtol=0)
    assert torch.equal(all_front[same, same], in_front)
    torch.testing.assert_close(
        pixel_planes(cameras, points), all_pixels.permute(1, 2, 0), atol=10 * tolerance, rtol=0
    )


@pytest.mark.parametrize("orthographic", [False, True])
def test_a_shift_of_half_a_pixel_is_seen(orthographic):
    """The centre of the picture is the optical axis: at size / 2, between the middle pixels."""
    camera = helpers.source_cameras((30.0,), size=4, orthographic=orthographic)[0]
    axis = -camera.world_from_camera[:3, 2]
    middle = pixel_rays(camera, torch.tensor((2.0, 2.0)))
    offset = torch.linalg.cross(torch.tensor(helpers.CENTRE) - middle.origins, axis)
    torch.testing.assert_close(middle.directions, axis)
    assert offset.norm() < 1e-6
    pixels, _, _ = project(camera, torch.tensor(helpers.CENTRE))
    torch.testing.assert_close(pixels, torch.tensor((2.0, 2.0)))
    shifted = pixel_rays(camera, torch.tensor((1.5, 2.0)))
    miss = torch.linalg.cross(torch.tensor(helpers.CENTRE) - shifted.origins, shifted.directions).norm()
    assert miss > 0.2  # a pixel is 0.575 m wide here
    torch.testing.assert_close(pixel_centres(4, 2)[1, 3], torch.tensor((3.5, 1.5)))


def test_azimuth_90_sees_the_left_side_and_the_face_looks_to_the_pictures_left():
    """The character faces -Y, its left is +X; in the front view its left hand is at the picture's right."""
    left, nose = torch.tensor((0.5, 0.0, 1.0)), torch.tensor((0.0, -0.5, 1.0))
    front, side, back, other = (helpers.source_cameras((a,))[0] for a in (0.0, 90.0, 180.0, 270.0))
    middle = 0.5 * helpers.SIZE
    torch.testing.assert_close(side.world_from_camera[:3, 3], torch.tensor((4.0, 0.0, 1.0)))
    torch.testing.assert_close(front.world_from_camera[:3, 3], torch.tensor((0.0, -4.0, 1.0)))
    assert project(front, left)[0][0] > middle + 1
    assert project(back, left)[0][0] < middle - 1
    assert project(side, nose)[0][0] < middle - 1
    assert project(other, nose)[0][0] > middle + 1
    assert project(side, left)[1] < project(other, left)[1]  # nearer to the camera at its own side
    assert project(front, torch.tensor((0.0, 0.0, 1.5)))[0][1] < middle - 1  # up is up
    raised = helpers.photograph(helpers.person(symmetric=False), helpers.source_cameras((0.0, 90.0)))
    upper_right, upper_left = raised[0, 4:10, 22:, 3].sum(), raised[0, 4:10, :10, 3].sum()
    assert upper_right > 3 and upper_left == 0
    red = (raised[1, ..., 0] > 0.8) & (raised[1, ..., 1] < 0.2) & (raised[1, ..., 3] > 0.9)
    assert red.any()  # the left leg is in front


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_angles_and_directions_are_inverse(dtype):
    azimuth = torch.arange(0.0, 360.0, 7.5, dtype=dtype)
    elevation = torch.linspace(-89.0, 89.0, len(azimuth), dtype=dtype)
    directions = direction_from_angles(azimuth, elevation)
    back = angles_from_direction(directions)
    tolerance = 1e-10 if dtype == torch.float64 else 2e-3
    torch.testing.assert_close(back[0], azimuth, atol=tolerance, rtol=0)
    torch.testing.assert_close(back[1], elevation, atol=tolerance, rtol=0)
    assert ((0 <= back[0]) & (back[0] < 360)).all()


def test_mirrored_cameras_see_the_mirrored_world_flipped():
    for orthographic in (False, True):
        cameras = random_cameras(3, 6, orthographic=orthographic, dtype=torch.float64)
        points = CENTRE + 0.8 * torch.randn(6, 3, dtype=torch.float64)
        flip = torch.tensor((-1.0, 1.0, 1.0), dtype=torch.float64)
        pixels, depth, _ = project(cameras, points)
        mirrored, mirrored_depth, _ = project(mirror_cameras(cameras), points * flip)
        expected = torch.stack((cameras.width - pixels[:, 0], pixels[:, 1]), dim=-1)
        torch.testing.assert_close(mirrored, expected, atol=1e-11, rtol=0)
        torch.testing.assert_close(mirrored_depth, depth, atol=1e-12, rtol=0)
        rotation = mirror_cameras(cameras).world_from_camera[:, :3, :3]
        torch.testing.assert_close(torch.linalg.det(rotation), torch.ones(6, dtype=torch.float64))
        twice = mirror_cameras(mirror_cameras(cameras))
        assert torch.equal(twice.world_from_camera, cameras.world_from_camera)


def test_the_mirrored_side_camera_is_the_camera_at_azimuth_270():
    side, other = helpers.source_cameras((90.0,)), helpers.source_cameras((270.0,))
    torch.testing.assert_close(
        mirror_cameras(side).world_from_camera, other.world_from_camera, atol=1e-6, rtol=0
    )


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_look_at_is_a_rotation_also_straight_up_and_down(dtype):
    positions = torch.tensor(
        ((0.0, 0.0, 5.0), (0.0, 0.0, -5.0), (1e-7, 0.0, 5.0), (0.0, -4.0, 1.0), (2.0, 1.0, 3.0)), dtype=dtype
    )
    target = torch.zeros(3, dtype=dtype)
    pose = look_at(positions, target.expand_as(positions))
    rotation = pose[:, :3, :3]
    torch.testing.assert_close(
        rotation.mT @ rotation, torch.eye(3, dtype=dtype).expand(5, 3, 3), atol=1e-6, rtol=0
    )
    torch.testing.assert_close(torch.linalg.det(rotation), torch.ones(5, dtype=dtype))
    torch.testing.assert_close(
        -rotation[:, :, 2], -positions / positions.norm(dim=-1, keepdim=True), atol=1e-6, rtol=0
    )
    torch.testing.assert_close(
        pose[:3, :3, 1], torch.tensor(((0.0, 1.0, 0.0),) * 3, dtype=dtype), atol=1e-6, rtol=0
    )
    assert (pose[3:, 2, 1] > 0).all() and (pose[3:, 2, 0].abs() < 1e-6).all()  # up is up, right is level


def test_points_on_and_behind_the_plane_are_masked_and_finite():
    """Value and gradient: a lookup masks them, and a mask times infinity would be NaN."""
    cameras = helpers.source_cameras((0.0, 0.0))
    cameras = Cameras(
        world_from_camera=cameras.world_from_camera,
        focal=cameras.focal,
        principal_point=cameras.principal_point,
        orthographic=torch.tensor((False, True)),
        width=cameras.width,
        height=cameras.height,
    )
    points = torch.tensor(
        ((0.0, -4.0, 1.0), (0.3, -4.0, 1.2), (0.3, -5.0, 1.2), (0.0, -4.0 + 1e-30, 1.0)), requires_grad=True
    )
    for view in range(2):
        pixels, depth, in_front = project(cameras[view], points)
        assert not in_front.any()
        (gradient,) = torch.autograd.grad(pixels.sum() + depth.sum(), points)
        assert pixels.isfinite().all() and gradient.isfinite().all()
    pixels, depth, in_front = project_into_all(cameras, points)
    (gradient,) = torch.autograd.grad(pixels.sum() + depth.sum(), points)
    assert not in_front.any() and pixels.isfinite().all() and gradient.isfinite().all()
    assert pixel_planes(cameras, points).isfinite().all()
    directions = directions_to_points(cameras, points)
    (gradient,) = torch.autograd.grad(directions.sum(), points)
    assert directions.isfinite().all() and gradient.isfinite().all()


def test_directions_to_points():
    cameras = helpers.source_cameras((0.0, 90.0), orthographic=False)
    points = torch.tensor(((0.3, 0.1, 1.4), (0.0, 0.0, 0.2)))
    expected = points[:, None] - cameras.world_from_camera[:, :3, 3]
    torch.testing.assert_close(
        directions_to_points(cameras, points), expected / expected.norm(dim=-1, keepdim=True)
    )
    parallel = directions_to_points(helpers.source_cameras((90.0,)), points)
    torch.testing.assert_close(parallel, torch.tensor((-1.0, 0.0, 0.0)).expand(2, 1, 3))


def test_cameras_frame_their_sphere_exactly():
    for orthographic in (False, True):
        camera = cameras_towards(
            direction_from_angles(torch.tensor(20.0), torch.tensor(35.0)),
            target=torch.zeros(3),
            distance=3.0,
            half_extent=1.1,
            size=50,
            orthographic=orthographic,
        )
        directions = torch.randn(200_000, 3)
        sphere = 1.1 * directions / directions.norm(dim=-1, keepdim=True)
        pixels, _, _ = project(camera, sphere)
        torch.testing.assert_close(pixels.amin(0), torch.zeros(2), atol=0.02, rtol=0)
        torch.testing.assert_close(pixels.amax(0), torch.full((2,), 50.0), atol=0.02, rtol=0)
    with pytest.raises(ValueError, match=r"distance: found 1\.0 m, expected more than half_extent = 1\.1"):
        cameras_towards(
            torch.ones(1, 3), target=CENTRE, distance=1.0, half_extent=1.1, size=8, orthographic=False
        )


@pytest.mark.parametrize("count", [1, 2, 24, 500])
def test_fibonacci_points_are_even(count):
    points = fibonacci_hemisphere(count)
    torch.testing.assert_close(points.norm(dim=-1), torch.ones(count, dtype=torch.float64))
    assert points.shape == (count, 3) and (points[:, 2] >= 0).all()
    if count >= 24:
        distances = torch.cdist(points, points) + 9.0 * torch.eye(count)
        nearest = distances.amin(-1) * (count**0.5)  # a hexagonal lattice has 2.69 for a hemisphere
        assert nearest.min() > 1.7 and nearest.max() < 3.2
        torch.testing.assert_close(points[:, 2].mean().item(), 0.5, atol=1e-9, rtol=0)
    with pytest.raises(ValueError, match="num_points: found 0"):
        fibonacci_hemisphere(0)


def test_gradcheck():
    for orthographic in (False, True):
        cameras = random_cameras(5, 3, orthographic=orthographic, dtype=torch.float64)
        points = (CENTRE + 0.5 * torch.randn(3, 3, dtype=torch.float64)).requires_grad_()
        pixels = (64 * torch.rand(3, 2, dtype=torch.float64)).requires_grad_()
        assert torch.autograd.gradcheck(lambda x, c=cameras: project(c, x)[:2], (points,))
        assert torch.autograd.gradcheck(lambda x, c=cameras: project_into_all(c, x)[:2], (points,))
        assert torch.autograd.gradcheck(lambda x, c=cameras: to_camera_frame(c, x), (points,))
        assert torch.autograd.gradcheck(lambda x, c=cameras: directions_to_points(c, x), (points,))
        rays = lambda x, c=cameras: (pixel_rays(c, x).origins, pixel_rays(c, x).directions)  # noqa: E731
        assert torch.autograd.gradcheck(rays, (pixels,))
    directions = torch.randn(3, 3, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda x: look_at(x, torch.zeros_like(x)), (directions,))
    assert torch.autograd.gradcheck(angles_from_direction, (directions,))
    angles = (50 * torch.rand(2, 3, dtype=torch.float64)).requires_grad_()
    assert torch.autograd.gradcheck(lambda x: direction_from_angles(x[0], x[1]), (angles,))


def test_a_wrong_last_axis_is_named():
    camera = helpers.source_cameras((0.0,))[0]
    with pytest.raises(ShapeError, match=r"points: found shape \(4, 2\), expected \(\.\.\., 3\)"):
        project(camera, torch.zeros(4, 2))
    with pytest.raises(ShapeError, match=r"pixels: found shape \(4, 3\), expected \(\.\.\., 2\)"):
        pixel_rays(camera, torch.zeros(4, 3))
