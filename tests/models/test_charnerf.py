"""The whole model: scenes of characters alone and in batches, hoisting, masks, gradients."""

from dataclasses import replace

import pytest
import torch
from torch.nn import functional as F

from charnerf.data.mixed import stack_hulls, stack_views
from charnerf.errors import ShapeError
from charnerf.geometry.cameras import project_into_all
from charnerf.geometry.hull import hull_contains
from charnerf.models.charnerf import CharNeRF
from charnerf.models.lookup import bilinear_rows, maps_to_rows, read_rows
from charnerf.types import FieldOutput, Hull, SourceViews
from charnerf.volume.quadrature import PiecewiseConstant
from charnerf.volume.renderers.adaptive import AdaptiveRenderer
from charnerf.volume.renderers.culled import CulledRenderer
from support import helpers, tiny_models

PERSON = helpers.person(symmetric=False)


def ask(model: CharNeRF, views: SourceViews, points: torch.Tensor, hull: Hull | None = None) -> FieldOutput:
    """What the finest field answers at points seen along one direction."""
    dirs = torch.tensor((0.6, 0.8, 0.0)).expand_as(points)
    scene = model.scene(model.encode(views, hull), 0)
    return scene.field(points, dirs)


def some_points(count: int = 300) -> torch.Tensor:
    return torch.tensor(helpers.CENTRE) + torch.rand(count, 3) * 1.8 - 0.9


@pytest.fixture(scope="module")
def person_hull(person_views) -> Hull:
    """Carved once: the model's rule of views is the turnaround."""
    return tiny_models.tiny_model().carve(person_views)


@pytest.mark.parametrize(
    ("hull_from", "features"),
    [
        ("batch", "image_hull"),
        ("batch", "image_hull_section"),
        ("batch", "image_hull_section_consistency"),
        ("characters", "image_hull_section_consistency"),
        pytest.param("characters", "image_hull", marks=pytest.mark.slow),
        pytest.param("characters", "image_hull_section", marks=pytest.mark.slow),
    ],
)
def test_characters_of_different_numbers_of_views_share_a_batch(hull_from, features):
    """In any batch each gets the answer that it gets alone, carved in the batch or each by itself before."""
    model = tiny_models.shake(tiny_models.tiny_model(views="mirrored", features=features))
    alone = [
        helpers.source_views(PERSON),
        helpers.source_views(helpers.ball(), helpers.source_cameras((90.0, 180.0))),
        helpers.source_views(helpers.dumbbell(), helpers.source_cameras((0.0,))),
    ]
    batch = stack_views(alone)
    assert batch.present.sum(-1).tolist() == [3, 2, 1]
    hulls = [model.carve(one) for one in alone]
    together = None
    if hull_from == "characters":
        together = stack_hulls(hulls, [model.views(one) for one in alone], model.views(batch))
    points = some_points()
    dirs = torch.tensor((0.6, 0.8, 0.0)).expand_as(points)
    with torch.no_grad():
        encoded = model.encode(batch, together)
        for index, one in enumerate(alone):
            expected, found = (
                ask(model, one, points, hulls[index]),
                model.scene(encoded, index).field(points, dirs),
            )
            torch.testing.assert_close(found.densities, expected.densities, atol=1e-4, rtol=1e-4)
            torch.testing.assert_close(found.rgb, expected.rgb, atol=1e-5, rtol=0)


