"""Cameras: where they stand, how points project, and which rays their pixels see.

Camera frame: +X right, +Y up, looks along -Z. Pixels: x right, y down, centres at +0.5. Azimuth 0 sees the character's
front (it faces -Y), 90 its left side, 180 its back; elevation 0 is level.
"""

import math
from dataclasses import replace

import torch
from torch import Tensor

from charnerf.checks import check_last_dim
from charnerf.geometry.safe import safe_normalize
from charnerf.types import Cameras, RayBundle, SourceViews

ASIDE = 1e-6  # of a direction: what is no more aside goes along an axis, micrometres off at the far end


def fibonacci_hemisphere(num_points: int) -> Tensor:
    """Spread points evenly over the upper hemisphere.

    Args:
        num_points: How many, at least 1.

    Returns:
        Unit vectors, (num_points, 3), float64, z >= 0: the golden-angle spiral with equal steps in z.

    Raises:
        ValueError: If num_points is below 1.

    Source: paper, Dataset Collection (Fibonacci lattice, upper hemisphere).
    """
    if num_points < 1:
        raise ValueError(f"num_points: found {num_points}, expected at least 1.")
    index = torch.arange(num_points, dtype=torch.float64)
    z = 1.0 - (index + 0.5) / num_points
    radius = torch.sqrt((1.0 - z * z).clamp_min(0.0))
    angle = index * (math.pi * (3.0 - math.sqrt(5.0)))
    return torch.stack((radius * torch.cos(angle), radius * torch.sin(angle), z), dim=-1)


def direction_from_angles(azimuth_deg: Tensor, elevation_deg: Tensor) -> Tensor:
    """Unit vectors (..., 3) from the character to a camera at the given angles (...), degrees."""
    azimuth, elevation = torch.deg2rad(azimuth_deg), torch.deg2rad(elevation_deg)
    level = torch.cos(elevation)
    return torch.stack(
        (level * torch.sin(azimuth), -level * torch.cos(azimuth), torch.sin(elevation)), dim=-1
    )


def angles_from_direction(directions: Tensor) -> tuple[Tensor, Tensor]:
    """Azimuth in [0, 360) and elevation in [-90, 90], degrees (...), of vectors (..., 3) towards a camera."""
    x, y, z = directions.unbind(-1)
    azimuth = torch.rad2deg(torch.atan2(x, -y)) % 360.0
    elevation = torch.rad2deg(torch.atan2(z, torch.hypot(x, y)))
    return azimuth, elevation


def look_at(positions: Tensor, targets: Tensor) -> Tensor:
    """Poses of cameras that look at a target with world +Z up (+Y where they look straight up or down).

    Args:
        positions: Camera centres, (..., 3), m.
        targets: Points looked at, (..., 3), m, broadcast to positions.

    Returns:
        world_from_camera, (..., 4, 4).
    """
    backward = safe_normalize(positions - targets)
    up = torch.zeros_like(backward)
    up[..., 2] = 1.0
    vertical = backward[..., :2].abs().amax(-1) < 1e-6  # 1 - z^2 would vanish in float32 long before
    up[vertical] = up.new_tensor((0.0, 1.0, 0.0))
    right = safe_normalize(torch.linalg.cross(up, backward))
    true_up = torch.linalg.cross(backward, right)
    pose = torch.zeros(*backward.shape[:-1], 4, 4, dtype=backward.dtype, device=backward.device)
    pose[..., :3, 0], pose[..., :3, 1], pose[..., :3, 2] = right, true_up, backward
    pose[..., :3, 3] = positions
    pose[..., 3, 3] = 1.0
    return pose


def cameras_towards(
    directions: Tensor, *, target: Tensor, distance: float, half_extent: float, size: int, orthographic: bool
) -> Cameras:
    """Square cameras around a target that frame a sphere of a given radius exactly.

    Args:
        directions: Unit vectors from the target to the cameras, (..., 3).
        target: Point looked at, (3,), m.
        distance: From target to camera, m; above half_extent.
        half_extent: Radius of the sphere that touches the picture's edges, m.
        size: Image side, pixels.
        orthographic: Parallel projection instead of a pinhole.

    Returns:
        Cameras of shape (...).

    Raises:
        ValueError: If the distance does not exceed the half extent.
    """
    if not distance > half_extent > 0.0:
        raise ValueError(
            f"distance: found {distance} m, expected more than half_extent = {half_extent} m > 0."
        )
    pose = look_at(target + distance * directions, target.expand_as(directions))
    if orthographic:
        focal = size / (2.0 * half_extent)
    else:
        focal = 0.5 * size * math.sqrt(distance**2 - half_extent**2) / half_extent
    shape = directions.shape[:-1]
    return Cameras(
        world_from_camera=pose,
        focal=torch.full((*shape, 2), focal, dtype=pose.dtype, device=pose.device),
        principal_point=torch.full((*shape, 2), 0.5 * size, dtype=pose.dtype, device=pose.device),
        orthographic=torch.full(shape, orthographic, dtype=torch.bool, device=pose.device),
        width=size,
        height=size,
    )


