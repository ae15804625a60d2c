"""Cases of rotation, scaling and translation: rays, cameras, hull and compositing must not notice."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from charnerf.geometry.cameras import pixel_rays, project
from charnerf.geometry.framing import source_cameras
from charnerf.geometry.hull import build_hull, hull_contains, occupied_edges
from charnerf.geometry.rays import box_interval
from charnerf.stability.measure import Bounds, Errors, Target, count_non_finite, doubled, largest
from charnerf.stability.report import CheckRow
from charnerf.types import Cameras, RayBundle, SourceViews
from charnerf.volume.compositing import weights_from_densities


@dataclass(frozen=True)
class Motion:
    """x -> scale * rotation @ x + offset.

    Attributes:
        quarter_turns: About z: boxes stay axis-aligned.
        tilt_deg: Then about x: boxes do not.
        scale: Of all lengths.
        offset: Metres along x; y and z get halves and quarters of it.
    """

    name: str
    quarter_turns: int = 0
    tilt_deg: float = 0.0
    scale: float = 1.0
    offset: float = 0.0

    def matrix(self, like: Tensor) -> Tensor:
        """The rotation, (3, 3)."""
        turn = like.new_tensor([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        cosine, sine = math.cos(math.radians(self.tilt_deg)), math.sin(math.radians(self.tilt_deg))
        tilt = like.new_tensor([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])
        return tilt @ torch.linalg.matrix_power(turn, self.quarter_turns)

    def points(self, points: Tensor) -> Tensor:
        """Move points (..., 3)."""
        shift = points.new_tensor([1.0, 0.5, 0.25]) * self.offset
        return self.scale * (points @ self.matrix(points).T) + shift

    def cameras(self, cameras: Cameras) -> Cameras:
        """Move cameras; an orthographic one scales its pixels per metre."""
        pose = cameras.world_from_camera.clone()
        pose[..., :3, :3] = self.matrix(pose) @ pose[..., :3, :3]
        pose[..., :3, 3] = self.points(cameras.world_from_camera[..., :3, 3])
        focal = torch.where(cameras.orthographic[..., None], cameras.focal / self.scale, cameras.focal)
        return replace(cameras, world_from_camera=pose, focal=focal)

    def box(self, low: Tensor, high: Tensor) -> tuple[Tensor, Tensor]:
        """Move a box by two of its corners."""
        first, second = self.points(low), self.points(high)
        return torch.minimum(first, second), torch.maximum(first, second)


MOTIONS = (
    Motion("quarter turn", quarter_turns=1),
    Motion("half turn", quarter_turns=2),
    Motion("quarter turn, tilted by 37 degrees", quarter_turns=1, tilt_deg=37.0),
    Motion("scaled by 1e-3", scale=1e-3),
    Motion("scaled by 1e3", scale=1e3),
    Motion("moved by 100 m", offset=100.0),
)


def _cameras(target: Target, *, orthographic: bool) -> Cameras:
    """Front, side and back."""
    cameras = source_cameras(radius=1.2, size=64, orthographic=orthographic)
    return cameras.to(target.dtype).to(target.device)


def camera_cases(target: Target) -> Iterator[CheckRow]:
    """Pixels of moved points in moved cameras, and moved rays, against those of the world at rest.

    Bounds: rounding of coordinates of 100 m, against a scene of 2 m, costs two digits, and the bound says so.
    """
    if target.is_half:
        return
    points = target.tensor(
        torch.rand(200, 1, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64) * 1.2
    )
    pixels = target.tensor(
        torch.rand(50, 3, 2, generator=torch.Generator().manual_seed(1), dtype=torch.float64) * 64
    )
    for motion in MOTIONS:
        far = 100.0 if motion.offset else 1.0
        for orthographic in (False, True):
            cameras = _cameras(target, orthographic=orthographic)
            kind = f"{'orthographic' if orthographic else 'pinhole'}, {motion.name}"
            rest, depth, _ = project(cameras, points)
            moved, moved_depth, in_front = project(motion.cameras(cameras), motion.points(points))
            aside = (moved - rest).abs().amax(-1) / 64
            off = torch.maximum(aside, (moved_depth / motion.scale - depth).abs() / 4)
            bad = count_non_finite(moved, moved_depth) + int((~in_front).sum())
            bounds = Bounds(1e-6 * far, 2e-15 * far)
            yield target.row("moved projection", kind, Errors(largest(off), None, bad), bounds)
            rays, turned = pixel_rays(cameras, pixels), pixel_rays(motion.cameras(cameras), pixels)
            aim = turned.directions - rays.directions @ motion.matrix(rays.directions).T
            start = (turned.origins - motion.points(rays.origins)) / motion.scale
            errors = Errors(max(largest(aim), largest(start) / 4), None, count_non_finite(turned.origins))
            yield target.row("moved rays", kind, errors, bounds)


def hull_cases(target: Target) -> Iterator[CheckRow]:
    """Moved boxes, and hulls carved from the same drawings with moved cameras: same lengths, same cells."""
    if target.is_half:
        return
    cameras = _cameras(target, orthographic=True)
    views = _views(cameras, target)
    low, high = target.tensor([-1.2, -1.2, -0.2]), target.tensor([1.2, 1.2, 2.2])
    pixels = target.tensor(
        torch.rand(60, 3, 2, generator=torch.Generator().manual_seed(2), dtype=torch.float64) * 64
    )
    seen = pixel_rays(_cameras(target, orthographic=False), pixels)
    rays = RayBundle(seen.origins.reshape(-1, 3), seen.directions.reshape(-1, 3))
    probes = target.tensor(
        torch.rand(4000, 3, generator=torch.Generator().manual_seed(3), dtype=torch.float64)
    )
    probes = low + probes * (high - low)
    hull = build_hull(views, box_min=low, box_max=high, grid_size=64)[0]
    inside = hull_contains(hull, probes)
    length = _occupied_length(hull, rays)
    near, far = box_interval(rays, low, high)
    for motion in MOTIONS:
        if motion.tilt_deg:
            continue
        wide = 100.0 if motion.offset else 1.0
        box_min, box_max = motion.box(low, high)
        turned = RayBundle(motion.points(rays.origins), rays.directions @ motion.matrix(rays.directions).T)
        moved_near, moved_far = box_interval(turned, box_min, box_max)
        error = (
            torch.maximum((moved_near / motion.scale - near).abs(), (moved_far / motion.scale - far).abs())
            / 4
        )
        errors = Errors(_share_above(error, 4e-6 * wide), None, count_non_finite(moved_near, moved_far))
        yield target.row("moved ray and box", f"{motion.name}: share off", errors, Bounds(0.01, 0.01))
        carved = build_hull(
            replace(views, cameras=motion.cameras(cameras)[None]),
            box_min=box_min,
            box_max=box_max,
            grid_size=64,
        )[0]
        differ = (hull_contains(carved, motion.points(probes)) != inside).double().mean()
        yield target.row(
            "moved hull",
            f"{motion.name}: share of points that differ",
            Errors(float(differ)),
            Bounds(0.01, 0.01),
        )
        off = doubled(_occupied_length(carved, turned) / motion.scale - length).abs().mean()
        yield target.row(
            "moved hull", f"{motion.name}: occupied length, m, mean", Errors(float(off)), Bounds(0.02, 0.02)
        )


def _share_above(error: Tensor, bound: float) -> float:
    """Share of rays that are off: a ray along a corner may flip between a hit without length and a miss."""
    return float((doubled(error) > bound).double().mean())


def _occupied_length(hull: object, rays: RayBundle) -> Tensor:
    t_edges, occupied = occupied_edges(hull, rays, 192)  # type: ignore[arg-type]
    return (torch.diff(t_edges, dim=-1) * occupied).sum(-1)


def _views(cameras: Cameras, target: Target) -> SourceViews:
    """Drawings of an ellipsoid 0.8 m wide and 1.8 m tall, (1, 3)."""
    y, x = torch.meshgrid(torch.arange(64) + 0.5, torch.arange(64) + 0.5, indexing="ij")
    mask = ((x - 32) / 11).square() + ((y - 32) / 24).square() < 1
    picture = mask.to(target.device, target.dtype).expand(1, 3, 4, 64, 64)
    flags = torch.ones(1, 3, dtype=torch.bool, device=target.device)
    return SourceViews(images=picture, cameras=cameras[None], present=flags, mirrored=~flags)


def compositing_cases(target: Target) -> Iterator[CheckRow]:
    """Densities and intervals of a world scaled by a factor: the same weights, gradients scaled back."""
    if target.is_half:
        return
    densities = target.tensor(10.0 ** torch.linspace(-3.0, 3.0, 64, dtype=torch.float64))
    deltas = target.tensor(torch.full((64,), 2.0 / 64, dtype=torch.float64))
    rest, final = weights_from_densities(densities, deltas)
    for scale in (1e-3, 1e3):
        weights, moved_final = weights_from_densities(densities / scale, deltas * scale)
        errors = Errors(
            max(largest(weights - rest), largest(moved_final - final)), None, count_non_finite(weights)
        )
        yield target.row("moved compositing", f"scaled by {scale:.0e}", errors, Bounds(1e-6, 1e-15))


CASES = (camera_cases, hull_cases, compositing_cases)
