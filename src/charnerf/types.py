"""Frozen records that travel between the parts: fields, moves and indexing; no maths.

Letters: B characters, V source views, R rays, S samples a ray, P points, H W image height and width, G
grid cells a side.
Frames (design): world in metres, +Z up, facing -Y; cameras OpenGL/Blender (+X right, +Y up, look along -Z).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import torch
from torch import Tensor


class MovableRecord:
    """Moving for frozen dataclasses with tensor fields; records among the fields move along."""

    def _map(self, function: Callable[[Any], Any]) -> Self:
        changed: dict[str, Any] = {
            field.name: function(value)
            for field in fields(self)  # type: ignore[arg-type]
            if isinstance(value := getattr(self, field.name), Tensor | MovableRecord)
        }
        return replace(self, **changed)  # type: ignore[type-var]

    def to(self, *args: Any, **kwargs: Any) -> Self:
        """Return a copy whose tensors went through `Tensor.to`; a dtype converts floating tensors only."""
        dtype = kwargs.get("dtype", next((a for a in args if isinstance(a, torch.dtype)), None))

        def move(value: Any) -> Any:
            if isinstance(value, Tensor) and dtype is not None and not value.is_floating_point():
                others = {k: v for k, v in kwargs.items() if k != "dtype"}
                rest = [a for a in args if not isinstance(a, torch.dtype)]
                return value.to(*rest, **others) if rest or others else value
            return value.to(*args, **kwargs)

        return self._map(move)

    def pin_memory(self) -> Self:
        """Return a copy in page-locked memory, from where a GPU fetches while it computes."""
        return self._map(lambda value: value.pin_memory())


class TensorRecord(MovableRecord):
    """Moving and indexing for frozen dataclasses whose tensor fields share their leading axes."""

    def __getitem__(self, index: Any) -> Self:
        """Index the shared leading axes of every tensor field."""
        return self._map(lambda value: value[index])

    def rows(self, index: Tensor) -> Self:
        """Rows of the first axis by their numbers (N,), none of them negative: a third of the time of indexing."""
        return self._map(
            lambda value: (
                value.rows(index) if isinstance(value, TensorRecord) else value.index_select(0, index)
            )
        )

    @classmethod
    def joined(cls, records: Sequence[Self]) -> Self:
        """Concatenate records along the first axis; fields that are no tensors are those of the first."""
        first = records[0]
        if len(records) == 1:
            return first
        changed: dict[str, Any] = {}
        for field in fields(first):  # type: ignore[arg-type]
            value, others = getattr(first, field.name), [getattr(one, field.name) for one in records]
            if isinstance(value, Tensor):
                changed[field.name] = torch.cat(others)
            elif isinstance(value, TensorRecord):
                changed[field.name] = type(value).joined(others)
        return replace(first, **changed)  # type: ignore[type-var]


@dataclass(frozen=True)
class Cameras(TensorRecord):
    """Pinhole and orthographic cameras.

    Attributes:
        world_from_camera: Poses, (..., 4, 4): `x_world = world_from_camera @ x_camera`.
        focal: (..., 2), pixels; of an orthographic camera pixels per metre.
        principal_point: (..., 2), pixels; the image spans [0, width] x [0, height], pixel centres at +0.5.
        orthographic: (...), bool.
        width: Image width, pixels, of all of them.
        height: Image height, pixels.
    """

    world_from_camera: Tensor
    focal: Tensor
    principal_point: Tensor
    orthographic: Tensor
    width: int
    height: int

    @property
    def shape(self) -> torch.Size:
        """Leading shape of the batch of cameras."""
        return self.orthographic.shape


@dataclass(frozen=True)
class RayBundle(TensorRecord):
    """Rays: origins (..., 3) in metres and unit directions (..., 3), from the camera into the scene."""

    origins: Tensor
    directions: Tensor


@dataclass(frozen=True)
class SourceViews(TensorRecord):
    """The drawings that the model conditions on.

    Attributes:
        images: (B, V, 4, H, W), RGBA in [0, 1], sRGB-encoded, straight alpha.
        cameras: Cameras of shape (B, V).
        present: (B, V), bool; False pads characters that have fewer views than their batch.
        mirrored: (B, V), bool; True marks a view made by mirroring another one.
        widened_alphas: (B, V, H, W), in [0, 1], or None: where the figure may be although a view does not show it there, as
            drawings that disagree need it; all 1 for a view that only colours.
    """

    images: Tensor
    cameras: Cameras
    present: Tensor
    mirrored: Tensor
    widened_alphas: Tensor | None = None

    @property
    def carving_alphas(self) -> Tensor:
        """What hulls are carved from, (B, V, H, W): the pictures' alphas, widened where they were."""
        return self.images[..., 3, :, :] if self.widened_alphas is None else self.widened_alphas


@dataclass(frozen=True)
class SurfacePoints(TensorRecord):
    """Points on the surface of the captured mesh: points (B, P, 3) in metres, rgb (B, P, 3) in [0, 1]."""

    points: Tensor
    rgb: Tensor


