"""The visual hull: where a point may be, given the silhouettes of the drawings.

A cell of the grid is occupied if any part of it may project into every silhouette: the distance from the projected centre to the
silhouette is compared with the projected radius of the cell plus the dilation, so that no surface is ever cut away.
"""

import logging

import torch
from scipy import ndimage
from torch import Tensor

from charnerf.errors import DataError
from charnerf.geometry.cameras import pixel_centres, pixel_rays, project_into_all, world_axis_along
from charnerf.geometry.occupied import POOL, RAYS_AT_ONCE, candidates, coarse_occupancy, occupied_at
from charnerf.geometry.rays import box_interval
from charnerf.types import Cameras, Hull, RayBundle, SourceViews

log = logging.getLogger(__name__)

MASK_ALPHA = 0.05  # a pixel that is covered this much belongs to the silhouette
WIDEST_DILATION = 32.0  # pixels; drawings that disagree by more are not of one character
FIRST_HIT_STEPS = 192
MAP_SIZE = 128  # pixels a side, at most, of the front-depth and edge-distance maps
ROUNDING = 2.0**0.5  # pixels by which distances read at two pixels' centres may be off, at most


def build_hull(
    views: SourceViews,
    *,
    box_min: Tensor,
    box_max: Tensor,
    grid_size: int = 128,
    dilation: float = 1.0,
    coverage: float = 0.995,
) -> Hull:
    """Carve the hulls of a batch of characters from the silhouettes of their source views.

    Mirrored views carve nothing (that a character is symmetric is a guess); they get their maps. Views that were reconciled
    say by `widened_alphas` how far each may be off, row by row: such silhouettes are not widened any further.

    Args:
        views: Source views (B, V).
        box_min: Lower corner of the space looked at, (3,), m.
        box_max: Upper corner, (3,), m.
        grid_size: Cells a side, a power of two of at least 32.
        dilation: Pixels by which silhouettes are widened.
        coverage: Share of each silhouette that the hull, seen from its view, must cover; where the drawings disagree so much that
            it does not, the dilation is doubled until it does, and that is logged.

    Returns:
        Hulls (B).

    Raises:
        DataError: If a source view shows nothing, or no dilation up to 32 pixels reaches the coverage.
    """
    hulls = [
        _carve(views[b], box_min, box_max, grid_size, dilation, coverage)
        for b in range(views.present.shape[0])
    ]
    return Hull(
        *(
            torch.stack([getattr(hull, name) for hull in hulls])
            for name in ("occupancy", "box_min", "box_max", "front_depths", "edge_distances", "dilations")
        )
    )


def hull_contains(hull: Hull, points: Tensor) -> Tensor:
    """Whether points (..., 3) lie in occupied cells of one character's hull, (...) bool."""
    cells = hull.occupancy.shape[0]
    scaled = (points - hull.box_min) * (cells / (hull.box_max - hull.box_min))
    inside = ((scaled >= 0) & (scaled < cells)).all(-1)
    index = scaled.clamp(0, cells - 1).long()
    flat = (index[..., 0] * cells + index[..., 1]) * cells + index[..., 2]
    return inside & hull.occupancy.reshape(-1).index_select(0, flat.reshape(-1)).view(flat.shape)


def occupied_edges(
    hull: Hull, rays: RayBundle, num_steps: int, coarse: Tensor | None = None
) -> tuple[Tensor, Tensor]:
    """Divide rays inside the hull's box into equal steps and say which are occupied.

    Rays that pass by every pooled cell of the hull are not looked up step by step.

    Args:
        hull: One character's hull.
        rays: Rays (R,).
        num_steps: Steps a ray, N.
        coarse: Its `coarse_occupancy`, computed here if not given.

    Returns:
        t_edges (R, N + 1), m, and occupied (R, N), bool, by the steps' midpoints.
    """
    near, far = box_interval(rays, hull.box_min, hull.box_max)
    share = torch.linspace(0.0, 1.0, num_steps + 1, dtype=near.dtype, device=near.device)
    t_edges = near[:, None] + (far - near)[:, None] * share
    if hull.occupancy.shape[0] % POOL:
        index = torch.arange(len(near), device=near.device)
    else:
        index = candidates(hull, coarse_occupancy(hull.occupancy) if coarse is None else coarse, rays).index
    occupied = torch.zeros(len(near), num_steps, dtype=torch.bool, device=near.device)
    for some in index.split(RAYS_AT_ONCE):
        edges = t_edges[some]
        found = occupied_at(hull.occupancy, hull, rays[some], 0.5 * (edges[:, 1:] + edges[:, :-1]))
        occupied[some] = found & (far > near)[some, None]
    return t_edges, occupied


