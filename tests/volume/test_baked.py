"""The baked renderer: closed forms, its order, what it leaves to others, and that its grid fits into its memory."""

import logging
import math
from dataclasses import replace

import pytest
import torch

from charnerf.geometry.bounds import Bounds
from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.scene import FunctionField, Scene
from charnerf.types import FieldOutput, RayBundle, Rendering
from charnerf.volume.baking.bake import Baked, bake
from charnerf.volume.baking.field import BakedField
from charnerf.volume.baking.march import _Groups
from charnerf.volume.quadrature import PiecewiseConstant
from charnerf.volume.renderers.baked import BakedRenderer, largest_beyond
from charnerf.volume.renderers.culled import CulledRenderer
from support import helpers, tiny_models

BOX = (torch.tensor((-0.8, -0.8, 0.2)), torch.tensor((0.8, 0.8, 1.8)))
CENTRE = torch.tensor((0.0, 0.0, 1.0))
RADIUS, DENSITY, PITCH = 0.6, 2.0, 1.6 / 80
COMMON = {
    "quadrature": PiecewiseConstant(),
    "num_coarse": 16,
    "num_fine": 0,
    "hull_steps": 128,
    "memory_mib": 256,
}


def baked(tolerance: float = 0.05, **changes: float) -> BakedRenderer:
    return BakedRenderer(**{**COMMON, **changes}, tolerance=tolerance)


class Gridded(FunctionField):
    """A field that is baked in steps of 1 cm, for speed."""

    def lattice(self, low, high):
        return low, PITCH


def scene_of(density) -> Scene:
    def answer(points: torch.Tensor, dirs: torch.Tensor) -> FieldOutput:
        return FieldOutput(torch.full_like(points, 0.25), density(points))

    return Scene(Gridded(answer), None, Bounds(*BOX))


def rays_of(size: int = 24) -> RayBundle:
    return pixel_rays(helpers.target_cameras(4, size=size)[2], pixel_centres(size, size).reshape(-1, 2))


def render(scene: Scene, rays: RayBundle, renderer: BakedRenderer) -> Rendering:
    with torch.no_grad():
        return renderer.render(renderer.prepared(scene), rays)


def around(points: torch.Tensor) -> torch.Tensor:
    return (points - CENTRE).norm(dim=-1)


def chords(rays: RayBundle, radius: float) -> torch.Tensor:
    """Lengths of rays in a ball around CENTRE, (R,), m."""
    offset = rays.origins - CENTRE
    near = offset - (offset * rays.directions).sum(-1, keepdim=True) * rays.directions
    return 2.0 * (radius**2 - near.square().sum(-1)).clamp_min(0.0).sqrt()


def ball(rays: RayBundle) -> torch.Tensor:
    return chords(rays, RADIUS)


def shell(rays: RayBundle) -> torch.Tensor:
    return chords(rays, RADIUS) - chords(rays, 0.4)


def slab(rays: RayBundle) -> torch.Tensor:
    """0.3 m thick, across the x axis, within the box."""
    t = ((torch.tensor((-0.15, 0.15)) - rays.origins[:, :1]) / rays.directions[:, :1]).sort(-1).values
    first, last = ((BOX[k] - rays.origins) / rays.directions for k in (0, 1))
    enter = torch.maximum(t[:, 0], torch.minimum(first, last).amax(-1))
    leave = torch.minimum(t[:, 1], torch.maximum(first, last).amin(-1))
    return (leave - enter).clamp_min(0.0)


BODIES = {
    "ball": (ball, lambda points: DENSITY * (around(points) < RADIUS)),
    "shell": (shell, lambda points: DENSITY * ((around(points) < RADIUS) & (around(points) > 0.4))),
    "slab": (slab, lambda points: DENSITY * (points[:, 0].abs() < 0.15)),
}