@dataclass(frozen=True)
class SpacePoints(TensorRecord):
    """Points in space, (B, P, 3), m, and whether they are inside the character, (B, P), 1 or 0."""

    points: Tensor
    inside: Tensor


@dataclass(frozen=True)
class Hull(TensorRecord):
    """Visual hulls as occupancy grids; outside of them the model's density is zero by definition.

    Attributes:
        occupancy: (B, G, G, G), bool, indexed x, y, z.
        box_min: (B, 3), metres, lower corner of the grid.
        box_max: (B, 3), metres, upper corner.
        front_depths: (B, V, H, W), metres along the source camera's ray to the first occupied cell;
            NaN-free: where the ray
            misses, the depth of the box's centre.
        edge_distances: (B, V, H, W), pixels from the mask's edge: positive inside, negative outside.
        dilations: (B, V), pixels by which each mask was dilated (widened further where the drawings
            disagree).
    """

    occupancy: Tensor
    box_min: Tensor
    box_max: Tensor
    front_depths: Tensor
    edge_distances: Tensor
    dilations: Tensor


@dataclass(frozen=True)
class FieldOutput(TensorRecord):
    """What a radiance field answers: rgb (..., 3) in [0, 1] and densities (...) in 1/m, non-negative."""

    rgb: Tensor
    densities: Tensor


@dataclass(frozen=True)
class RenderOutput(TensorRecord):
    """What volume rendering gives for rays (...).

    Attributes:
        rgb: (..., 3), composited on the background.
        opacity: (...), sum of the weights, in [0, 1].
        depth: (...), metres along the ray: expected distance, of the seen part; far where nothing is seen.
    """

    rgb: Tensor
    opacity: Tensor
    depth: Tensor


@dataclass(frozen=True)
class LeftOut:
    """Work that was not done, as counts: rays, samples and grid cells, of how many."""

    rays: int = 0
    rays_of: int = 0
    samples: int = 0
    samples_of: int = 0
    grid_cells: int = 0
    grid_cells_of: int = 0

    def __add__(self, other: LeftOut) -> LeftOut:
        """Add the counts of two pieces of work."""
        return LeftOut(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))

    def shares(self) -> dict[str, float | None]:
        """Shares left out by kind, None where there was nothing of the kind."""
        pairs = {
            "rays": (self.rays, self.rays_of),
            "samples": (self.samples, self.samples_of),
            "grid_cells": (self.grid_cells, self.grid_cells_of),
        }
        return {name: (part / whole if whole else None) for name, (part, whole) in pairs.items()}


@dataclass(frozen=True)
class ErrorEstimate:
    """What error an adaptive renderer was allowed, what it believes to have made, and what it did.

    Attributes:
        tolerance: Largest error of a colour that was allowed.
        estimated: Estimated error of each ray's colour, (...).
        num_samples: Densities evaluated.
        num_colors: Colours evaluated.
        num_stopped: Rays whose far part was left out because what lies before is opaque.
        num_unresolved: Rays whose estimate stayed above the tolerance.
    """

    tolerance: float
    estimated: Tensor
    num_samples: int
    num_colors: int
    num_stopped: int
    num_unresolved: int


@dataclass(frozen=True)
class Rendering:
    """A rendering by the finest pass, the coarse pass where there were two, what was left out, and what error that made.

    The estimate is None of renderers that make no error of their own.
    """

    finest: RenderOutput
    coarse: RenderOutput | None
    left_out: LeftOut
    estimate: ErrorEstimate | None = None


@dataclass(frozen=True)
class TrainBatch(MovableRecord):
    """One training step's material.

    Attributes:
        names: The B characters.
        views: Their drawings, (B, V).
        hull: Their hulls, or None for a model without.
        rays: Target rays (B, R).
        rgb: Their colours on white, (B, R, 3).
        alpha: Their alpha, (B, R).
        square: Side S of a square of neighbouring pixels, which the first S * S rays of each character are, row by row; 0 without.
        depth: Distance along the ray to the surface, (B, R), m, 0 where there is none; None where no loss
            reads it.
        surface: Points on the surface, or None where no loss reads them or a character has no mesh.
        space: Points in the hull labelled inside or outside by the silhouettes, or None where no loss
            reads them.
        phase: Index of the schedule's phase.
        loss_weights: Weights that the phase overrides, by term.
        step: Index of the batch, from 0.
        seeds: Of what renderer and loss draw for each of the B characters.
    """

    names: tuple[str, ...]
    views: SourceViews
    hull: Hull | None
    rays: RayBundle
    rgb: Tensor
    alpha: Tensor
    square: int
    depth: Tensor | None
    surface: SurfacePoints | None
    space: SpacePoints | None
    phase: int
    loss_weights: Mapping[str, float]
    step: int
    seeds: tuple[int, ...]
