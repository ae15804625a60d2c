"""Evaluates as little as a tolerance allows, like an adaptive integrator, and says what error it made.

Letters: R rays, K bins a ray, P points. For each ray: bins on the hull's segments; densities front to back
until nothing behind can be seen; colours only of samples that count; an estimate of the error of every bin;
bins with large errors cut into three, their samples kept, until the estimate is below the tolerance.

These are many small operations, which cost as much of few rays as of many. Few rays take the culled renderer's samples, as many as
the tolerance asks for, and those whose samples tell of a larger error take three times as many.
"""

import math
from dataclasses import dataclass
from typing import final

import torch
from torch import Tensor

from charnerf.geometry.bounds import Bounds
from charnerf.geometry.occupied import candidates, occupied_at, segment_bins
from charnerf.geometry.rays import OccupiedLength, box_interval
from charnerf.scene import Scene
from charnerf.types import (
    ErrorEstimate,
    LeftOut,
    RayBundle,
    Rendering,
    RenderOutput,
)
from charnerf.volume.compositing import expected_depth
from charnerf.volume.marching import OccupiedRays, coarse_samples, points_in_memory
from charnerf.volume.quadrature.base import AbstractQuadrature
from charnerf.volume.renderers.base import WHITE, AbstractRenderer
from charnerf.volume.renderers.culled import CulledRenderer
from charnerf.volume.renderers.refinement import (
    error_of_equal_bins,
    heavy_weights,
    light_before,
    march,
    split_bins,
)
from charnerf.volume.renderers.samples import Samples

SPACING = 0.03  # m: longest bin at the start; no feature of a field read from drawings is much thinner
MAX_BINS = 128  # of a ray at the start
UNSEEN_SHARE = 0.2  # of the tolerance: light that may be left behind an opaque surface
COLORLESS_SHARE = 0.15  # of the tolerance: light whose colour need not be evaluated
NUM_SPLIT, MAX_ROUNDS = 6, 3  # bins cut a ray and round, and rounds
RAYS_AT_ONCE = 4096
FEW_RAYS = 512  # that take the culled renderer's samples
USUAL_TOLERANCE = 0.05
FEW_SAMPLES = 1.5  # times the culled renderer's at that tolerance: errors fall with their square
MOST_SAMPLES = 4.0  # times that of any tolerance, before rays are refined
MOST_TRIPLED = 2  # times that a ray's samples are tripled
POINTS_A_STAGE = 2048  # front to back; fewer would save samples and cost calls
LAST_STAGE = 4096  # points that are no longer worth a further stage