@pytest.mark.parametrize("name", BODIES)
def test_homogeneous_bodies_have_their_analytic_opacity(name):
    """Within the tolerance but where a ray grazes a jump of the density: there a step of the grid is a long chord."""
    lengths, density = BODIES[name]
    rays = rays_of()
    found = render(scene_of(density), rays, baked())
    step = 0.5 * PITCH
    exact = lengths(rays)
    shifted = [lengths(replace(rays, origins=rays.origins + step * shift)) for shift in 2.0 * torch.eye(3)]
    shifted += [lengths(replace(rays, origins=rays.origins - step * shift)) for shift in 2.0 * torch.eye(3)]
    grazing = torch.stack([(one - exact).abs() for one in shifted]).amax(0) > 0.05
    off = (found.finest.opacity - (1.0 - torch.exp(-DENSITY * exact))).abs()
    assert int((~grazing & (exact > 0)).sum()) >= 30
    assert float(off[~grazing].amax()) <= 0.05
    assert float(off.mean()) <= 0.01


SMOOTH = lambda points: 8.0 * torch.exp(-((around(points) / 0.25) ** 2))  # noqa: E731


def opacity_errors(density, pitches: tuple[float, ...], tolerance: float) -> tuple[list[float], list[Baked]]:
    """Root mean squares of a density's errors by grids of some pitches, and the grids."""
    rays, scene = rays_of(20), scene_of(density)
    renderer, errors, grids = baked(tolerance), [], []
    with torch.no_grad():
        reference = CulledRenderer(**{**COMMON, "num_coarse": 4096}).render(scene, rays).finest.opacity
        for pitch in pitches:

            class Coarse(type(scene.coarse)):
                def lattice(self, low, high, pitch=pitch):
                    return low, pitch

            coarse = replace(scene, coarse=Coarse(scene.coarse.function))
            grids.append(bake(coarse, tolerance=tolerance, memory_mib=256))
            looked_at = Scene(BakedField(grids[-1], None, scene.coarse), None, scene.bounds)
            found = renderer.render(looked_at, rays).finest.opacity
            errors.append(float((found - reference).square().mean().sqrt()))
    return errors, grids


@pytest.mark.parametrize(
    ("density", "order", "spread"),
    [(SMOOTH, 2.0, 0.4), (lambda points: DENSITY * (around(points) < RADIUS).float(), 1.0, 0.5)],
    ids=["smooth", "a jump"],
)
def test_the_error_falls_with_the_step(density, order, spread):
    """Quadratically on smooth densities, linearly where they jump; by a tolerance so small that the step alone decides."""
    errors, grids = opacity_errors(density, (0.16, 0.08, 0.04), 1e-5)
    slope = math.log(errors[0] / errors[-1]) / math.log(grids[0].grid.step / grids[-1].grid.step)
    assert slope == pytest.approx(order, abs=spread)


def test_straight_densities_are_not_asked_where_the_tolerance_allows():
    (few_error,), (few,) = opacity_errors(SMOOTH, (0.04,), 1e-3)
    (all_error,), (every,) = opacity_errors(SMOOTH, (0.04,), 1e-5)
    assert few.num_densities < 0.6 * every.num_densities  # the lattice and the middles of its cells
    assert all_error < few_error < 1e-3


def test_a_ridge_between_points_that_hold_little_is_found():
    """Its densities are 4/m in the middles of cells and next to nothing at the lattice's points."""
    low = BOX[0]

    def ridge(points: torch.Tensor) -> torch.Tensor:
        across = ((points - low) / PITCH)[:, :2] - torch.tensor((40.5, 30.5))
        near = torch.exp(-0.5 * (across / 0.22).square().sum(-1))
        return 4.0 * near + 0.02 * ((points - CENTRE).norm(dim=-1) < RADIUS)

    made = bake(scene_of(ridge), tolerance=0.05, memory_mib=256)
    middle = low + PITCH * torch.tensor(((40.5, 30.5, 20.5), (40.5, 30.5, 40.5)))
    assert float(made.grid.densities_at(middle).amin()) > 3.0
    assert made.num_densities < 0.3 * made.num_points


def test_a_trained_kind_of_field_is_within_the_tolerance():
    model = tiny_models.tiny_model(views="mirrored").eval()
    tiny_models.shake(model, scale=0.1)
    with torch.no_grad():
        scene = model.scene(model.encode(helpers.source_views(helpers.person())), 0)
        rays = rays_of(20)
        found = render(scene, rays, baked())
        reference = (
            CulledRenderer(**{**COMMON, "num_coarse": 512, "hull_steps": 512}).render(scene, rays).finest
        )
    assert float(reference.opacity.amax()) > 0.1
    assert float((found.finest.rgb - reference.rgb).abs().amax()) <= 0.05
    assert found.estimate is not None and found.estimate.num_samples > 0
    assert found.left_out.samples > 0.5 * found.left_out.samples_of


