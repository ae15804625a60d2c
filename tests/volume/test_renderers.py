"""Renderers: culled equals dense, closed forms of simple fields, counts of what was left out."""

from collections.abc import Callable
from dataclasses import replace

import pytest
import torch

from charnerf.geometry.bounds import Bounds
from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.geometry.hull import hull_contains
from charnerf.scene import FunctionField, Scene
from charnerf.types import FieldOutput, Hull, RayBundle
from charnerf.volume.marching import points_in_memory
from charnerf.volume.quadrature import PiecewiseConstant, PiecewiseLinear
from charnerf.volume.renderers.base import AbstractRenderer
from charnerf.volume.renderers.culled import CulledRenderer
from charnerf.volume.renderers.dense import DenseRenderer
from support import helpers, tiny_models

BOX = (torch.tensor((-1.8, -1.8, -0.8)), torch.tensor((1.8, 1.8, 2.8)))
RED = (0.8, 0.3, 0.1)


def renderer(kind: type[AbstractRenderer] = CulledRenderer, **changes) -> AbstractRenderer:
    settings = {"num_coarse": 12, "num_fine": 10, "hull_steps": 64, "memory_mib": 64}
    return kind(**{"quadrature": PiecewiseConstant()} | settings | changes)


def rays_of(camera: int = 2, size: int = 12) -> RayBundle:
    return pixel_rays(helpers.target_cameras(4, size=size)[camera], pixel_centres(size, size).reshape(-1, 2))


def ball_field(density: float, radius: float = 0.8) -> Callable[..., FieldOutput]:
    """Constant density in a ball around the centre, one colour."""

    def field(points: torch.Tensor, view_dirs: torch.Tensor) -> FieldOutput:
        inside = (points - points.new_tensor(helpers.CENTRE)).norm(dim=-1) < radius
        return FieldOutput(points.new_tensor(RED).expand_as(points), density * inside.to(points.dtype))

    return field


def fog(density: float) -> Callable[..., FieldOutput]:
    """Constant density and colour everywhere."""
    return lambda points, view_dirs: FieldOutput(
        points.new_tensor(RED).expand_as(points), torch.full_like(points[:, 0], density)
    )


def scene_of(coarse, fine=None, hull: Hull | None = None) -> Scene:
    return Scene(FunctionField(coarse), None if fine is None else FunctionField(fine), Bounds(*BOX, hull))


def box_hull(low: tuple[float, ...], high: tuple[float, ...]) -> Hull:
    """A hull that is one full box."""
    maps = torch.zeros(1, 2, 2)
    full = torch.ones(8, 8, 8, dtype=torch.bool)
    return Hull(full, torch.tensor(low), torch.tensor(high), maps, maps, torch.ones(1))


@pytest.fixture(scope="module")
def person_scene(person_views) -> Callable[..., tuple[tiny_models.CharNeRF, Scene]]:
    """Scenes of a shaken model; the hull is carved once."""
    carved = tiny_models.tiny_model().carve(person_views)

    def make(*, fine: bool, hull: bool) -> tuple[tiny_models.CharNeRF, Scene]:
        torch.manual_seed(1)
        model = tiny_models.shake(tiny_models.tiny_model(fine=fine, hull=hull, features="image"), scale=0.15)
        return model, model.scene(model.encode(person_views, carved if hull else None), 0)

    return make


