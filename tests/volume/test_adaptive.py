"""The adaptive renderer: its tolerance holds, its estimate is honest, and what it leaves out is left out."""

import math
from collections.abc import Callable
from dataclasses import replace

import pytest
import torch

from charnerf.geometry.bounds import Bounds
from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.scene import AbstractField, FunctionField, Scene
from charnerf.types import FieldOutput, Hull, RayBundle
from charnerf.volume.marching import OccupiedRays, coarse_samples
from charnerf.volume.quadrature import PiecewiseConstant
from charnerf.volume.renderers.adaptive import POINTS_A_STAGE, AdaptiveRenderer, _columns_of_stage
from charnerf.volume.renderers.culled import CulledRenderer
from charnerf.volume.renderers.refinement import error_of_equal_bins, march, split_bins
from support import helpers, tiny_models

BOX = (torch.tensor((-1.8, -1.8, -0.8)), torch.tensor((1.8, 1.8, 2.8)))
COMMON = {"quadrature": PiecewiseConstant(), "num_fine": 0, "memory_mib": 64}
Field = Callable[[torch.Tensor, torch.Tensor], FieldOutput]


def adaptive(tolerance: float = 0.05) -> AdaptiveRenderer:
    return AdaptiveRenderer(**COMMON, num_coarse=16, hull_steps=128, tolerance=tolerance)


def converged(scene: Scene, rays: RayBundle, count: int = 2048) -> torch.Tensor:
    renderer = CulledRenderer(**COMMON, num_coarse=count, hull_steps=1024)
    return renderer.render(scene, rays).finest.rgb


def rays_of(camera: int = 2, size: int = 14) -> RayBundle:
    return pixel_rays(helpers.target_cameras(4, size=size)[camera], pixel_centres(size, size).reshape(-1, 2))


def scene_of(field: Field, hull: Hull | None = None) -> Scene:
    return Scene(FunctionField(field), None, Bounds(*BOX, hull))


def striped(points: torch.Tensor) -> torch.Tensor:
    """Colours that change along x and z."""
    return torch.stack(
        [
            0.5 + 0.4 * torch.sin(5 * points[:, 0]),
            0.5 + 0.4 * torch.cos(4 * points[:, 2]),
            0.3 + 0 * points[:, 1],
        ],
        dim=-1,
    )


def around(points: torch.Tensor) -> torch.Tensor:
    return (points - points.new_tensor(helpers.CENTRE)).norm(dim=-1)


FIELDS: dict[str, Field] = {
    "blob": lambda points, dirs: FieldOutput(
        striped(points), 20.0 * torch.exp(-((around(points) / 0.4) ** 2))
    ),
    "ball with a soft surface": lambda points, dirs: FieldOutput(
        striped(points), 80.0 * torch.sigmoid((0.7 - around(points)) / 0.02)
    ),
    "shell": lambda points, dirs: FieldOutput(
        striped(points), 60.0 * torch.exp(-(((around(points) - 0.6) / 0.03) ** 2))
    ),
    "fog": lambda points, dirs: FieldOutput(striped(points), torch.full_like(points[:, 0], 0.7)),
    "nothing": lambda points, dirs: FieldOutput(striped(points), torch.zeros_like(points[:, 0])),
    "white on white": lambda points, dirs: FieldOutput(
        torch.ones_like(points), 50.0 * (around(points) < 0.5).float()
    ),
}


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize("tolerance", [0.1, 0.03])
def test_the_true_error_stays_within_the_tolerance(name, tolerance):
    scene, rays = scene_of(FIELDS[name]), rays_of()
    with torch.no_grad():
        rendering = adaptive(tolerance).render(scene, rays)
        error = (rendering.finest.rgb - converged(scene, rays)).abs().amax(-1)
    assert rendering.estimate is not None and rendering.estimate.tolerance == tolerance
    assert rendering.estimate.num_unresolved == int((rendering.estimate.estimated > tolerance).sum())
    assert error.max() <= tolerance


def test_a_tighter_tolerance_costs_more_and_errs_less():
    scene, rays = scene_of(FIELDS["ball with a soft surface"]), rays_of()
    with torch.no_grad():
        reference = converged(scene, rays)
        found = [adaptive(tolerance).render(scene, rays) for tolerance in (0.2, 0.02)]
    loose, tight = ((one.finest.rgb - reference).abs().max() for one in found)
    assert tight < loose
    assert found[0].estimate.num_samples < found[1].estimate.num_samples