def test_what_can_not_be_baked_is_rendered_as_culled(caplog):
    scene, rays = scene_of(BODIES["ball"][1]), rays_of(8)
    culled = CulledRenderer(**COMMON).render(scene, rays).finest
    directed = replace(scene, coarse=Gridded(scene.coarse.function, sees_directions=True))
    with caplog.at_level(logging.WARNING):
        assert baked().prepared(directed) is directed
    assert "density=view_free" in caplog.text
    assert baked(tolerance=0.0).prepared(scene) is scene
    assert torch.equal(baked().render(scene, rays).finest.rgb, culled.rgb)
    prepared = baked().prepared(scene)
    assert baked().prepared(prepared) is prepared
    assert baked().render(prepared, rays).estimate is None  # gradients are kept here: as in training


def test_of_rays_in_doubt_the_fewest_places_are_asked():
    """Ray 0 is within what is allowed without its largest error, ray 1 as it is, ray 2 not without its two largest."""
    rows = torch.tensor((2, 0, 1, 0, 2, 1, 0, 2))
    errors = torch.tensor((0.5, 2.0, 0.45, 0.3, 3.0, 0.45, 0.3, 0.7))
    assert sorted(largest_beyond(rows, errors, 4, 1.0).tolist()) == [1, 4, 7]
    assert largest_beyond(rows, errors, 4, 10.0).tolist() == []


def test_light_of_one_colour_is_that_of_its_heaviest_place():
    """A ray's light in quarters: what comes to the first takes little, much and little again; the rest has a colour of its own."""
    rays = torch.tensor((1, 1, 1, 1))
    weights = torch.tensor((0.05, 0.6, 0.1, 0.2))
    before = torch.tensor((1.0, 0.95, 0.35, 0.25))
    groups = _Groups(rays, torch.tensor((1.0, 2.0, 3.0, 4.0)), weights, before)
    found = groups.by_light(2, 0.25)
    assert found.t_vals.tolist() == [2.0, 3.0, 4.0] and found.rays.tolist() == [1, 1, 1]
    assert torch.allclose(found.weights, torch.tensor((0.65, 0.1, 0.2)))
    equal = replace(groups, weights=torch.full((4,), 0.2), before=torch.full((4,), 0.9)).by_light(2, 0.25)
    assert torch.allclose(equal.weights, torch.full((4,), 0.2))  # of equal ones all stay
    assert groups.by_light(2, 1e-3) is groups


def test_a_grid_that_does_not_fit_is_coarser_and_says_so(caplog):
    scene = scene_of(BODIES["ball"][1])
    with caplog.at_level(logging.WARNING):
        made = bake(scene, tolerance=0.05, memory_mib=6)
    assert made.coarser > 1 and made.grid.mib <= 6
    assert "as coarse" in caplog.text and "renderer.memory_mib=6 is less" in caplog.text


def test_the_share_of_the_work_grows_to_all_of_it_and_may_end_it():
    shares: list[float] = []
    bake(scene_of(SMOOTH), tolerance=0.05, memory_mib=256, on_share=shares.append)
    assert len(shares) >= 2 and shares == sorted(shares) and 0.0 < shares[0] < 0.5 and shares[-1] == 1.0

    def stop(share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bake(scene_of(SMOOTH), tolerance=0.05, memory_mib=256, on_share=stop)


def test_nothing_is_seen_of_nothing_and_what_is_dark_or_empty_is_not_asked():
    nothing = scene_of(lambda points: torch.zeros_like(points[:, 0]))
    found = render(nothing, rays_of(8), baked()).finest
    assert bool((found.rgb == 1.0).all()) and bool((found.opacity == 0.0).all())
    opaque = bake(scene_of(lambda points: 200.0 * (around(points) < RADIUS)), tolerance=0.05, memory_mib=256)
    assert opaque.num_densities < 0.5 * opaque.num_points
