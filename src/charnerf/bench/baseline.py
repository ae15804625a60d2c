"""The same network evaluated like pixelNeRF's authors do: what all speed-ups are measured against.

Every sample of every ray in every view, images read by grid_sample, linear maps applied at each point and
not on the maps, one
large batch. Written from that description, not from their code. The visual hull belongs to our model
(outside it the density is
zero by definition): it is applied to the densities afterwards and saves nothing here.

Letters: R rays, S samples a ray, P points, V views, C channels.
"""

from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.geometry.cameras import directions_to_points, project
from charnerf.geometry.cross_sections import CrossSections, cross_sections, read_cross_sections
from charnerf.geometry.hull import hull_contains
from charnerf.geometry.rays import box_interval, points_along
from charnerf.geometry.sampling import edges_from_t_vals, importance_t_vals, merge_t_vals, stratified_t_vals
from charnerf.models.charnerf import CharNeRF, EncodedViews
from charnerf.models.field import Field
from charnerf.models.inputs import FieldInputs, PointViews
from charnerf.models.view_maps import kept_share, widened_coverage
from charnerf.pictures import images_on_white
from charnerf.types import FieldOutput, Hull, RayBundle, RenderOutput, SourceViews
from charnerf.volume.compositing import composite, expected_depth, weights_from_densities

POINTS_AT_ONCE = 100_000  # pixelNeRF's evaluation batch
NUM_COARSE, NUM_FINE = 64, 32  # its samples a ray


@dataclass(frozen=True)
class PixelAligned:
    """What the baseline reads: maps (V, C, h, w) of one character, not hoisted; coverage of the views that carve alone."""

    views: SourceViews
    feature_maps: Tensor
    pictures: Tensor
    hull: Hull | None
    hull_maps: Tensor | None
    sections: CrossSections | None
    carving: Tensor
    coverage: Tensor | None

    @classmethod
    def of(cls, encoded: EncodedViews, index: int = 0) -> "PixelAligned":
        """One character of a batch of encoded views."""
        views = encoded.views[index]
        hull = None if encoded.hull is None else encoded.hull[index]
        maps = None if hull is None else torch.stack((hull.front_depths, hull.edge_distances), dim=1)
        sections = None if hull is None else cross_sections(hull)
        carving, coverage = (views.present & ~views.mirrored).nonzero()[:, 0], None
        if hull is not None:
            coverage = widened_coverage(views.carving_alphas[carving, None], hull.dilations[carving])
        pictures = images_on_white(views.images)
        return cls(views, encoded.feature_maps[index], pictures, hull, maps, sections, carving, coverage)