@pytest.mark.parametrize("fine", [False, True])
@pytest.mark.parametrize("hull", [False, True])
@pytest.mark.parametrize("jitter", [False, True])
def test_culled_equals_dense_in_value_and_gradient(person_scene, fine, hull, jitter):
    """The hull is applied before the evaluation or after it: the same numbers to rounding."""
    found = {}
    # a generator gives culled and dense different jitters where rays miss, so it is used where none does
    rays = rays_of()
    for kind in (CulledRenderer, DenseRenderer):
        model, scene = person_scene(fine=fine, hull=hull)
        if jitter:
            hits = renderer().occupied(scene, rays).length > 0
            chosen = rays[hits.nonzero()[:, 0]]
        else:
            chosen = rays
        generator = torch.Generator().manual_seed(3) if jitter else None
        result = renderer(kind).render(scene, chosen, generator)
        loss = (result.finest.rgb - 0.3).square().sum() + result.finest.opacity.sum()
        if result.coarse is not None:
            loss = loss + result.coarse.rgb.square().sum() + 0.1 * result.finest.depth.sum()
        loss.backward()
        gradients = {n: p.grad for n, p in model.named_parameters() if p.grad is not None}
        found[kind] = (result, gradients)
    (culled, culled_gradients), (dense, dense_gradients) = found.values()
    for name in ("rgb", "opacity", "depth"):
        torch.testing.assert_close(
            getattr(culled.finest, name), getattr(dense.finest, name), atol=2e-5, rtol=1e-4
        )
    assert (culled.coarse is None) == (dense.coarse is None) == (not fine)
    assert culled_gradients.keys() == dense_gradients.keys()
    largest = max(float(gradient.abs().max()) for gradient in dense_gradients.values())
    for name, gradient in dense_gradients.items():
        atol = 1e-4 * float(gradient.abs().max()) + 1e-6 * largest
        torch.testing.assert_close(culled_gradients[name], gradient, atol=atol, rtol=1e-3)
    assert dense.left_out.samples == 0 and dense.left_out.rays == 0
    assert (culled.left_out.samples > 0) == hull
    assert culled.finest.opacity.max() > 0.05


@pytest.mark.parametrize("kind", [CulledRenderer, DenseRenderer])
def test_chunks_change_nothing(person_scene, kind):
    _, scene = person_scene(fine=True, hull=True)
    sizes: list[int] = []

    def counted(points, dirs):
        sizes.append(len(points))
        return scene.coarse(points, dirs)

    rays = rays_of(size=16)
    coarse = FunctionField(counted, bytes_per_point=scene.coarse.bytes_per_point)
    with torch.no_grad():
        whole = renderer(kind, memory_mib=1024).render(scene, rays)
        pieces = renderer(kind, memory_mib=1).render(replace(scene, coarse=coarse), rays)
    assert len(sizes) > 1 and max(sizes) <= points_in_memory(scene.coarse, 1)
    for name in ("rgb", "opacity", "depth"):
        torch.testing.assert_close(
            getattr(pieces.finest, name), getattr(whole.finest, name), atol=1e-5, rtol=1e-5
        )
    assert pieces.left_out == whole.left_out


@pytest.mark.parametrize("quadrature", [PiecewiseConstant, PiecewiseLinear])
@pytest.mark.parametrize("density", [0.0, 1e-30, 0.3, 5.0, 300.0, 1e30])
def test_what_opaque_surface_hides_is_not_asked_and_no_pixel_changes(density, quadrature):
    """From vacuum to a wall; with a gradient every sample inside is asked, since what hides may change."""
    asked = []

    def counted(points, dirs):
        asked.append(len(points))
        return ball_field(density)(points, dirs)

    rays, settings = rays_of(size=20), {"quadrature": quadrature(), "num_coarse": 24}
    scene = scene_of(counted, hull=box_hull((-1.0, -1.0, 0.0), (1.0, 1.0, 2.0)))
    with torch.no_grad():
        dense = renderer(DenseRenderer, **settings).render(scene, rays).finest
        asked.clear()
        one = renderer(**settings)
        one.points_at_once = 256  # less than a chunk of work is not done in stages
        seen = one.render(scene, rays)
    evaluated = sum(asked)
    asked.clear()
    learnt = renderer(**settings).render(scene, rays)
    assert seen.left_out.samples == seen.left_out.samples_of - evaluated
    assert (evaluated < 0.8 * sum(asked)) if density >= 300.0 else (evaluated == sum(asked))
    for name in ("rgb", "opacity", "depth"):
        torch.testing.assert_close(getattr(seen.finest, name), getattr(dense, name), atol=1e-5, rtol=0)
        torch.testing.assert_close(getattr(learnt.finest, name), getattr(dense, name), atol=1e-5, rtol=0)