def _carve(
    views: SourceViews, box_min: Tensor, box_max: Tensor, grid_size: int, dilation: float, coverage: float
) -> Hull:
    """Carve one character (views without the B axis)."""
    masks, limits = views.images[:, 3] > MASK_ALPHA, views.carving_alphas > MASK_ALPHA
    if views.widened_alphas is not None:
        coverage = 0.0
    carving = (views.present & ~views.mirrored).nonzero()[:, 0].tolist()
    for view in carving:
        if not bool(limits[view].any()):
            raise DataError(
                f"source view {view}: found an empty silhouette (alpha is 0 everywhere), expected a figure."
            )
    outside = torch.stack([_distance_to(limit) for limit in limits])
    dilations = torch.full((len(masks),), float(dilation), device=masks.device)
    while True:
        radii = dilations[carving]
        low, high = _tight_box(outside[carving], views.cameras[carving], radii, box_min, box_max)
        occupancy = _occupancy(outside[carving], views.cameras[carving], radii, low, high, grid_size)
        hull = Hull(occupancy, low, high, outside, outside, dilations)
        missed = [view for view in carving if _covered(hull, views.cameras[view], masks[view]) < coverage]
        if not missed:
            break
        if float(dilations.max()) >= WIDEST_DILATION:
            if bool((low <= box_min).logical_or(high >= box_max)[:2].any()):
                reach = 0.5 * float((box_max - box_min)[0])
                raise DataError(
                    f"source views {missed}: found a figure of 2 m that reaches the sides of the space looked at, expected "
                    f"one within {reach:.1f} m of its axis. Lower its arms or wings, or train with a larger "
                    "model.box_half_extent."
                )
            raise DataError(
                f"source views {missed}: found drawings whose silhouettes disagree by more than {WIDEST_DILATION:.0f} pixels, "
                "expected views of one character at one height on one floor line, each from where it is named. Were the files given"
                " in another order than front, side, back? Else align them, or set model.hull=false."
            )
        dilations = torch.where(dilations > 0, 2.0 * dilations, torch.ones_like(dilations))
        log.warning("Drawings disagree: the hull misses parts of source views %s; silhouettes widened to %.0f pixels.",
                    missed, float(dilations.max()))  # fmt: skip
    if views.widened_alphas is not None:
        outside = torch.stack([_distance_to(mask) for mask in masks])
    fronts, edges = _view_maps(hull, views.cameras, masks, outside)
    return Hull(occupancy, low, high, fronts, edges, dilations)


def _distance_to(mask: Tensor) -> Tensor:
    """Distance of each pixel to the nearest pixel of the mask, (H, W), pixels; 0 inside."""
    distance = ndimage.distance_transform_edt(~mask.cpu().numpy())
    return torch.from_numpy(distance).to(mask.device, torch.float32)


def _may_touch(
    outside: Tensor, cameras: Cameras, dilations: Tensor, centres: Tensor, radius: Tensor
) -> Tensor:
    """Whether balls around centres (P, 3) of a radius, m, may project into every dilated silhouette, (P,) bool."""
    height, width = outside.shape[-2:]
    keep = torch.arange(len(centres), device=centres.device)
    for view in range(len(outside)):
        pixels, depth, in_front = project_into_all(cameras[view : view + 1], centres[keep])
        pixels, depth, in_front = pixels[:, 0], depth[:, 0], in_front[:, 0]
        clamped = torch.stack(
            (pixels[:, 0].clamp(0, width - 1e-3), pixels[:, 1].clamp(0, height - 1e-3)), dim=-1
        )
        x, y = clamped.long().unbind(-1)
        nearest = outside[view, y, x]
        # beyond the frame nothing is known where the figure touches the border, and all is background elsewhere
        distance = nearest + torch.where(nearest > 0, (pixels - clamped).norm(dim=-1), 0.0)
        shrink = torch.where(cameras.orthographic[view], 1.0, 1.0 / (depth - radius).clamp_min(1e-3))
        reach = cameras.focal[view].amax() * radius * shrink + dilations[view]
        keep = keep[(distance <= reach) | ~in_front | ((depth <= radius) & ~cameras.orthographic[view])]
    touched = torch.zeros(len(centres), dtype=torch.bool, device=centres.device)
    touched[keep] = True
    return touched


def _occupancy(
    outside: Tensor, cameras: Cameras, dilations: Tensor, low: Tensor, high: Tensor, grid_size: int
) -> Tensor:
    """Occupied cells of a grid over a box.

    A view along an axis of the world, as drawings are, is asked about one layer of cells: all others project like it.
    """
    occupancy = torch.ones(grid_size, grid_size, grid_size, dtype=torch.bool, device=low.device)
    ends, others = torch.stack((low, high)), []
    for view in range(len(outside)):
        along = world_axis_along(cameras[view], ends)
        if along is None:
            others.append(view)
        else:
            one = slice(view, view + 1)
            occupancy &= _touched_layer(
                outside[one], cameras[one], dilations[one], low, high, grid_size, along
            )
    if not others:
        return occupancy
    return _refined(outside[others], cameras[others], dilations[others], low, high, occupancy)