def test_what_nobody_sees_is_not_evaluated():
    """Behind an opaque front, and colours where there is no weight."""
    ball = FIELDS["ball with a soft surface"]
    deepest = 0.0
    asked = 0

    class Counting(AbstractField):
        sees_directions = False

        def __call__(self, points: torch.Tensor, dirs: torch.Tensor) -> FieldOutput:
            nonlocal deepest
            deepest = max(deepest, float(points[:, 1].max()))
            return ball(points, dirs)

        def colors(self, state: FieldOutput) -> torch.Tensor:
            nonlocal asked
            asked += len(state.rgb)
            return state.rgb

    camera = helpers.source_cameras((0.0,), size=10)[0]  # looks along +y
    rays = pixel_rays(camera, torch.full((64, 2), 5.0))
    scene = replace(scene_of(ball), coarse=Counting())
    with torch.no_grad():
        rendering = adaptive().render(scene, rays)
    assert rendering.estimate is not None
    assert deepest < 0.6, "the ball's back, at y = 0.7, can not be seen"
    assert rendering.estimate.num_stopped == 64
    assert 0 < asked == rendering.estimate.num_colors < 0.3 * rendering.estimate.num_samples


def test_what_is_returned_may_enter_a_gradient():
    scene, rays = scene_of(FIELDS["blob"]), rays_of()
    with torch.no_grad():
        rendering = adaptive(0.1).render(scene, rays)
    gain = torch.ones(3, requires_grad=True)
    assert rendering.estimate is not None
    (gain * rendering.finest.rgb).sum().backward()
    (gain[0] * (rendering.finest.opacity + rendering.estimate.estimated)).sum().backward()
    assert gain.grad is not None and bool(gain.grad.isfinite().all())


NARROW = Bounds(torch.tensor((-0.2, -0.2, 0.8)), torch.tensor((0.2, 0.2, 1.2)))


def few_rays() -> RayBundle:
    """Rays of all directions through points of a box that is 0.4 m wide."""
    generator = torch.Generator().manual_seed(0)
    across = torch.randn(80, 3, generator=generator)
    directions = across / across.norm(dim=-1, keepdim=True)
    through = torch.tensor(helpers.CENTRE) + 0.3 * (torch.rand(80, 3, generator=generator) - 0.5)
    return RayBundle(through - 2.0 * directions, directions)


@pytest.mark.parametrize(("tolerance", "samples"), [(0.2, 12), (0.05, 24), (0.01, 54)])
def test_where_refinement_buys_nothing_few_rays_take_exactly_the_samples_of_culled(tolerance, samples):
    scene = Scene(FunctionField(FIELDS["fog"]), None, NARROW)
    with torch.no_grad():
        ours = adaptive(tolerance).render(scene, few_rays())
        theirs = CulledRenderer(**COMMON, num_coarse=samples, hull_steps=128).render(scene, few_rays())
    for name in ("rgb", "opacity", "depth"):
        assert torch.equal(getattr(ours.finest, name), getattr(theirs.finest, name)), name
    assert ours.estimate is not None and ours.estimate.num_unresolved == 0
    assert ours.estimate.num_samples == theirs.left_out.samples_of - theirs.left_out.samples > 0


def test_where_densities_are_stiff_few_rays_take_more_samples_and_err_less():
    def sheet(points: torch.Tensor, dirs: torch.Tensor) -> FieldOutput:
        return FieldOutput(striped(points), 240.0 * torch.exp(-(((points[:, 0] - 0.013) / 0.005) ** 2)))

    scene, rays, tolerance = Scene(FunctionField(sheet), None, NARROW), few_rays(), 0.02
    with torch.no_grad():
        ours = adaptive(tolerance).render(scene, rays)
        theirs = CulledRenderer(**COMMON, num_coarse=36, hull_steps=128).render(scene, rays)
        exact = converged(scene, rays)
    off, of_culled = ((one.finest.rgb - exact).abs().amax(-1) for one in (ours, theirs))
    assert of_culled.max() > tolerance >= off.max()
    changed = (ours.finest.rgb != theirs.finest.rgb).any(-1)
    assert 0 < int(changed.sum()) < len(changed)
    evaluated = theirs.left_out.samples_of - theirs.left_out.samples
    assert ours.estimate is not None and ours.estimate.num_samples > evaluated


@pytest.mark.parametrize("density", [3.0, 12.0, 60.0])
def test_the_estimate_of_equal_bins_sees_what_jumps_cost(density):
    """A density that begins anywhere along a ray: nearly all errors are seen, and none is many times what is estimated."""
    starts = torch.linspace(0.02, 0.18, 161)
    rays = RayBundle(torch.tensor((-1.0, 0.0, 1.0)).repeat(161, 1), torch.eye(3)[:1].repeat(161, 1))
    samples = coarse_samples(NARROW, OccupiedRays.of(NARROW, rays, 128), 24)
    answer = FieldOutput(torch.zeros(161, 24, 3), density * (samples.s_vals > starts[:, None]))
    passed = torch.exp(-(answer.densities * samples.s_edges.diff(dim=-1)).sum(-1))
    estimated = error_of_equal_bins(PiecewiseConstant(), answer, samples, passed[:, None].expand(-1, 3), 1.0)
    error = (passed - torch.exp(-density * (0.4 - starts))).abs()
    assert float((estimated >= error).float().mean()) > 0.7
    assert float((error / estimated).amax()) < 4.0
    assert 1.0 < float(estimated.mean() / error.mean()) < 4.0