def mirror_cameras(cameras: Cameras) -> Cameras:
    """Cameras whose pictures are the left-right mirrored pictures of a character mirrored in the plane x = 0.

    A picture flipped left to right is what the mirrored camera sees of the mirrored character; for a character that is its own
    mirror image, the side drawing flipped is therefore its other side.
    """
    world_flip = cameras.world_from_camera.new_tensor((-1.0, 1.0, 1.0, 1.0))
    pose = world_flip[:, None] * cameras.world_from_camera * world_flip
    principal = cameras.principal_point.clone()
    principal[..., 0] = cameras.width - principal[..., 0]
    return Cameras(
        world_from_camera=pose,
        focal=cameras.focal,
        principal_point=principal,
        orthographic=cameras.orthographic,
        width=cameras.width,
        height=cameras.height,
    )


def mirror_views(views: SourceViews) -> SourceViews:
    """Views of the character mirrored in the plane x = 0: one from its left becomes one from its right."""
    widened = views.widened_alphas
    return replace(
        views,
        images=views.images.flip(-1),
        cameras=mirror_cameras(views.cameras),
        widened_alphas=None if widened is None else widened.flip(-1),
    )


def to_camera_frame(cameras: Cameras, points: Tensor) -> Tensor:
    """World points (..., 3) in the frames of cameras whose shape broadcasts against (...)."""
    rotation = cameras.world_from_camera[..., :3, :3]
    offset = points - cameras.world_from_camera[..., :3, 3]
    return _combine(rotation.mT, offset)


def _combine(matrix: Tensor, vectors: Tensor) -> Tensor:
    """Products (..., 3) of matrices and vectors as sums of columns: reducing axes of three is slow."""
    x, y, z = vectors[..., 0, None], vectors[..., 1, None], vectors[..., 2, None]
    return matrix[..., 0] * x + matrix[..., 1] * y + matrix[..., 2] * z