def test_what_is_left_out_is_counted_right(person_scene):
    """Against a count by hand: rays that miss, all their samples, and samples outside the hull."""
    _, scene = person_scene(fine=True, hull=True)
    evaluated = []

    def counting(field):
        def answer(points, dirs):
            assert hull_contains(scene.bounds.hull, points).all()
            evaluated.append(len(points))
            return field(points, dirs)

        return FunctionField(answer)

    counted = replace(scene, coarse=counting(scene.coarse), fine=counting(scene.fine))
    rays = rays_of(size=16)
    one = renderer()
    with torch.no_grad():
        left_out = one.render(counted, rays).left_out
    missed = int((one.occupied(scene, rays).length == 0).sum())
    assert left_out.rays == missed > 0 and left_out.rays_of == 256
    assert left_out.samples_of == 256 * (12 + 12 + 10)
    assert left_out.samples == left_out.samples_of - sum(evaluated)
    assert left_out.shares()["rays"] == missed / 256 and left_out.shares()["grid_cells"] is None


@pytest.mark.parametrize("kind", [CulledRenderer, DenseRenderer])
@pytest.mark.parametrize("quadrature", [PiecewiseConstant, PiecewiseLinear])
@pytest.mark.parametrize("num_coarse", [1, 5, 40])
def test_fog_in_a_box_has_its_closed_form(kind, quadrature, num_coarse):
    """opacity = 1 - exp(-density * length) for any number of samples, with a hull (a slab) and without."""
    rays = RayBundle(
        torch.tensor(((-3.0, 0.1, 1.1), (-3.0, 0.0, 5.0))), torch.tensor(((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    )
    slab = box_hull((-0.5, -0.6, 0.4), (0.75, 0.6, 1.6))
    for hull, length in ((slab, 1.25), (None, 3.6)):
        scene = scene_of(fog(0.7), hull=hull)
        result = renderer(kind, quadrature=quadrature(), num_coarse=num_coarse).render(scene, rays)
        opacity = 1.0 - torch.exp(torch.tensor(-0.7 * length))
        torch.testing.assert_close(result.finest.opacity[0], opacity, atol=1e-5, rtol=0)
        expected = opacity * torch.tensor(RED) + (1.0 - opacity)
        torch.testing.assert_close(result.finest.rgb[0], expected, atol=1e-5, rtol=0)
        assert result.finest.rgb[1].eq(1.0).all() and result.finest.opacity[1] == 0


def chords(rays: RayBundle, radius: float = 0.8) -> torch.Tensor:
    """Lengths of rays inside the ball."""
    offset = torch.tensor(helpers.CENTRE) - rays.origins
    closest = (offset.square().sum(-1) - (offset * rays.directions).sum(-1).square()).clamp_min(0.0)
    return 2.0 * (radius**2 - closest).clamp_min(0.0).sqrt()


@pytest.mark.parametrize("kind", [CulledRenderer, DenseRenderer])
@pytest.mark.parametrize("with_hull", [False, True])
def test_a_ball_of_fog_converges_with_the_number_of_samples(kind, with_hull):
    hull = box_hull((-1.0, -1.0, 0.0), (1.0, 1.0, 2.0)) if with_hull else None
    rays = rays_of(size=20)
    exact = 1.0 - torch.exp(-3.0 * chords(rays))
    errors = []
    for num_coarse in (16, 64, 256):
        settings = {"num_coarse": num_coarse, "hull_steps": 512}
        result = renderer(kind, **settings).render(scene_of(ball_field(3.0), hull=hull), rays)
        errors.append(float((result.finest.opacity - exact).abs().mean()))
    assert errors[1] < 0.4 * errors[0] and errors[2] < 0.4 * errors[1] and errors[2] < 3e-3


def test_the_fine_pass_is_nearer_to_the_truth():
    """The same field twice: the fine pass puts its samples where the coarse one found something."""
    rays = rays_of(size=20)
    exact = 1.0 - torch.exp(-3.0 * chords(rays))
    field = ball_field(3.0)
    result = renderer(num_coarse=24, num_fine=48).render(scene_of(field, fine=field), rays)
    coarse, fine = ((o.opacity - exact).abs().mean() for o in (result.coarse, result.finest))
    assert fine < 0.75 * coarse


def test_depth_is_the_distance_along_the_ray():
    rays = rays_of(size=15)
    result = renderer(num_coarse=600).render(scene_of(ball_field(400.0)), rays)
    offset = torch.tensor(helpers.CENTRE) - rays.origins
    front = (offset * rays.directions).sum(-1) - 0.5 * chords(rays)
    solid = chords(rays) > 0.2
    torch.testing.assert_close(result.finest.depth[solid], front[solid], atol=0.02, rtol=0)
    assert result.finest.opacity[solid].min() > 0.999


@pytest.mark.parametrize("kind", [CulledRenderer, DenseRenderer])
def test_rays_that_miss_are_white_whatever_the_field(kind):
    rays = RayBundle(torch.tensor(((0.0, -5.0, 1.0),) * 3), torch.tensor(((0.0, -1.0, 0.0),) * 3))
    scene = scene_of(fog(50.0), fine=fog(50.0), hull=box_hull((-1.0, -1.0, 0.0), (1.0, 1.0, 2.0)))
    result = renderer(kind).render(scene, rays)
    for output in (result.finest, result.coarse):
        assert output.rgb.eq(1).all() and output.opacity.eq(0).all() and output.depth.isfinite().all()
    nothing = renderer(kind).render(scene, rays[:0])
    assert nothing.finest.rgb.shape == (0, 3) and nothing.left_out.rays_of == 0


def test_nothing_outside_the_hull_is_seen():
    """Fog everywhere, but the hull is a slab: its density outside is zero by definition."""
    hull = box_hull((-0.2, -2.0, -1.0), (0.2, 2.0, 3.0))
    ray = RayBundle(torch.tensor(((-3.0, 0.0, 1.0),)), torch.tensor(((1.0, 0.0, 0.0),)))
    result = renderer(hull_steps=256).render(scene_of(fog(1.0), hull=hull), ray)
    torch.testing.assert_close(
        result.finest.opacity, 1.0 - torch.exp(torch.tensor((-0.4,))), atol=1e-4, rtol=0
    )


@pytest.mark.parametrize("fine", [False, True])
def test_a_camera_gives_a_picture(fine):
    camera = replace(helpers.target_cameras(4, size=10)[1], width=10, height=6)
    field = ball_field(30.0)
    one = renderer()
    scene = scene_of(field, fine=field if fine else None)
    picture = one.render_camera(scene, camera)
    with torch.no_grad():
        rays = one.render(scene, pixel_rays(camera, pixel_centres(10, 6).reshape(-1, 2)))
    assert picture.finest.rgb.shape == (6, 10, 3) and picture.finest.depth.shape == (6, 10)
    assert torch.equal(picture.finest.rgb.reshape(-1, 3), rays.finest.rgb)
    assert (picture.coarse is not None) == fine
    assert picture.left_out == rays.left_out


def test_the_same_generator_gives_the_same_samples():
    scene = scene_of(ball_field(2.0))
    draw = lambda seed: renderer().render(scene, rays_of(), torch.Generator().manual_seed(seed)).finest.rgb  # noqa: E731
    assert torch.equal(draw(1), draw(1)) and not torch.equal(draw(1), draw(2))
    assert torch.equal(
        renderer().render(scene, rays_of()).finest.rgb, renderer().render(scene, rays_of()).finest.rgb
    )


def test_float64():
    rays = rays_of().to(torch.float64)
    scene = replace(scene_of(ball_field(3.0)), bounds=Bounds(BOX[0].double(), BOX[1].double()))
    found = renderer(num_coarse=64).render(scene, rays).finest
    single = renderer(num_coarse=64).render(scene_of(ball_field(3.0)), rays_of()).finest
    assert found.rgb.dtype == torch.float64
    off = (
        found.opacity.float() - single.opacity
    ).abs() > 1e-5  # a sample on the ball's edge may round either way
    assert off.float().mean() < 0.05
