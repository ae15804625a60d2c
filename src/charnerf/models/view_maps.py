"""All that a character's views show, prepared once as rows, and read at points.

Letters: P points, V views, L latents. Everything that does not depend on the point (camera matrices, drawings on white, maps
of the hull) is computed here once a character instead of once a sample.
"""

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

from charnerf.geometry.cameras import directions_to_points, project_into_all
from charnerf.geometry.cross_sections import CrossSections, cross_sections, read_cross_sections
from charnerf.geometry.resizing import resized_pictures
from charnerf.models.inputs import FieldInputs, PointViews
from charnerf.models.lookup import bilinear_rows, first_pixels, maps_to_rows, read_rows
from charnerf.pictures import images_on_white
from charnerf.types import Cameras, Hull, MovableRecord, SourceViews


@dataclass(frozen=True)
class ViewMaps:
    """Drawings and hull maps of one character as rows, with its cameras and the box that coordinates are scaled by.

    Attributes:
        cameras: (V,).
        parallel: Whether every camera is orthographic: no perspective division, one direction a view.
        mirrored: (V,), 1 where the view is a mirrored one.
        map_size: Width and height of the feature maps.
        box_centre: Centre of the space looked at, (3,), m.
        box_half_extent: Half of its side, m.
        pictures: Rows (V * H * W, 3) of colour, then coverage where it is read, then the hull's maps where they have the pictures'
            size.
        carving: Indices of the views whose silhouettes carve: mirrored ones do not.
        shown: Whether the drawings that carve show anything at four pixels by their first one, (C, H - 1, W - 1) bool; None where
            coverage is not read.
        hull_rows: Rows (V * h * w, 2) of front depth and edge distance where they have another size; None without a hull or
            where they lie beside the colours.
        hull_size: Width and height of the hull's maps; zeros without a hull.
        sections: The hull's cross-sections, None where the model does not read them.
    """

    cameras: Cameras
    parallel: bool
    mirrored: Tensor
    map_size: tuple[int, int]
    box_centre: Tensor
    box_half_extent: float
    pictures: Tensor
    carving: Tensor
    shown: Tensor | None
    hull_rows: Tensor | None
    hull_size: tuple[int, int]
    sections: CrossSections | None

    @classmethod
    def of(
        cls,
        views: SourceViews,
        hull: Hull | None,
        present: Tensor,
        *,
        map_size: tuple[int, int],
        box_centre: Tensor,
        box_half_extent: float,
        sections: bool,
        coverage: bool,
    ) -> "ViewMaps":
        """Prepare present views (V, ...) and the maps that their hull keeps of them.

        Args:
            views: Views (V,), absent ones dropped.
            hull: The character's hull with maps of all views, or None.
            present: Indices of the views in the hull's maps, (V,).
            map_size: Width and height of the feature maps.
            box_centre: Of the space looked at, (3,), m.
            box_half_extent: Half of its side, m.
            sections: Whether to measure the hull's cross-sections.
            coverage: Whether to read the drawings' coverage, for `kept_share`.
        """
        pictures = images_on_white(views.images)
        carving, shown = (~views.mirrored).nonzero()[:, 0], None
        if coverage:
            dilations = None if hull is None else hull.dilations[present]
            alphas = widened_coverage(views.carving_alphas[:, None], dilations)
            pictures = torch.cat((pictures, alphas), dim=1)
            shown = F.max_pool2d(alphas[carving, 0], 2, stride=1) > 0.0
        pictures, rows, size = _with_hull_maps(pictures, hull, present)
        return cls(
            cameras=views.cameras,
            parallel=bool(views.cameras.orthographic.all()),
            mirrored=views.mirrored.to(pictures.dtype),
            map_size=map_size,
            box_centre=box_centre,
            box_half_extent=box_half_extent,
            pictures=maps_to_rows(pictures),
            carving=carving,
            shown=shown,
            hull_rows=rows,
            hull_size=size,
            sections=cross_sections(hull) if sections and hull is not None else None,
        )

    @property
    def colors(self) -> "Pictures":
        """The drawings' colours alone."""
        return Pictures(self.pictures[:, :3].contiguous(), (self.cameras.width, self.cameras.height))

    def read(self, points: Tensor, latents: Tensor) -> FieldInputs:
        """Read features (rows (V * h * w, L)), drawings and hull maps at points (P, 3)."""
        cameras, leading = self.cameras, (points.shape[0], self.cameras.shape[0])
        pixels, depth, in_front = project_into_all(cameras, points)
        size = pixels.new_tensor((cameras.width, cameras.height))
        valid = ((pixels >= 0) & (pixels <= size)).all(-1) & in_front
        scale = pixels.new_tensor(self.map_size) / size
        indices, weights = bilinear_rows(pixels * scale, width=self.map_size[0], height=self.map_size[1])
        read = read_rows(latents, indices, weights * valid.reshape(-1, 1))
        shown = read_rows(
            self.pictures, *bilinear_rows(pixels, width=cameras.width, height=cameras.height)
        ).unflatten(0, leading)
        uv = pixels / size
        directions, along_ray = self._directions(points, depth)
        behind, edge = self._hull_readings(uv, shown, along_ray)
        places, lengths = self._section_readings(points)
        return FieldInputs(
            views=PointViews(rgb=shown[..., :3], uv=uv, dirs=directions, behind=behind, valid=valid),
            latents=read.unflatten(0, leading),
            edge=edge,
            mirrored=self.mirrored,
            section_places=places,
            section_lengths=lengths,
            box_points=(points - self.box_centre) / self.box_half_extent,
            rotations=cameras.world_from_camera[:, :3, :3],
            kept=self._kept(points, shown, in_front),
        )

    def in_outlines(self, points: Tensor) -> Tensor:
        """Which points (P, 3) may have coverage in every drawing that carves, (P,) bool: `kept_share` of the others is 0."""
        assert self.shown is not None  # asked only where coverage is read
        pixels, _, in_front = project_into_all(self.cameras[self.carving], points)
        left, top, _, _ = first_pixels(pixels, width=self.cameras.width, height=self.cameras.height)
        view = torch.arange(len(self.shown), device=points.device)
        return (self.shown[view, top, left] | ~in_front).all(-1)

    def _kept(self, points: Tensor, shown: Tensor, in_front: Tensor) -> Tensor:
        """How much of the densities (P,) the drawings' coverage leaves, above 1 all; it has no say behind a camera."""
        if self.shown is None:
            return torch.ones_like(points[:, 0])
        coverage = torch.where(in_front, shown[..., 3], 1.0)
        return kept_share(coverage[:, self.carving])

    def _section_readings(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """Places of points (P, 3) in the hull's runs and the runs' half-lengths, (P, 3) each; zeros if they are not read."""
        if self.sections is None:
            nothing = torch.zeros_like(points)
            return nothing, nothing
        places, half_lengths = read_cross_sections(self.sections, points)
        return places, half_lengths / self.box_half_extent

    def _hull_readings(self, uv: Tensor, shown: Tensor, along_ray: Tensor) -> tuple[Tensor, Tensor]:
        """Distances behind the hull's front and from the mask's edge (P, V), read beside the colours or from rows of their own."""
        if self.hull_size == (0, 0):
            nothing = torch.zeros_like(along_ray)
            return nothing, nothing
        if self.hull_rows is None:
            front, edge = shown[..., -2], shown[..., -1]
        else:
            width, height = self.hull_size
            own = bilinear_rows(uv * uv.new_tensor(self.hull_size), width=width, height=height)
            front, edge = read_rows(self.hull_rows, *own).unflatten(0, shown.shape[:2]).unbind(-1)
        return (along_ray - front) / self.box_half_extent, edge / self.cameras.width

    def _directions(self, points: Tensor, depth: Tensor) -> tuple[Tensor, Tensor]:
        """Unit directions (P, V, 3) from the cameras to points, and distances along their rays (P, V)."""
        if self.parallel:
            axes = -self.cameras.world_from_camera[:, :3, 2]
            return axes.expand(points.shape[0], -1, -1), depth
        centres = self.cameras.world_from_camera[:, :3, 3]
        distance = (points[:, None] - centres).norm(dim=-1)
        along = torch.where(self.cameras.orthographic, depth, distance)
        return directions_to_points(self.cameras, points), along


@dataclass(frozen=True)
class Pictures(MovableRecord):
    """Drawings of one character on white as rows, for colours at their own resolution.

    Attributes:
        rows: (V * H * W, 3).
        size: W and H.
    """

    rows: Tensor
    size: tuple[int, int]

    @classmethod
    def of(cls, pictures: Tensor, width: int) -> "Pictures":
        """Pictures (V, 3, H, W), shrunk to a width where they are wider."""
        tall, wide = pictures.shape[-2:]
        if width < wide:
            pictures = resized_pictures(pictures, width, round(width * tall / wide))
        return cls(maps_to_rows(pictures), (pictures.shape[-1], pictures.shape[-2]))

    @property
    def images(self) -> Tensor:
        """The drawings, (V, 3, H, W)."""
        width, height = self.size
        return self.rows.reshape(-1, height, width, 3).permute(0, 3, 1, 2)

    def read(self, uv: Tensor) -> Tensor:
        """Colours (P, V, 3) at places (P, V, 2), by the sides."""
        width, height = self.size
        own = bilinear_rows(uv * uv.new_tensor(self.size), width=width, height=height)
        return read_rows(self.rows, *own).unflatten(0, uv.shape[:2])

    def read_planes(self, uv: Tensor) -> Tensor:
        """The same (V, 3, P) at places (V, 2, P)."""
        at = (2.0 * uv - 1.0).transpose(1, 2)[:, :, None]  # from -1 to 1
        read = F.grid_sample(self.images, at, mode="bilinear", padding_mode="border", align_corners=False)
        return read[..., 0]


def _with_hull_maps(
    pictures: Tensor, hull: Hull | None, present: Tensor
) -> tuple[Tensor, Tensor | None, tuple[int, int]]:
    """Pictures with the hull's maps as further channels, or those maps as rows where their size is another; and their size."""
    if hull is None:
        return pictures, None, (0, 0)
    maps = torch.stack((hull.front_depths[present], hull.edge_distances[present]), dim=1)
    size = (maps.shape[-1], maps.shape[-2])
    if maps.shape[-2:] == pictures.shape[-2:]:
        return torch.cat((pictures, maps.to(pictures.dtype)), dim=1), None, size
    return pictures, maps_to_rows(maps), size


def kept_share(coverage: Tensor) -> Tensor:
    """How much of the densities of points (P,) the drawings that carve leave, by their coverage (P, V) there; above 1 it is all.

    All of it inside of every outline, where pixels are covered by half or more; nothing where a drawing shows nothing at all.
    The hull, widened so that no surface is cut away, leaves room for figures to grow fat: a smooth field does.
    """
    return 2.0 * coverage.amin(-1)


def widened_coverage(alphas: Tensor, dilations: Tensor | None) -> Tensor:
    """Alphas (V, 1, H, W), those of drawings that disagree widened as the hull was, by its dilations (V,) beyond one pixel."""
    if dilations is None or not bool((dilations > 1.0).any()):
        return alphas
    widened = [
        F.max_pool2d(alpha, 2 * reach + 1, stride=1, padding=reach)
        for alpha, reach in zip(alphas, (dilations - 1.0).ceil().int().tolist(), strict=True)
    ]
    return torch.stack(widened)