@final
class AdaptiveRenderer(AbstractRenderer):
    """Chooses samples for each ray by an estimate of the error.

    Only the finest field is asked. Training (with a generator, or where gradients are kept) renders as the
    culled renderer: the samples must not depend on what is being learnt.

    Args:
        quadrature: As the culled renderer; used in training.
        num_coarse: As the culled renderer; the count that what is left out is compared with.
        num_fine: As the culled renderer.
        hull_steps: Steps in which the occupied part of a ray is looked up.
        memory_mib: Bound on what is held at once, MiB.
        tolerance: Largest error of a colour that is allowed, in [0, 1].
    """

    def __init__(
        self,
        *,
        quadrature: AbstractQuadrature,
        num_coarse: int,
        num_fine: int,
        hull_steps: int,
        memory_mib: float,
        tolerance: float,
    ) -> None:
        super().__init__(
            quadrature=quadrature,
            num_coarse=num_coarse,
            num_fine=num_fine,
            hull_steps=hull_steps,
            memory_mib=memory_mib,
        )
        self.tolerance = tolerance
        self._culled = CulledRenderer(**self.settings)
        looser = tolerance / USUAL_TOLERANCE
        # m in the hull: more is worth bins of segments
        self._longest = SPACING * num_coarse * min(max(looser, 1.0), 2.0)
        samples = num_coarse * min(FEW_SAMPLES / math.sqrt(max(looser, 1e-6)), MOST_SAMPLES)
        first = 3 * max(1, round(samples / 3.0))
        self._tripling = [
            CulledRenderer(**{**self.settings, "num_coarse": first * 3**times})
            for times in range(MOST_TRIPLED + 1)
        ]

    def render(self, scene: Scene, rays: RayBundle, generator: torch.Generator | None = None) -> Rendering:
        """Render rays (R,) to the tolerance; with a generator or gradients as the culled renderer."""
        if generator is not None or torch.is_grad_enabled():
            return self._culled.render(scene, rays, generator)
        index, near, far = _candidates(scene.bounds, rays)
        block = max(64, min(RAYS_AT_ONCE, points_in_memory(scene.field, self.memory_mib) // 4))
        with torch.inference_mode():  # spares small operations a tenth; what is returned is made outside
            blocks = [
                self._render_block(scene, rays[index[i : i + block]], near[i : i + block], far[i : i + block])
                for i in range(0, len(index), block)
            ]
        return self._gathered(blocks, index, rays)

    def _render_block(self, scene: Scene, rays: RayBundle, near: Tensor, far: Tensor) -> "_Block":
        """Render some rays (R,) between near and far (R,), m."""
        if len(near) <= FEW_RAYS:
            seen = self.occupied(scene, rays)
            if float(seen.length.mean()) <= self._longest:
                return self._render_few(scene, seen)
        t_edges, occupied = _steps(scene.bounds, rays, near, far, self.hull_steps)
        along = OccupiedLength.of(t_edges, occupied)
        samples = Samples(scene, rays, self._chunk(scene.field))
        s_edges, begins = segment_bins(occupied, t_edges.diff(dim=-1), SPACING, MAX_BINS)
        widths, t_vals = s_edges.diff(dim=-1), along.t_vals(_middles(s_edges))
        bins = _Bins(begins, widths, t_vals, self._first_samples(samples, t_vals, widths))
        block = _Block.empty(far)
        rows = torch.arange(len(near), device=near.device)
        for round_ in range(MAX_ROUNDS + 1):
            done, errors = self._compose(block, samples, rows, bins, last=round_ == MAX_ROUNDS)
            left = (~done).nonzero()[:, 0]
            if len(left) == 0:
                break
            rows, along = rows[left], along[left]
            split = split_bins(
                s_edges[left], begins[left], errors[left], NUM_SPLIT, 0.1 * self.tolerance / NUM_SPLIT
            )
            kept = torch.where(split.source >= 0, bins.numbers[left].gather(1, split.source.clamp_min(0)), -1)
            s_edges, begins = split.s_edges, split.begins
            widths, t_vals = s_edges.diff(dim=-1), along.t_vals(_middles(s_edges))
            wanted = (split.source < 0) & (widths > 0)
            bins = _Bins(begins, widths, t_vals, torch.where(wanted, samples.add(rows, t_vals, wanted), kept))
        block.num_samples, block.num_colors = samples.num_evaluated, samples.num_colors
        return block

    def _render_few(self, scene: Scene, seen: OccupiedRays) -> "_Block":
        """Render rays (R,) by the culled renderer's samples, three times as many where they do not do."""
        block = _Block.empty(seen.far)
        rows = (seen.length > 0).nonzero()[:, 0]
        for renderer in self._tripling:
            if len(rows) == 0:
                break
            some = seen.rows(rows)
            placed = coarse_samples(scene.bounds, some, renderer.num_coarse)
            answer, evaluated = renderer.evaluate(scene.field, placed)
            output = self._composed(answer, placed, some.far)
            estimated = error_of_equal_bins(self.quadrature, answer, placed, output.rgb, WHITE)
            block.note(rows, output, estimated)
            block.num_samples, block.num_colors = block.num_samples + evaluated, block.num_colors + evaluated
            rows = rows[estimated > self.tolerance]
        return block

    def _first_samples(self, samples: Samples, t_vals: Tensor, widths: Tensor) -> Tensor:
        """Evaluate the middles of bins (R, K), so wide, front to back, until what lies behind can not be seen; numbers (R, K)."""
        numbers = torch.full_like(widths, -1, dtype=torch.long)
        light = torch.ones_like(widths[:, 0])
        start = 0
        while start < widths.shape[1]:
            rows = (light > UNSEEN_SHARE * self.tolerance).nonzero()[:, 0]
            if len(rows) == 0:
                break
            columns = slice(start, start + _columns_of_stage(widths[rows, start:] > 0))
            some = widths[rows, columns]
            if not bool((some > 0).any()):
                break
            added = samples.add(rows, t_vals[rows, columns], some > 0)
            numbers[rows, columns] = added
            light[rows] *= torch.exp(-(samples.densities(added) * some).sum(-1))
            start = columns.stop
        return numbers

    def _compose(
        self, block: "_Block", samples: Samples, rows: Tensor, bins: "_Bins", *, last: bool
    ) -> tuple[Tensor, Tensor]:
        """Composite rays by row, note those that are accurate enough, (r,) bool, and answer the errors of bins (r, K)."""
        numbers, widths = bins.numbers, bins.widths
        densities = samples.densities(numbers)
        before, after = light_before(densities * widths)
        wanted = (numbers >= 0) & heavy_weights(before - after, COLORLESS_SHARE * self.tolerance)
        rgb, colored = samples.colors(numbers, wanted)
        marched = march(densities, rgb, colored, widths, bins.begins, WHITE)
        stopped = ((numbers < 0) & (widths > 0)).any(-1)
        left = torch.where(stopped, after[:, -1], 0.0)
        estimated = marched.errors.square().sum(-1).sqrt() + marched.unseen + left
        done = (estimated <= self.tolerance) | last
        finished = done.nonzero()[:, 0]
        weights = marched.weights[finished]
        output = RenderOutput(
            rgb=marched.rgb[finished],
            opacity=marched.opacity[finished],
            depth=expected_depth(weights, bins.t_vals[finished], block.far[rows[finished]]),
        )
        block.note(rows[finished], output, estimated[finished], stopped[finished])
        return done, marched.errors

    def _gathered(self, blocks: list["_Block"], index: Tensor, rays: RayBundle) -> Rendering:
        """Put blocks of candidate rays back among all rays (R,)."""
        num_rays, device = rays.origins.shape[0], rays.origins.device
        nothing = rays.origins.new_zeros(num_rays)
        rgb, opacity, estimated = rays.origins.new_full((num_rays, 3), WHITE), nothing, nothing.clone()
        depth = torch.full((num_rays,), float("nan"), device=device, dtype=nothing.dtype)
        if blocks:
            join = lambda name: torch.cat([getattr(block, name) for block in blocks])  # noqa: E731
            rgb[index], opacity[index] = join("rgb"), join("opacity")
            depth[index], estimated[index] = join("depth"), join("estimated")
        evaluated = sum(block.num_samples for block in blocks)
        total = max(evaluated, num_rays * self.num_coarse)
        used = sum(int(block.used.sum()) for block in blocks)
        return Rendering(
            finest=RenderOutput(rgb=rgb, opacity=opacity, depth=depth),
            coarse=None,
            left_out=LeftOut(
                rays=num_rays - used, rays_of=num_rays, samples=total - evaluated, samples_of=total
            ),
            estimate=ErrorEstimate(
                tolerance=self.tolerance,
                estimated=estimated,
                num_samples=evaluated,
                num_colors=sum(block.num_colors for block in blocks),
                num_stopped=sum(int(block.stopped.sum()) for block in blocks),
                num_unresolved=int((estimated > self.tolerance).sum()),
            ),
        )


def _steps(
    bounds: Bounds, rays: RayBundle, near: Tensor, far: Tensor, num_steps: int
) -> tuple[Tensor, Tensor]:
    """Steps between near and far (R,), m: their edges (R, N + 1), m, and which are occupied (R, N)."""
    hull = bounds.hull
    if hull is None:
        return torch.stack((near, far), dim=-1), torch.ones_like(near[:, None], dtype=torch.bool)
    share = torch.linspace(0.0, 1.0, num_steps + 1, dtype=near.dtype, device=near.device)
    t_edges = torch.addcmul(near[:, None], (far - near)[:, None], share)
    return t_edges, occupied_at(hull.occupancy, hull, rays, 0.5 * (t_edges[:, 1:] + t_edges[:, :-1]))


def _candidates(bounds: Bounds, rays: RayBundle) -> tuple[Tensor, Tensor, Tensor]:
    """Rays (R,) that may meet something: index, near and far."""
    if bounds.hull is not None and bounds.coarse_hull is not None:
        met = candidates(bounds.hull, bounds.coarse_hull, rays)
        return met.index, met.near, met.far
    near, far = box_interval(rays, *bounds.tight_box)
    index = (far > near).nonzero()[:, 0]
    return index, near[index], far[index]


def _columns_of_stage(there: Tensor) -> int:
    """How many columns of bins that are there (r, K), bool, are evaluated next: all, or as many as have POINTS_A_STAGE."""
    up_to = there.sum(0).cumsum(0)
    if int(up_to[-1]) <= LAST_STAGE:
        return len(up_to)
    return max(4, int(torch.searchsorted(up_to, POINTS_A_STAGE)))


def _middles(s_edges: Tensor) -> Tensor:
    return 0.5 * (s_edges[:, 1:] + s_edges[:, :-1])


@dataclass(frozen=True)
class _Bins:
    """Bins of rays: which begin a segment (R, K), how wide they are, m, where their middles lie, m, and their samples' numbers."""

    begins: Tensor
    widths: Tensor
    t_vals: Tensor
    numbers: Tensor


@dataclass
class _Block:
    """Results of a block of rays, filled as rays are finished."""

    rgb: Tensor
    opacity: Tensor
    depth: Tensor
    estimated: Tensor
    stopped: Tensor
    used: Tensor
    far: Tensor
    num_samples: int = 0
    num_colors: int = 0

    @classmethod
    def empty(cls, far: Tensor) -> "_Block":
        """Rays that meet nothing up to far (R,), m."""
        no = torch.zeros_like(far, dtype=torch.bool)
        zero = torch.zeros_like(far)
        white = far.new_full((len(far), 3), WHITE)
        return cls(white, zero, far.clone(), zero.clone(), no, no.clone(), far)

    def note(
        self, rows: Tensor, output: RenderOutput, estimated: Tensor, stopped: Tensor | None = None
    ) -> None:
        """Write what rays (r,) see into rows (r,), its error, and whether what lies behind was left out."""
        self.rgb[rows], self.opacity[rows], self.depth[rows] = output.rgb, output.opacity, output.depth
        self.estimated[rows], self.used[rows] = estimated, output.opacity > 0
        if stopped is not None:
            self.stopped[rows] = stopped
