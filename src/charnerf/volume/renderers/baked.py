"""Looks at a character that was evaluated once on a grid, by a tolerance, and says what error it made.

Letters: R rays, P places on them that have colours of their own.
"""

import logging
import math
from collections.abc import Callable
from typing import final

import torch
from torch import Tensor

from charnerf.scene import Scene
from charnerf.types import ErrorEstimate, LeftOut, RayBundle, Rendering, RenderOutput
from charnerf.volume.baking.bake import FACTOR, UNSEEN_SHARE, bake
from charnerf.volume.baking.field import BakedField
from charnerf.volume.baking.march import SPACING, Seen, march
from charnerf.volume.quadrature.base import AbstractQuadrature
from charnerf.volume.renderers.base import WHITE, AbstractRenderer
from charnerf.volume.renderers.culled import CulledRenderer

log = logging.getLogger(__name__)

EXACT_SHARE = 0.7  # of the tolerance: error that the grid's colours may add to a ray; the field is asked for the largest beyond
SAME_COLOR_SHARE = 0.8  # of the tolerance: share of a ray's light that has one colour
MOST_SPACING = 5.0 / 3.0  # times that at the usual tolerance
TOLERANCE = 0.05  # error of a colour that is aimed at where nobody says
TURNING_TOLERANCE = 0.15  # the same of pictures that are gone in a tenth of a second


@final
class BakedRenderer(AbstractRenderer):
    """Renders scenes that its `prepared` has baked by their grid, and all others as the culled renderer.

    Training (with a generator, or where gradients are kept), single pictures, models whose density sees the direction, and a
    tolerance of 0, which asks for exactness, are the culled renderer's.

    Args:
        quadrature: As the culled renderer.
        num_coarse: As the culled renderer; the count that what is left out is compared with.
        num_fine: As the culled renderer.
        hull_steps: As the culled renderer.
        memory_mib: Bound on what the grid takes, and on what is held at once, MiB.
        tolerance: Error of a colour that is aimed at, in [0, 1].
        factor: Steps of the grid in one of the field's lattice, a drawing's pixel.
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
        factor: int = FACTOR,
    ) -> None:
        super().__init__(
            quadrature=quadrature,
            num_coarse=num_coarse,
            num_fine=num_fine,
            hull_steps=hull_steps,
            memory_mib=memory_mib,
        )
        self.tolerance, self.factor = tolerance, factor
        self._culled = CulledRenderer(**self.settings)

    def prepared(self, scene: Scene, on_share: Callable[[float], object] = lambda share: None) -> Scene:
        """The scene with its finest field baked, for many pictures of it; as it is where it can not be."""
        if self.tolerance <= 0.0 or isinstance(scene.field, BakedField):
            return scene
        if scene.field.sees_directions:
            log.warning(
                "renderer=baked: the density of this model depends on the direction, a grid would hold one of them; rendered as "
                "renderer=culled. density=view_free can be baked."
            )
            return scene
        baked = bake(
            scene,
            tolerance=self.tolerance,
            memory_mib=self.memory_mib,
            factor=self.factor,
            on_share=on_share,
        )
        return Scene(BakedField(baked, scene.field.coloring, scene.field), None, scene.bounds)

    def render(self, scene: Scene, rays: RayBundle, generator: torch.Generator | None = None) -> Rendering:
        """Render rays (R,): by the grid of a prepared scene, without a generator and gradients; else as the culled renderer."""
        field = scene.field
        if not isinstance(field, BakedField) or generator is not None or torch.is_grad_enabled():
            return self._culled.render(scene, rays, generator)
        with torch.inference_mode():
            seen = march(
                field.grid,
                rays,
                unseen=UNSEEN_SHARE * self.tolerance,
                same_color=SAME_COLOR_SHARE * self.tolerance,
                spacing=spacing_of(self.tolerance),
            )
        return self._colored(field, rays, seen)

    def _colored(self, field: BakedField, rays: RayBundle, seen: Seen) -> Rendering:
        """Give what rays (R,) see its colours."""
        num_rays, unseen, num_asked = len(seen.passed), UNSEEN_SHARE * self.tolerance, 0
        from_ = rays.rows(seen.rows)
        along, points = from_.directions, torch.addcmul(from_.origins, from_.directions, seen.t_vals[:, None])
        rgb, errors = field.colors_at(points, along)
        opacity = torch.where(seen.passed > unseen, 1.0 - seen.passed, 1.0)
        counted = _by_ray(seen, seen.weights)
        # what was too little to count, or behind all light, has the colour of the rest
        share = seen.weights * (opacity / counted.clamp_min(1e-6)).index_select(0, seen.rows)
        errors = share * errors
        if field.source is not None:
            asked = largest_beyond(seen.rows, errors, num_rays, EXACT_SHARE * self.tolerance)
            rgb[asked] = field.exact_colors(points[asked], along[asked])
            errors[asked] = 0.0
            num_asked = len(asked)
        estimated = _by_ray(seen, errors) + seen.errors + torch.where(counted > 0.0, 0.0, opacity)
        total = max(num_asked, num_rays * self.num_coarse)
        return Rendering(
            finest=RenderOutput(
                rgb=_by_ray(seen, share[:, None] * rgb) + (1.0 - _by_ray(seen, share))[:, None] * WHITE,
                opacity=opacity,
                depth=torch.where(counted > 0.0, seen.moments / counted.clamp_min(1e-6), seen.far),
            ),
            coarse=None,
            left_out=LeftOut(
                rays=num_rays - int(counted.count_nonzero()),
                rays_of=num_rays,
                samples=total - num_asked,
                samples_of=total,
            ),
            estimate=ErrorEstimate(
                tolerance=self.tolerance,
                estimated=estimated,
                num_samples=seen.num_samples,
                num_colors=len(seen.rows),
                num_stopped=int((seen.passed <= unseen).sum()),
                num_unresolved=int((estimated > self.tolerance).sum()),
            ),
        )


def spacing_of(tolerance: float) -> float:
    """Of samples along a ray, in steps of the fine grid: their error grows with its square, up to where they would miss things."""
    return SPACING * min(max(math.sqrt(tolerance / TOLERANCE), 1.0), MOST_SPACING)


def largest_beyond(rows: Tensor, errors: Tensor, num_rays: int, allowed: float) -> Tensor:
    """The fewest places by number without which the errors of no ray are more than allowed: the largest of its own.

    Errors along a ray are taken to have one sign: what is misread at a place mostly is at the next one.

    Args:
        rows: Rays of the places, (P,).
        errors: Of their rays' colours, (P,).
        num_rays: R.
        allowed: Sum of a ray's errors.
    """
    total = errors.new_zeros(num_rays).index_add_(0, rows, errors)
    doubtful = (total > allowed).index_select(0, rows).nonzero()[:, 0]
    if not len(doubtful):
        return doubtful
    order = doubtful[errors[doubtful].argsort(descending=True)]
    order = order[rows[order].argsort(stable=True)]  # ray after ray, the largest error first
    of_ray, own = rows[order], errors[order].double()
    before = own.cumsum(0) - own
    first = torch.cat((torch.ones_like(of_ray[:1]), of_ray.diff())) != 0
    before -= before[first][first.cumsum(0) - 1]  # within the ray
    return order[total[of_ray] - before > allowed]


def _by_ray(seen: Seen, values: Tensor) -> Tensor:
    """Sums of values (P, ...) over the groups of each ray, (R, ...)."""
    return values.new_zeros(len(seen.passed), *values.shape[1:]).index_add_(0, seen.rows, values)