def test_an_empty_picture_asks_nothing():
    def fail(points: torch.Tensor, dirs: torch.Tensor) -> FieldOutput:
        raise AssertionError("asked")

    rays = rays_of()
    away = RayBundle(rays.origins, -rays.directions)
    with torch.no_grad():
        rendering = adaptive().render(scene_of(fail), away)
    assert (rendering.finest.rgb == 1.0).all() and (rendering.finest.opacity == 0.0).all()
    assert rendering.left_out.shares()["rays"] == 1.0 == rendering.left_out.shares()["samples"]


@pytest.mark.parametrize("with_generator", [True, False])
def test_training_renders_as_culled(with_generator):
    scene, rays = scene_of(FIELDS["blob"]), rays_of(size=6)
    culled = CulledRenderer(**COMMON, num_coarse=16, hull_steps=128)
    generators = [torch.Generator().manual_seed(3) if with_generator else None for _ in range(2)]
    ours = adaptive().render(scene, rays, generators[0]).finest.rgb
    torch.testing.assert_close(ours, culled.render(scene, rays, generators[1]).finest.rgb, rtol=0, atol=0)


def test_a_network_in_its_hull(person_views):
    """Pictures of a shaken model in its hull: within the tolerance, whatever the chunks."""
    torch.manual_seed(1)
    model = tiny_models.shake(tiny_models.tiny_model(fine=False, features="image"), scale=0.15)
    with torch.no_grad():
        scene = model.scene(model.encode(person_views), 0)
        camera = helpers.target_cameras(4, size=24)[1]
        rendering = adaptive(0.05).render_camera(scene, camera)
        small = AdaptiveRenderer(
            **{**COMMON, "memory_mib": 1}, num_coarse=16, hull_steps=128, tolerance=0.05
        ).render_camera(scene, camera)
        rays = pixel_rays(camera, pixel_centres(24, 24).reshape(-1, 2))
        reference = converged(scene, rays, 256).reshape(24, 24, 3)
    assert (rendering.finest.rgb - reference).abs().max() <= 0.05
    assert rendering.estimate is not None and rendering.estimate.estimated.shape == (24, 24)
    torch.testing.assert_close(small.finest.rgb, rendering.finest.rgb, atol=0.03, rtol=0)
    assert 0.1 < rendering.left_out.shares()["rays"] < 0.95


def test_splitting_keeps_samples_in_the_middle_of_their_bins():
    edges = torch.tensor([[0.0, 0.3, 0.9, 0.9]])
    begins = torch.tensor([[True, False, False]])
    split = split_bins(edges, begins, torch.tensor([[0.1, 0.5, 0.0]]), num_split=1, least=0.2)
    torch.testing.assert_close(split.s_edges, torch.tensor([[0.0, 0.3, 0.5, 0.7, 0.9, 0.9]]))
    assert split.source.tolist() == [[0, -1, 1, -1, 2]]
    assert split.begins.tolist() == [[True, False, False, False, False]]


def test_the_estimate_bounds_a_jump_of_density():
    """One bin whose density is anywhere between its neighbours': the colour can not be further off than the estimate says."""
    widths = torch.full((1, 3), 0.1)
    rgb = torch.tensor([[[0.2, 0.2, 0.2], [0.2, 0.2, 0.2], [0.9, 0.1, 0.4]]])
    known = torch.ones(1, 3, dtype=torch.bool)
    begins = torch.tensor([[True, False, False]])
    densities = torch.tensor([[0.0, 2.0, 4.0]])
    found = march(densities, rgb, known, widths, begins, 1.0)
    off = march(densities + torch.tensor([[0.0, 0.15 * 2.0, 0.0]]), rgb, known, widths, begins, 1.0)
    assert (found.rgb - off.rgb).abs().max() <= found.errors.sum() < 1.0
    assert math.isclose(float(found.opacity[0]), 1.0 - math.exp(-0.6), rel_tol=1e-6)


def test_few_bins_are_one_stage_and_of_many_those_that_are_there_count():
    few, many = torch.ones(10, 40, dtype=torch.bool), torch.ones(200, 40, dtype=torch.bool)
    assert _columns_of_stage(few) == 40
    columns = _columns_of_stage(many)
    assert columns < 40 and 200 * columns == pytest.approx(POINTS_A_STAGE, abs=200)
    many[:, ::2] = False  # padding costs nothing
    assert _columns_of_stage(many) == 40
    assert _columns_of_stage(torch.ones(5000, 40, dtype=torch.bool)) == 4