def _touched_layer(
    outside: Tensor,
    camera: Cameras,
    dilation: Tensor,
    low: Tensor,
    high: Tensor,
    grid_size: int,
    along: int,
) -> Tensor:
    """Cells of the middle layer that may project into one view's dilated silhouette, one cell thick along the axis seen along."""
    cell = (high - low) / grid_size
    axes = [
        low[axis] + (torch.arange(grid_size, dtype=low.dtype, device=low.device) + 0.5) * cell[axis]
        for axis in range(3)
    ]
    axes[along] = 0.5 * (low + high)[along : along + 1]
    centres = torch.stack(torch.meshgrid(*axes, indexing="ij"), dim=-1)
    touched = _may_touch(outside, camera, dilation, centres.reshape(-1, 3), 0.5 * cell.norm())
    return touched.view(centres.shape[:3])


def _refined(
    outside: Tensor, cameras: Cameras, dilations: Tensor, low: Tensor, high: Tensor, left: Tensor
) -> Tensor:
    """The cells left that views touch, coarse to fine: a cell that no silhouette touches has no child that any does."""
    grid_size = left.shape[0]
    side = min(32, grid_size)
    axis = torch.arange(side, device=low.device)
    index = torch.stack(torch.meshgrid(axis, axis, axis, indexing="ij"), dim=-1).reshape(-1, 3)
    octants = torch.stack(
        torch.meshgrid(*[torch.arange(2, device=low.device)] * 3, indexing="ij"), dim=-1
    ).reshape(1, 8, 3)
    while True:
        pooled = left.view(*[side, grid_size // side] * 3).any(1).any(2).any(3)
        index = index[pooled[index[:, 0], index[:, 1], index[:, 2]]]
        cell = (high - low) / side
        centres = low + (index + 0.5) * cell
        is_last = side >= grid_size
        margins = dilations if is_last else dilations + ROUNDING  # no child is lost to the rounding to pixels
        index = index[_may_touch(outside, cameras, margins, centres, 0.5 * cell.norm())]
        if is_last:
            break
        index = (2 * index[:, None] + octants).reshape(-1, 3)
        side *= 2
    occupancy = torch.zeros_like(left)
    occupancy[index[:, 0], index[:, 1], index[:, 2]] = True
    return occupancy


def _tight_box(
    outside: Tensor, cameras: Cameras, dilations: Tensor, box_min: Tensor, box_max: Tensor
) -> tuple[Tensor, Tensor]:
    """Bounding box of what a coarse carving of the whole space leaves."""
    coarse = _occupancy(outside, cameras, dilations, box_min, box_max, 64)
    index = coarse.nonzero()
    if len(index) == 0:
        return box_min.clone(), box_max.clone()
    cell = (box_max - box_min) / coarse.shape[0]
    return box_min + index.amin(0) * cell, box_min + (index.amax(0) + 1) * cell


def _first_hits(hull: Hull, rays: RayBundle) -> tuple[Tensor, Tensor]:
    """Distance to the first occupied step, (R,), m, and whether there is one."""
    t_edges, occupied = occupied_edges(hull, rays, FIRST_HIT_STEPS)
    first = occupied.to(torch.uint8).argmax(-1, keepdim=True)
    return torch.gather(t_edges, -1, first)[:, 0], occupied.any(-1)


def _covered(hull: Hull, camera: Cameras, mask: Tensor) -> float:
    """Share of a mask's pixels whose rays meet the hull."""
    y, x = mask.nonzero().unbind(-1)
    step = max(1, len(x) // 4096)  # a few thousand pixels settle a share of 0.995
    pixels = torch.stack((x[::step] + 0.5, y[::step] + 0.5), dim=-1).to(camera.focal.dtype)
    _, hit = _first_hits(hull, pixel_rays(camera, pixels))
    return float(hit.float().mean())


def _view_maps(hull: Hull, cameras: Cameras, masks: Tensor, outside: Tensor) -> tuple[Tensor, Tensor]:
    """Front depths, m, and signed edge distances, pixels, of all views, (V, h, w) each."""
    height, width = masks.shape[-2:]
    stride = max(1, -(-max(height, width) // MAP_SIZE))
    pixels = pixel_centres(width, height, device=masks.device)[stride // 2 :: stride, stride // 2 :: stride]
    centre = 0.5 * (hull.box_min + hull.box_max)
    fronts, edges = [], []
    for view in range(len(masks)):
        camera = cameras[view]
        t, hit = _first_hits(hull, pixel_rays(camera, pixels.reshape(-1, 2).to(camera.focal.dtype)))
        beyond = (camera.world_from_camera[:3, 3] - centre).norm()
        fronts.append(torch.where(hit, t, beyond).reshape(pixels.shape[:2]))
        inside = torch.from_numpy(ndimage.distance_transform_edt(masks[view].cpu().numpy()))
        signed = inside.to(outside) - outside[view]
        edges.append(signed[stride // 2 :: stride, stride // 2 :: stride])
    return torch.stack(fronts), torch.stack(edges)
