"""Fields with known surfaces, in place of a trained model."""

from collections.abc import Callable

import torch
from torch import Tensor

from charnerf.geometry.bounds import Bounds
from charnerf.scene import FunctionField, Scene
from charnerf.types import FieldOutput, Hull

BOX = torch.tensor([-1.4, -1.4, -0.4]), torch.tensor([1.4, 1.4, 2.4])


def with_field(
    scene: Scene, function: Callable[[Tensor, Tensor], FieldOutput], *, sees_directions: bool = False
) -> Scene:
    """The scene with another field, of one pass."""
    return Scene(FunctionField(function, sees_directions), None, scene.bounds)


def box_hull(occupancy: Tensor, low: Tensor, high: Tensor) -> Hull:
    """A hull with the given occupancy and empty maps."""
    empty = torch.zeros(0)
    return Hull(occupancy, low, high, empty, empty, empty)


def scene_of(
    distance: Callable[[Tensor], Tensor],
    *,
    width: float = 0.03,
    peak: float = 200.0,
    hull: Hull | None = None,
    sees_directions: bool = False,
) -> Scene:
    """Density peak / 2 where a signed distance (positive inside) is zero, smooth over a width."""

    def field(points: Tensor, view_dirs: Tensor) -> FieldOutput:
        rgb = (0.5 + 0.4 * points).clamp(0.0, 1.0)
        rgb[:, 2] = torch.where(points[:, 1] < 0, 0.9, 0.1)  # blue in front
        return FieldOutput(rgb=rgb, densities=peak * torch.sigmoid(distance(points) * (4.0 / width)))

    return Scene(FunctionField(field, sees_directions), None, Bounds(*BOX, hull))


def sphere(points: Tensor, *, centre=(0.03, -0.07, 1.02), radius: float = 1.0) -> Tensor:
    """Signed distance to a sphere, positive inside, m."""
    return radius - (points - points.new_tensor(centre)).norm(dim=-1)


def capsule(points: Tensor, start, end, radius: float) -> Tensor:
    """Signed distance to a capsule, positive inside, m."""
    a, b = points.new_tensor(start), points.new_tensor(end)
    along = ((points - a) @ (b - a) / (b - a).dot(b - a)).clamp(0.0, 1.0)
    return radius - (points - (a + along[:, None] * (b - a))).norm(dim=-1)


def figure(points: Tensor) -> Tensor:
    """Signed distance to a 2 m figure in a T pose, its nose at -Y, positive inside, m."""
    parts = [
        capsule(points, (0, 0, 0.95), (0, 0, 1.4), 0.2),
        capsule(points, (0, 0, 1.7), (0, 0, 1.78), 0.22),
        capsule(points, (0, -0.22, 1.75), (0, -0.3, 1.75), 0.06),
        capsule(points, (-0.75, 0, 1.45), (0.75, 0, 1.45), 0.09),
        capsule(points, (-0.14, 0, 0.1), (-0.1, 0, 0.9), 0.1),
        capsule(points, (0.14, 0, 0.1), (0.1, 0, 0.9), 0.1),
    ]
    return torch.stack(parts).amax(0)