def project(cameras: Cameras, points: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Project world points into cameras.

    Args:
        cameras: Cameras whose shape broadcasts against the points' leading shape.
        points: (..., 3), m.

    Returns:
        pixels (..., 2); depth (...), m along the viewing axis, positive in front; in_front (...), bool. Pixels of points on or
        behind a pinhole's plane are finite and meaningless: mask them with in_front.
    """
    check_last_dim("points", points, 3)
    return _project_local(cameras, to_camera_frame(cameras, points))


def _project_local(cameras: Cameras, local: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """What `project` gives, of points (..., 3) in the cameras' own frames."""
    depth = -local[..., 2]
    in_front = depth > 1e-6
    divisor = torch.where(cameras.orthographic, torch.ones_like(depth), torch.where(in_front, depth, 1.0))
    flat = torch.stack((local[..., 0], -local[..., 1]), dim=-1) / divisor[..., None]
    return cameras.principal_point + cameras.focal * flat, depth, in_front


def pixel_rays(cameras: Cameras, pixels: Tensor) -> RayBundle:
    """Rays through pixel positions.

    Args:
        cameras: Cameras whose shape broadcasts against the pixels' leading shape.
        pixels: (..., 2), x right, y down; add 0.5 to indices for centres.

    Returns:
        Rays (...): of a pinhole from its centre, of an orthographic camera from its plane.
    """
    check_last_dim("pixels", pixels, 2)
    flat = (pixels - cameras.principal_point) / cameras.focal
    x, y = flat[..., 0], -flat[..., 1]
    zero, one = torch.zeros_like(x), torch.ones_like(x)
    parallel = cameras.orthographic
    local_direction = torch.stack(
        (torch.where(parallel, zero, x), torch.where(parallel, zero, y), -one), dim=-1
    )
    local_origin = torch.stack((torch.where(parallel, x, zero), torch.where(parallel, y, zero), zero), dim=-1)
    rotation = cameras.world_from_camera[..., :3, :3]
    directions = safe_normalize(_combine(rotation, local_direction))
    origins = cameras.world_from_camera[..., :3, 3] + _combine(rotation, local_origin)
    return RayBundle(origins=origins, directions=directions)


def pixel_centres(width: int, height: int, *, device: torch.device | str = "cpu") -> Tensor:
    """Centres of all pixels of an image, (height, width, 2), float32, x then y."""
    y, x = torch.meshgrid(
        torch.arange(height, device=device) + 0.5, torch.arange(width, device=device) + 0.5, indexing="ij"
    )
    return torch.stack((x, y), dim=-1)


def project_into_all(cameras: Cameras, points: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Project every point into every camera with one matrix product.

    Args:
        cameras: Cameras (V,).
        points: (P, 3), m.

    Returns:
        pixels (P, V, 2), depth (P, V) and in_front (P, V), as `project`.
    """
    rotation = cameras.world_from_camera[:, :3, :3]  # (V, 3 world, 3 camera)
    offset = (rotation * cameras.world_from_camera[:, :3, 3:]).sum(1)  # (V, 3): camera centre in its own axes
    num_views = rotation.shape[0]
    turned = (points @ rotation.permute(1, 0, 2).reshape(3, num_views * 3)).unflatten(-1, (num_views, 3))
    return _project_local(cameras, turned - offset)


def pixel_planes(cameras: Cameras, points: Tensor) -> Tensor:
    """Pixels (V, 2, P) of points (P, 3) in cameras (V,), as `project_into_all`, x and y one after the other: passes over memory."""
    axes = cameras.world_from_camera[:, :3, :3].mT  # (V, 3 camera, 3 world)
    offset = (axes * cameras.world_from_camera[:, None, :3, 3]).sum(-1)
    turned = torch.addmm(-offset.reshape(-1, 1), axes.reshape(-1, 3), points.t()).unflatten(0, (-1, 3))
    depth = -turned[:, 2]
    divisor = torch.where(cameras.orthographic[:, None] | (depth <= 1e-6), 1.0, depth)
    scale = cameras.focal * cameras.focal.new_tensor((1.0, -1.0))
    return torch.addcmul(
        cameras.principal_point[..., None], turned[:, :2] / divisor[:, None], scale[..., None]
    )


def directions_to_points(cameras: Cameras, points: Tensor) -> Tensor:
    """Unit directions (P, V, 3) from cameras (V,) to points (P, 3): of an orthographic camera its viewing axis."""
    along_axis = -cameras.world_from_camera[:, :3, 2]
    towards = safe_normalize(points[:, None] - cameras.world_from_camera[:, :3, 3])
    return torch.where(cameras.orthographic[:, None], along_axis, towards)


def world_axis_along(camera: Cameras, ends: Tensor) -> int | None:
    """Axis of the world along which an orthographic camera of shape () looks at a box: layers across it project alike.

    Args:
        camera: Of shape ().
        ends: Lower and upper corner of the box, (2, 3), m.

    Returns:
        None where the camera is a pinhole, looks aside of all axes, or has a part of the box behind it.
    """
    shares, axes = camera.world_from_camera[:3, 2].abs().sort(descending=True)
    in_front = project(camera, ends)[2]
    alike = bool(camera.orthographic) and float(shares[1:].sum()) < ASIDE and bool(in_front.all())
    return int(axes[0]) if alike else None


def pixel_lattice(cameras: Cameras) -> tuple[Tensor, float] | None:
    """The lattice of pixel centres of orthographic cameras (V,) that look along the world's axes: maps of pictures bend there.

    Returns:
        A point of it, (3,), m, and its pitch, m, the finest pixel; along an axis that no picture lies along it goes through 0. None
        where no camera is orthographic.
    """
    if not bool(cameras.orthographic.any()):
        return None
    flat = cameras[cameras.orthographic]
    pitch = 1.0 / float(flat.focal.amax())
    through = torch.zeros_like(flat.world_from_camera[0, :3, 3])
    for image_axis in (1, 0):
        axes, centres = flat.world_from_camera[:, :3, image_axis], flat.world_from_camera[:, :3, 3]
        first = (0.5 - flat.principal_point[:, image_axis]) / flat.focal[
            :, image_axis
        ]  # m from the principal point
        sign = -1.0 if image_axis == 1 else 1.0  # rows run down
        for axis, centre, offset in zip(axes, centres, sign * first, strict=True):
            along = int(axis.abs().argmax())
            if abs(float(axis[along])) > 1.0 - 1e-6:
                through[along] = centre[along] + axis[along] * offset
    return through, pitch