@final
class PixelNeRFLike:
    """Renders rays by evaluating everything.

    The coarse field is asked at 64 samples, then the fine one, or the same again where a network has but
    one field, at all 96:
    so do the authors, whose fine pass asks the first 64 anew.

    Args:
        network: The trained network.
        num_coarse: Equal bins between near and far of the box.
        num_fine: Further samples drawn by the coarse weights.
    """

    def __init__(self, network: CharNeRF, *, num_coarse: int = NUM_COARSE, num_fine: int = NUM_FINE) -> None:
        self.network, self.num_coarse, self.num_fine = network, num_coarse, num_fine

    def render(
        self, maps: PixelAligned, rays: RayBundle, generator: torch.Generator | None = None
    ) -> RenderOutput:
        """Render rays (R,)."""
        near, far = box_interval(rays, *self.network.box)
        coarse = stratified_t_vals(near, far, self.num_coarse, generator)
        answer = self._ask(self.network.coarse, maps, rays, coarse)
        weights, _ = weights_from_densities(
            answer.densities, edges_from_t_vals(coarse, near, far).diff(dim=-1)
        )
        edges = edges_from_t_vals(coarse, near, far)
        drawn = importance_t_vals(edges, weights.detach(), self.num_fine, generator)
        t_vals = merge_t_vals(coarse, drawn)
        answer = self._ask(self.network.finest, maps, rays, t_vals)
        widths = edges_from_t_vals(t_vals, near, far).diff(dim=-1)
        weights, _ = weights_from_densities(answer.densities, widths)
        return RenderOutput(
            rgb=composite(weights, answer.rgb, weights.new_tensor(1.0)),
            opacity=weights.sum(-1),
            depth=expected_depth(weights, t_vals, far),
        )

    def _ask(self, field: Field, maps: PixelAligned, rays: RayBundle, t_vals: Tensor) -> FieldOutput:
        """Answers at all samples (R, S), density zero outside the hull."""
        points = points_along(rays, t_vals)
        dirs = rays.directions[:, None].expand_as(points).reshape(-1, 3)
        flat = points.reshape(-1, 3)
        parts = [
            self.evaluate(field, maps, flat[i : i + POINTS_AT_ONCE], dirs[i : i + POINTS_AT_ONCE])
            for i in range(0, len(flat), POINTS_AT_ONCE)
        ]
        densities = torch.cat([part.densities for part in parts]).reshape(t_vals.shape)
        if maps.hull is not None:
            densities = densities * hull_contains(maps.hull, points)
        return FieldOutput(
            rgb=torch.cat([part.rgb for part in parts]).reshape(points.shape), densities=densities
        )

    def evaluate(self, field: Field, maps: PixelAligned, points: Tensor, view_dirs: Tensor) -> FieldOutput:
        """Colour and density of points (P, 3): every map read in every view, every linear map at every point."""
        network, cameras = self.network, maps.views.cameras
        pixels, depth, in_front = project(cameras[:, None], points[None])  # (V, P, ..)
        size = pixels.new_tensor((cameras.width, cameras.height))
        valid = (in_front & (pixels >= 0).all(-1) & (pixels <= size).all(-1)).T
        latents = field.from_latents(_read(maps.feature_maps, pixels / size)) * valid[..., None]
        kept = self._kept(maps, pixels / size)
        behind, edge = self._read_hull(maps, pixels / size, depth.T, points)
        places, half_lengths = self._read_sections(maps, points)
        inputs = FieldInputs(
            views=PointViews(
                rgb=_read(maps.pictures, pixels / size),
                uv=(pixels / size).transpose(0, 1),
                dirs=directions_to_points(cameras, points),
                behind=behind,
                valid=valid,
            ),
            latents=latents,
            edge=edge,
            mirrored=maps.views.mirrored.to(points.dtype),
            section_places=places,
            section_lengths=half_lengths / network.box_half_extent,
            box_points=(points - network.box_centre) / network.box_half_extent,
            rotations=cameras.world_from_camera[:, :3, :3],
            kept=kept,
        )
        answer: FieldOutput = field(inputs, view_dirs)
        return answer

    def _kept(self, maps: PixelAligned, uv: Tensor) -> Tensor:
        """As the model: which share of the densities (P,) the drawings leave."""
        if maps.coverage is None or self.network.training:
            return torch.ones_like(uv[0, :, 0])
        return kept_share(_read(maps.coverage, uv[maps.carving])[..., 0])

    def _read_sections(self, maps: PixelAligned, points: Tensor) -> tuple[Tensor, Tensor]:
        if maps.sections is None:
            nothing = torch.zeros_like(points)
            return nothing, nothing
        return read_cross_sections(maps.sections, points)

    def _read_hull(
        self, maps: PixelAligned, uv: Tensor, depth: Tensor, points: Tensor
    ) -> tuple[Tensor, Tensor]:
        """As the model reads it: distance behind the hull's front and from the mask's edge, (P, V) each."""
        if maps.hull_maps is None:
            return torch.zeros_like(depth), torch.zeros_like(depth)
        front, edge = _read(maps.hull_maps, uv).unbind(-1)
        cameras = maps.views.cameras
        distance = (points[:, None] - cameras.world_from_camera[:, :3, 3]).norm(dim=-1)
        along = torch.where(cameras.orthographic, depth, distance)
        return (along - front) / self.network.box_half_extent, edge / cameras.width


def _read(maps: Tensor, uv: Tensor) -> Tensor:
    """Bilinear readings (P, V, C) of maps (V, C, h, w) at uv (V, P, 2), by the picture's sides."""
    grid = (2.0 * uv - 1.0)[:, :, None]
    read = F.grid_sample(maps, grid, mode="bilinear", padding_mode="border", align_corners=False)
    return (
        read[..., 0].permute(2, 0, 1).contiguous()
    )  # else each point gets a copy of the next linear layer's weights