@pytest.mark.parametrize("combining", tiny_models.COMBINATORS)
def test_the_order_of_drawings_does_not_matter(combining, person_views):
    model = tiny_models.shake(tiny_models.tiny_model(combining=combining, hull=False))
    points = some_points()
    with torch.no_grad():
        expected = ask(model, person_views, points)
        found = ask(model, person_views[:, torch.tensor((2, 0, 1))], points)
    torch.testing.assert_close(found.densities, expected.densities, atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(found.rgb, expected.rgb, atol=1e-5, rtol=0)


@pytest.mark.parametrize("num_views", [1, 8])
def test_one_to_eight_drawings_are_encoded(num_views):
    model = tiny_models.tiny_model(hull=False, features="image")
    azimuths = tuple(360.0 * k / num_views for k in range(num_views))
    answer = ask(model, helpers.source_views(PERSON, helpers.source_cameras(azimuths)), some_points(20))
    assert answer.rgb.isfinite().all() and answer.densities.isfinite().all()


def test_hoisting_the_linear_layer_is_exact(person_views):
    """The layer applied to the map and read is the layer applied to what is read, to rounding."""
    model = tiny_models.tiny_model(features="image", hull=False).double()
    encoded = model.encode(person_views.to(torch.float64))
    rows = maps_to_rows(encoded.feature_maps[0])
    pixels, _, _ = project_into_all(encoded.views.cameras[0], some_points().double())
    read = bilinear_rows(pixels * 0.5, width=16, height=16)
    layer = model.coarse.from_latents
    torch.testing.assert_close(read_rows(model.coarse.hoist(rows), *read), layer(read_rows(rows, *read)))


def test_a_drawing_says_nothing_of_points_outside_of_it(person_views):
    """Views are masked where the point lies beyond the picture; beyond all of them the answer is finite."""
    model = tiny_models.shake(tiny_models.tiny_model(features="image", hull=False))
    points = torch.tensor(
        ((1.5, 0.0, 1.0), (0.0, 1.5, 1.0))
    )  # beyond front and back, seen by the side; and v. v.
    changed = person_views.images.clone()
    changed[:, (0, 2)] = torch.rand_like(changed[:, (0, 2)])
    with torch.no_grad():
        before, after = (
            ask(model, person_views, points),
            ask(model, replace(person_views, images=changed), points),
        )
    torch.testing.assert_close(before.densities[0], after.densities[0])
    assert (before.densities[1] - after.densities[1]).abs() > 1e-4
    far = torch.tensor(((50.0, 50.0, 50.0), (0.0, -4.0, 1.0), (0.0, -60.0, 1.0))).requires_grad_()
    answer = ask(model, person_views, far)
    (gradient,) = torch.autograd.grad(answer.rgb.sum() + answer.densities.sum(), far)
    assert answer.densities.isfinite().all() and gradient.isfinite().all()


def test_transparent_drawings_are_read_on_white(person_views):
    """The colour under alpha 0 is not seen."""
    model = tiny_models.shake(tiny_models.tiny_model(hull=False))
    images = person_views.images.clone()
    images[:, :, :3] = torch.where(images[:, :, 3:] > 0, images[:, :, :3], torch.rand(()))
    points = some_points(50)
    with torch.no_grad():
        torch.testing.assert_close(
            ask(model, replace(person_views, images=images), points).rgb, ask(model, person_views, points).rgb
        )


@pytest.mark.parametrize("fine", [False, True])
@pytest.mark.parametrize("density", ["view_free", "view_dependent"])
def test_every_parameter_gets_a_gradient(fine, density, person_views, person_hull):
    model = tiny_models.shake(tiny_models.tiny_model(fine=fine, density=density))
    scene = model.scene(model.encode(person_views, person_hull), 0)
    points, dirs = some_points(400), torch.randn(400, 3)
    answers = [field(points, dirs / dirs.norm(dim=-1, keepdim=True)) for field in (scene.coarse, scene.field)]
    sum(a.rgb.square().sum() + a.densities.square().sum() for a in answers).backward()
    silent = [n for n, p in model.named_parameters() if p.grad is None or not p.grad.abs().sum() > 0]
    silent = [name for name in silent if "score.bias" not in name]  # a softmax does not see what all share
    assert silent == []
    assert (scene.fine is None) != fine and scene.field.sees_directions == (density == "view_dependent")


def test_coarse_and_fine_share_the_encoder_and_nothing_else():
    model = tiny_models.tiny_model(fine=True)
    coarse, fine = set(map(id, model.coarse.parameters())), set(map(id, model.fine.parameters()))
    assert not coarse & fine and len(coarse) == len(fine) > 0


def test_a_model_without_hull_carves_nothing(person_views):
    model = tiny_models.tiny_model(hull=False)
    assert model.carve(person_views) is None
    encoded = model.encode(person_views)
    assert encoded.hull is None and model.scene(encoded, 0).bounds.hull is None


def coverage_at(views: SourceViews, points: torch.Tensor) -> torch.Tensor:
    """Alpha of the drawings at points (P, 3), the least of all views, by PyTorch's own reading."""
    cameras = views.cameras[0]
    pixels, _, _ = project_into_all(cameras, points)
    grid = (2.0 * pixels / cameras.width - 1.0).transpose(0, 1)[:, :, None]
    return F.grid_sample(views.images[0, :, 3:], grid, padding_mode="border", align_corners=False)[
        :, 0, :, 0
    ].amin(0)


def test_density_ends_at_the_outlines(person_views):
    """A softplus is positive everywhere; where a drawing shows nothing, nothing is left of it. A mirrored view has no say."""
    model = tiny_models.shake(tiny_models.tiny_model(views="mirrored")).eval()
    points = some_points(2000)
    covered = coverage_at(person_views, points)
    densities = ask(model, person_views, points).densities
    assert bool((densities[covered == 0.0] == 0.0).all()) and bool((covered == 0.0).any())
    assert bool((densities[covered >= 0.5] > 0.0).all()) and bool((covered >= 0.5).any())
    assert bool(
        (ask(model.train(), person_views, points).densities > 0.0).all()
    )  # what trains learns them itself


def test_what_lies_beside_the_outlines_is_not_asked(person_views):
    """The hull is wider than the drawings: the rest of it is empty, and leaving it out changes nothing."""
    model = tiny_models.shake(tiny_models.tiny_model(views="mirrored")).eval()
    scene = model.scene(model.encode(person_views), 0)
    points = some_points(4000)
    held = scene.bounds.may_hold(points)
    densities = scene.field(points, torch.zeros_like(points)).densities
    in_hull = hull_contains(scene.bounds.hull, points)
    assert bool((densities[in_hull & ~held] == 0.0).all()) and bool((in_hull & ~held).any())
    settings = {
        "quadrature": PiecewiseConstant(),
        "num_coarse": 16,
        "num_fine": 0,
        "hull_steps": 96,
        "memory_mib": 256.0,
    }
    # more rays than few, which take as many samples as their hull is wide
    camera = helpers.target_cameras(3, size=48)[1]
    for renderer in (CulledRenderer(**settings), AdaptiveRenderer(**settings, tolerance=0.01)):
        found = renderer.render_camera(scene, camera)
        asked = renderer.render_camera(replace(scene, bounds=replace(scene.bounds, outlines=None)), camera)
        torch.testing.assert_close(found.finest.rgb, asked.finest.rgb, rtol=0.0, atol=1e-5)
        torch.testing.assert_close(found.finest.opacity, asked.finest.opacity, rtol=0.0, atol=1e-5)
        assert found.left_out.samples > asked.left_out.samples
    assert (
        model.train().scene(model.encode(person_views), 0).bounds.outlines is None
    )  # what trains learns them itself


def test_a_model_without_hull_asks_no_outline(person_views):
    model = tiny_models.shake(tiny_models.tiny_model(hull=False))
    assert bool((ask(model, person_views, some_points()).densities > 0.0).all())


def test_encoding_is_a_value_not_a_state(person_views):
    """Two characters encoded one after the other answer as if each were alone."""
    model = tiny_models.tiny_model(hull=False)
    first = model.encode(person_views)
    points = some_points(20)
    dirs = torch.zeros_like(points)
    expected = model.scene(first, 0).field(points, dirs).rgb
    model.encode(helpers.source_views(helpers.dumbbell()))
    torch.testing.assert_close(model.scene(first, 0).field(points, dirs).rgb, expected)


def test_wrong_sides_are_refused_before_any_work(person_views):
    model = tiny_models.tiny_model()
    assert model.encoder.multiple == 8
    odd = replace(person_views, images=person_views.images[..., :30, :])
    with pytest.raises(ShapeError, match=r"found 32 x 30 pixels, expected sides that are multiples of 8"):
        model.encode(odd)


def test_a_hull_given_is_the_hull_used(person_views, person_hull):
    model = tiny_models.tiny_model()
    assert model.encode(person_views, person_hull).hull is person_hull
    carved = model.encode(person_views).hull
    assert torch.equal(carved.occupancy, person_hull.occupancy)


def test_drawings_are_carved_in_their_own_precision_and_place(person_views):
    """Batches are carved where the data is, whatever the model has been moved to."""
    model = tiny_models.tiny_model()
    hull = model.double().carve(person_views)
    assert hull.box_min.dtype == torch.float32
