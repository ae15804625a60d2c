"""Characters known in closed form: figures of coloured capsules, their pictures, their data set on disk."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import trimesh
from torch import Tensor

from charnerf.data.characters import CharacterPictures, write_character
from charnerf.data.layout import add_to_split
from charnerf.geometry.cameras import (
    direction_from_angles,
    fibonacci_hemisphere,
    pixel_centres,
    pixel_rays,
)
from charnerf.geometry.framing import framing_cameras
from charnerf.geometry.world import CENTRE
from charnerf.types import Cameras, RayBundle, SourceViews

HALF_EXTENT = 1.15
SIZE = 32
OVERSAMPLING = 4


@dataclass(frozen=True, eq=False)
class Figure:
    """Capsules: ends a, b (K, 3), radii (K,), m, and colours (K, 3); equal ends make a ball."""

    a: Tensor
    b: Tensor
    radii: Tensor
    colors: Tensor


def capsules(*rows: tuple[tuple[float, ...], tuple[float, ...], float, tuple[float, ...]]) -> Figure:
    """A figure of (a, b, radius, colour) rows, float64."""
    a, b, radii, colors = zip(*rows, strict=True)
    tensor = lambda value: torch.tensor(value, dtype=torch.float64)  # noqa: E731
    return Figure(a=tensor(a), b=tensor(b), radii=tensor(radii), colors=tensor(colors))


def person(*, symmetric: bool = True) -> Figure:
    """A person 2 m tall, facing -Y: its own mirror image, or with a raised left arm (+X), red left leg."""
    skin, shirt, trousers, face = (0.9, 0.7, 0.5), (0.1, 0.4, 0.8), (0.2, 0.5, 0.2), (0.8, 0.1, 0.3)
    right_hand, left_hand = (-0.62, 0.0, 0.95), ((0.62, 0.0, 0.95) if symmetric else (0.62, -0.2, 1.65))
    return capsules(
        ((0.0, 0.0, 1.72), (0.0, 0.0, 1.72), 0.28, skin),
        ((0.0, -0.24, 1.72), (0.0, -0.24, 1.72), 0.09, face),  # a nose: the face looks along -Y
        ((0.0, 0.0, 0.9), (0.0, 0.0, 1.3), 0.24, shirt),
        ((-0.15, 0.0, 0.12), (-0.15, 0.0, 0.8), 0.12, trousers),
        ((0.15, 0.0, 0.12), (0.15, 0.0, 0.8), 0.12, trousers if symmetric else (0.9, 0.1, 0.1)),
        ((-0.2, 0.0, 1.35), right_hand, 0.09, skin),
        ((0.2, 0.0, 1.35), left_hand, 0.09, skin),
    )


def ball(radius: float = 0.8) -> Figure:
    """One ball around the point that captures look at."""
    return capsules((CENTRE, CENTRE, radius, (0.8, 0.3, 0.1)))


def dumbbell() -> Figure:
    """Two balls and a thin slanted rod: much empty space inside its box."""
    return capsules(
        ((-0.5, 0.1, 0.4), (-0.5, 0.1, 0.4), 0.3, (0.9, 0.2, 0.2)),
        ((0.45, -0.1, 1.6), (0.45, -0.1, 1.6), 0.25, (0.2, 0.2, 0.9)),
        ((-0.5, 0.1, 0.4), (0.45, -0.1, 1.6), 0.05, (0.3, 0.8, 0.3)),
    )


def surface_points(figure: Figure, count: int, seed: int = 0) -> Tensor:
    """Points (count, 3) on the outer surface, float64."""
    generator = torch.Generator().manual_seed(seed)
    which = torch.randint(len(figure.radii), (8 * count,), generator=generator)
    normals = torch.randn(8 * count, 3, generator=generator, dtype=torch.float64)
    normals = normals / normals.norm(dim=-1, keepdim=True)
    share = torch.rand(8 * count, 1, generator=generator, dtype=torch.float64)
    axis = figure.b[which] - figure.a[which]
    # on the caps beyond the ends, on the side between them
    end = torch.where((normals * axis).sum(-1, keepdim=True) > 0, 1.0, 0.0)
    on_side = torch.rand(8 * count, 1, generator=generator, dtype=torch.float64) < 0.7
    length = axis.norm(dim=-1, keepdim=True)
    unit = axis / length.clamp_min(1e-12)
    across = normals - (normals * unit).sum(-1, keepdim=True) * unit
    across = across / across.norm(dim=-1, keepdim=True)
    side = figure.a[which] + share * axis + figure.radii[which, None] * across
    cap = figure.a[which] + end * axis + figure.radii[which, None] * normals
    points = torch.where(on_side & (length > 0), side, cap)
    return points[signed_distances(figure, points) > -1e-9][:count]


def signed_distances(figure: Figure, points: Tensor) -> Tensor:
    """Distance (...) from points (..., 3) to the surface, m, negative inside (a lower bound there)."""
    points = points.double()[..., None, :]
    axis = figure.b - figure.a
    share = ((points - figure.a) * axis).sum(-1) / axis.square().sum(-1).clamp_min(1e-30)
    nearest = figure.a + share.clamp(0.0, 1.0)[..., None] * axis
    return ((points - nearest).norm(dim=-1) - figure.radii).amin(-1)


def trace(figure: Figure, rays: RayBundle) -> tuple[Tensor, Tensor]:
    """First hits of rays (R,): distances (R,), infinite where they miss, and colours (R, 3)."""
    origins, directions = rays.origins.double()[:, None], rays.directions.double()[:, None]
    axis = figure.b - figure.a
    length = axis.norm(dim=-1, keepdim=True)
    unit = torch.where(length > 0, axis / length.clamp_min(1e-12), 0.0)
    hits = [_hit_ball(origins, directions, end, figure.radii) for end in (figure.a, figure.b)]
    offset = origins - figure.a
    along_d, along_o = (directions * unit).sum(-1, keepdim=True), (offset * unit).sum(-1, keepdim=True)
    side = _hit_ball(offset - along_o * unit, directions - along_d * unit, torch.zeros(3), figure.radii)
    height = along_o[..., 0] + side.nan_to_num(posinf=0.0) * along_d[..., 0]
    hits.append(torch.where((height > 0) & (height < length[:, 0]), side, torch.inf))
    t_vals, which = torch.stack(hits).amin(0).min(-1)
    return t_vals, figure.colors[which]


def _hit_ball(origins: Tensor, directions: Tensor, centres: Tensor, radii: Tensor) -> Tensor:
    """Smallest root of |o + t d - c| = r over (R, K), infinite where there is none."""
    offset = origins - centres
    a, half_b = directions.square().sum(-1), (offset * directions).sum(-1)
    c = offset.square().sum(-1) - radii**2
    root = half_b.square() - a * c
    return torch.where(
        (root > 0) & (a > 1e-12), (-half_b - root.clamp_min(0.0).sqrt()) / a.clamp_min(1e-12), torch.inf
    )


def photograph(figure: Figure, cameras: Cameras) -> Tensor:
    """Antialiased RGBA pictures (N, H, W, 4) by cameras (N,), float32 in [0, 1], straight alpha."""
    width, height, k = cameras.width, cameras.height, OVERSAMPLING
    pictures = []
    for index in range(cameras.shape[0]):
        pixels = pixel_centres(width * k, height * k).double() / k
        rays = pixel_rays(cameras[index].to(torch.float64), pixels.reshape(-1, 2))
        t_vals, colors = trace(figure, rays)
        alpha = t_vals.isfinite().double()[:, None]
        fine = torch.cat((colors * alpha, alpha), dim=-1).reshape(height, k, width, k, 4)
        mean = fine.mean(dim=(1, 3))
        rgb = mean[..., :3] / mean[..., 3:].clamp_min(1e-9)
        pictures.append(torch.cat((rgb, mean[..., 3:]), dim=-1).float())
    return torch.stack(pictures)


def source_cameras(
    azimuths: tuple[float, ...] = (0.0, 90.0, 180.0), *, size: int = SIZE, orthographic: bool = True
) -> Cameras:
    """Level cameras (V,) around the character, float32."""
    angles = torch.tensor(azimuths, dtype=torch.float64)
    directions = direction_from_angles(angles, torch.zeros_like(angles))
    cameras = framing_cameras(directions, radius=HALF_EXTENT, size=size, orthographic=orthographic)
    return cameras.to(torch.float32)


def target_cameras(count: int, *, size: int = SIZE) -> Cameras:
    """Pinholes (count,) on the upper hemisphere, float32."""
    return framing_cameras(fibonacci_hemisphere(count), radius=HALF_EXTENT, size=size).to(torch.float32)


def source_views(figure: Figure, cameras: Cameras | None = None) -> SourceViews:
    """Drawings of a figure, B = 1; front, side and back, orthographic, by default."""
    cameras = source_cameras() if cameras is None else cameras
    present = torch.ones(1, cameras.shape[0], dtype=torch.bool)
    images = photograph(figure, cameras).permute(0, 3, 1, 2)[None]
    return SourceViews(images=images, cameras=cameras[None], present=present, mirrored=~present)


def as_bytes(pictures: Tensor) -> np.ndarray:
    """Pictures in [0, 1] as uint8."""
    return (255.0 * pictures).round().to(torch.uint8).numpy()


def write_figure(
    root: Path, name: str, split: str, figure: Figure, *, views: int = 8, mesh: bool = True
) -> Path:
    """Add a figure to a data set, with its depth pictures and, if wanted, its mesh."""
    cameras, sources = target_cameras(views), source_cameras()
    depths = []
    for index in range(views):
        rays = pixel_rays(cameras[index], pixel_centres(SIZE, SIZE).reshape(-1, 2))
        t_vals, _ = trace(figure, rays)
        axis = -cameras.world_from_camera[index, :3, 2].double()
        depth = t_vals.nan_to_num(posinf=0.0) * (rays.directions.double() * axis).sum(-1)
        depths.append((1000.0 * depth).round().reshape(SIZE, SIZE).numpy().astype(np.uint16))
    pictures = CharacterPictures(
        cameras=cameras,
        images=as_bytes(photograph(figure, cameras)),
        source_cameras=sources,
        source_images=as_bytes(photograph(figure, sources)),
        source_names=("front", "side", "back"),
        depths=np.stack(depths),
    )
    folder = write_character(root, name, pictures, write_mesh=mesh_writer(figure) if mesh else None)
    add_to_split(root, split, [name])
    return folder


def mesh_writer(figure: Figure):
    """What writes the figure's mesh to a file."""

    def write(path: Path) -> None:
        parts = []
        for a, b, radius, color in zip(figure.a, figure.b, figure.radii, figure.colors, strict=True):
            length = float((b - a).norm())
            if length > 0:
                part = trimesh.creation.capsule(height=length, radius=float(radius), count=[12, 12])
                part.apply_translation(-part.bounds.mean(axis=0))
                part.apply_transform(trimesh.geometry.align_vectors((0, 0, 1), (b - a).numpy()))
                part.apply_translation(0.5 * (a + b).numpy())
            else:
                part = trimesh.creation.icosphere(subdivisions=2, radius=float(radius)).apply_translation(
                    a.numpy()
                )
            part.visual.vertex_colors = np.tile(
                np.append(255 * color.numpy(), 255).astype(np.uint8), (len(part.vertices), 1)
            )
            parts.append(part)
        trimesh.util.concatenate(parts).export(path)

    return write
