"""Heads, density wirings, inputs of f1 and the rule of views, each by itself."""

from dataclasses import replace

import pytest
import torch

from charnerf.errors import ConfigError
from charnerf.geometry.cameras import mirror_cameras, mirror_views
from charnerf.geometry.resizing import resized_views
from charnerf.models.features.image import ImageFeatures
from charnerf.models.features.image_hull import ImageHullFeatures
from charnerf.models.features.image_hull_section import ImageHullSectionFeatures
from charnerf.models.features.image_hull_section_consistency import (
    ImageHullSectionConsistencyFeatures,
    consistency,
)
from charnerf.models.heads.blend import BlendHead
from charnerf.models.heads.radiance import RadianceHead
from charnerf.models.mlp import residual_blocks
from charnerf.models.stages import encode_directions
from charnerf.models.views.first import FirstViews
from charnerf.models.views.mirrored import MirroredSide
from charnerf.models.views.turnaround import Turnaround
from charnerf.types import SourceViews
from support import helpers, tiny_models
from support.random_inputs import field_inputs, point_views, random_dirs

WIDTH = tiny_models.WIDTH


def test_a_closed_gate_keeps_the_blend_within_the_source_colors():
    """A convex combination of the colours of the valid views; with one valid view, its very colour."""
    seen, dirs = point_views(200), random_dirs(200)
    head = tiny_models.shake(BlendHead(width=WIDTH, hidden=8).double())
    with torch.no_grad():
        head.free.bias[3] = -1e4
    features, views = torch.randn(200, WIDTH).double(), torch.randn(200, 3, WIDTH).double()
    rgb = head(features, views, seen, dirs)
    counted = (seen.valid | ~seen.valid.any(-1, keepdim=True))[..., None]
    low = torch.where(counted, seen.rgb, 2.0).amin(1)
    high = torch.where(counted, seen.rgb, -1.0).amax(1)
    assert ((rgb >= low - 1e-12) & (rgb <= high + 1e-12)).all()
    one = seen.valid.sum(-1) == 1
    torch.testing.assert_close(rgb[one], seen.rgb[seen.valid & one[:, None]])
    with torch.no_grad():
        head.free.bias[3] = 1e4
    free = head(features, views, seen, dirs)
    other = head(features, views, replace(seen, rgb=1.0 - seen.rgb), dirs)
    torch.testing.assert_close(free, other)  # wide open, the drawings' colours do not matter


def test_a_new_blend_head_prefers_the_view_that_sees_the_point():
    behind = torch.tensor((0.0, torch.inf)).double().expand(50, 2)  # visibility 1 and 0
    seen = replace(point_views(50, 2), behind=behind, valid=torch.ones(50, 2, dtype=torch.bool))
    head = BlendHead(width=WIDTH, hidden=8).double()
    with torch.no_grad():
        head.free.bias[3] = -1e4
        head.score.weight.zero_()
    rgb = head(torch.zeros(50, WIDTH).double(), torch.zeros(50, 2, WIDTH).double(), seen, random_dirs(50))
    share = torch.sigmoid(torch.tensor(2.0)).double()
    torch.testing.assert_close(rgb, share * seen.rgb[:, 0] + (1 - share) * seen.rgb[:, 1])


@pytest.mark.parametrize("head", [BlendHead(width=WIDTH, hidden=8), RadianceHead(width=WIDTH)])
def test_heads_answer_colors_and_pass_gradcheck(head):
    head = tiny_models.shake(head.double())
    seen, dirs = point_views(4), random_dirs(4)
    features = torch.randn(4, WIDTH, dtype=torch.float64, requires_grad=True)
    views = torch.randn(4, 3, WIDTH, dtype=torch.float64, requires_grad=True)
    rgb = head(50.0 * features, 50.0 * views, seen, dirs)
    assert ((rgb >= 0) & (rgb <= 1)).all()
    assert torch.autograd.gradcheck(lambda f, v: head(f, v, seen, dirs), (features, views))


@pytest.mark.parametrize("combining", tiny_models.COMBINATORS)
@pytest.mark.parametrize("density", tiny_models.DENSITIES)
@pytest.mark.parametrize("head", ["blend", "radiance"])
def test_what_sees_directions(combining, density, head):
    """view_free: the density is one number a point and only the colour turns with the query; else both do."""
    field = tiny_models.tiny_model(combining=combining, density=density, head=head, features="image").coarse
    field = tiny_models.shake(field.double())
    inputs = field_inputs()
    with torch.no_grad():
        one, other = field(inputs, random_dirs()), field(inputs, random_dirs())
    assert torch.equal(one.densities, other.densities) != field.density.sees_directions
    assert (one.rgb - other.rgb).abs().amax() > 1e-3
    assert (one.densities >= 0).all() and field.density.sees_directions == (density != "view_free")


@pytest.mark.parametrize("num_views", range(1, 9))
def test_a_field_of_one_to_eight_views(num_views):
    """Any number, in any order, with a finite gradient for every parameter."""
    model = tiny_models.tiny_model(features="image")
    field = tiny_models.shake(model.coarse.double())
    inputs, dirs = field_inputs(6, num_views), random_dirs(6)
    answer = field(inputs, dirs)
    order = torch.randperm(num_views)
    seen = {name: getattr(inputs.views, name)[:, order] for name in ("rgb", "uv", "dirs", "behind", "valid")}
    turned = replace(inputs, views=replace(inputs.views, **seen), latents=inputs.latents[:, order])
    again = field(turned, dirs)
    torch.testing.assert_close(again.rgb, answer.rgb)
    torch.testing.assert_close(again.densities, answer.densities)
    (answer.rgb.sum() + answer.densities.sum()).backward()
    assert all(p.grad is None or p.grad.isfinite().all() for p in field.parameters())


def test_directions_are_encoded_one_to_one():
    """Opposite directions, which eq. 1 alone gives one code, and no direction have their own."""
    axes = torch.cat((torch.eye(3), -torch.eye(3), torch.zeros(1, 3))).double()
    codes = encode_directions(axes)
    assert codes.shape == (7, 12)
    assert (torch.cdist(codes, codes) + 9 * torch.eye(7)).min() > 0.5


def test_new_residual_blocks_are_the_identity():
    x = torch.randn(5, 8)
    assert torch.equal(residual_blocks(width=8, num_blocks=3)(x), x)
    assert torch.equal(residual_blocks(width=8, num_blocks=0)(x), x)
    blocks = tiny_models.shake(residual_blocks(width=8, num_blocks=1))
    first, second = blocks[0].first, blocks[0].second
    torch.testing.assert_close(blocks(x), x + second(torch.relu(first(torch.relu(x)))))


def test_image_hull_features_by_hand():
    inputs = field_inputs(1, 2)
    seen = replace(
        inputs.views,
        rgb=torch.tensor((((0.0, 0.5, 1.0), (0.0, 0.0, 0.0)),)),
        behind=torch.tensor(((0.1, 0.0),)),
        dirs=torch.tensor((((0.0, 1.0, 0.0), (1.0, 0.0, 0.0)),)),
    )
    inputs = replace(
        inputs,
        views=seen,
        edge=torch.tensor(((-0.02, 0.01),)),  # the smallest that counts is the second: the first is mirrored
        mirrored=torch.tensor((1.0, 0.0)),
        section_places=torch.tensor(((0.5, -1.0, 0.25),)),
        section_lengths=torch.tensor(((0.1, 0.2, 0.8),)) / 1.8,
    )
    numbers = torch.tanh(torch.tensor((0.4, 2.0, 8.0, -0.16, -0.8, -3.2, 0.08, 0.4, 1.6)))
    expected = torch.cat((numbers, torch.tensor((1.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0))))
    features = ImageHullFeatures()
    torch.testing.assert_close(features(inputs)[0, 0], expected)
    assert features.num_point_features == 16
    section = torch.tensor((0.5, -1.0, 0.25, 0.25, 1.0, 0.0625, 0.3125, 1.25, 1.0625, 0.0, 1 / 3, 1.0))
    both = ImageHullSectionFeatures()
    torch.testing.assert_close(both(inputs)[0, 1], torch.cat((features(inputs)[0, 1], section)))
    assert both.num_point_features == 28
    all_three = ImageHullSectionConsistencyFeatures()
    torch.testing.assert_close(all_three(inputs)[..., :28], both(inputs))
    torch.testing.assert_close(all_three(inputs)[..., 28:], consistency(seen.rgb))
    assert all_three.num_point_features == 36
    assert ImageFeatures()(inputs).shape == (1, 2, 0) and ImageFeatures().num_point_features == 0


def test_consistency_by_hand():
    """Black, black and a blue that is 0.5 away: two agree, the third is alone."""
    numbers = consistency(torch.tensor((((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.5)),)))[0]
    alone = torch.tensor((1.0, 4.0, 0.0)).tanh().tolist()
    expected = torch.tensor(
        (
            (0.0, 0.0, 0.0, 0.25, 1 / 6, 0.0, 0.0, -0.25),
            (0.0, 0.0, 0.0, 0.25, 1 / 6, 0.0, 0.0, -0.25),
            (*alone, 0.5, 1 / 6, 0.0, 0.0, 0.5),
        )
    )
    torch.testing.assert_close(numbers, expected, atol=1e-3, rtol=0)


@pytest.mark.parametrize("num_views", [1, 2, 5])
def test_consistency_knows_no_order_and_has_gradients(num_views):
    """Also where all colours are alike and the distances are zero."""
    rgb = torch.rand(20, num_views, 3, dtype=torch.float64)
    order = torch.randperm(num_views)
    torch.testing.assert_close(consistency(rgb)[:, order], consistency(rgb[:, order]))
    alike = rgb[:, :1].expand(-1, num_views, -1).clone().requires_grad_()
    numbers = consistency(alike)
    assert numbers.shape == (20, num_views, 8) and numbers.abs().max() < 1e-3
    if num_views > 1:
        (gradient,) = torch.autograd.grad(numbers.sum(), alike)
        assert torch.isfinite(gradient).all()


def test_the_mirrored_side_of_a_symmetric_figure_is_its_picture_from_270():
    views = helpers.source_views(helpers.person())
    used = MirroredSide()(views)
    truth = helpers.source_views(helpers.person(), helpers.source_cameras((270.0,)))
    assert used.images.shape[1] == 4
    torch.testing.assert_close(used.images[0, 3], truth.images[0, 0], atol=0.02, rtol=0)
    torch.testing.assert_close(
        used.cameras.world_from_camera[0, 3], truth.cameras.world_from_camera[0, 0], atol=1e-6, rtol=0
    )
    assert used.mirrored.tolist() == [[False, False, False, True]] and used.present.all()
    torch.testing.assert_close(used.images[:, :3], views.images, atol=0, rtol=0)
    asymmetric = helpers.source_views(helpers.person(symmetric=False))
    other = helpers.source_views(helpers.person(symmetric=False), helpers.source_cameras((270.0,)))
    assert (MirroredSide()(asymmetric).images[0, 3] - other.images[0, 0]).abs().max() > 0.3


def test_only_sides_that_are_there_are_mirrored():
    front_back = helpers.source_views(helpers.person(), helpers.source_cameras((0.0, 180.0)))
    assert MirroredSide()(front_back) is front_back
    views = helpers.source_views(helpers.person())
    assert Turnaround()(views) is views
    used = MirroredSide()(views)
    absent = replace(views, present=torch.tensor(((True, False, True),)))
    assert MirroredSide()(absent).images.shape[1] == 3
    camera = mirror_cameras(views.cameras[0, 1])
    assert torch.equal(camera.world_from_camera, used.cameras.world_from_camera[0, 3])


def test_the_first_views_carve_a_wider_hull():
    views = helpers.source_views(helpers.person())
    assert torch.equal(FirstViews(count=1)(views).images, views.images[:, :1])
    assert FirstViews(count=5)(views).present.shape == (1, 3)
    shares = []
    for count in (1, 2, 3):
        model = tiny_models.tiny_model(features="image")
        model.views = FirstViews(count=count)
        encoded = model.encode(views)
        assert encoded.feature_maps.shape[1] == count and encoded.hull is not None
        shares.append(float(encoded.hull.occupancy.float().mean()))
    assert shares[0] > shares[1] >= shares[2]
    with pytest.raises(ConfigError, match="found 0, expected at least 1"):
        FirstViews(count=0)


def test_in_a_batch_only_the_characters_own_sides_are_mirrored():
    first = helpers.source_views(helpers.person(), helpers.source_cameras((0.0, 90.0)))
    second = helpers.source_views(helpers.person(), helpers.source_cameras((270.0, 180.0)))
    pair = lambda name: torch.cat((getattr(first, name), getattr(second, name)))  # noqa: E731
    cameras = replace(
        first.cameras,
        **{
            name: torch.cat((getattr(first.cameras, name), getattr(second.cameras, name)))
            for name in ("world_from_camera", "focal", "principal_point", "orthographic")
        },
    )
    used = MirroredSide()(SourceViews(pair("images"), cameras, pair("present"), pair("mirrored")))
    assert used.present.tolist() == [[True, True, False, True], [True, True, True, False]]
    assert used.mirrored.tolist() == [[False, False, True, True]] * 2


def test_what_is_carved_from_follows_its_views():
    """Mirrored, resized and joined by the mirrored side view."""
    views = helpers.source_views(helpers.person(symmetric=False), helpers.source_cameras((0.0, 90.0)))
    widened = views.carving_alphas.clone()
    widened[:, 1] = 1.0
    given = replace(views, widened_alphas=widened)
    assert torch.equal(mirror_views(given).carving_alphas, widened.flip(-1))
    used = MirroredSide()(given)
    assert torch.equal(used.carving_alphas[:, :2], widened) and used.carving_alphas.shape[1] == 3
    small = resized_views(given, 16)
    assert small.carving_alphas.shape[-1] == 16 and (small.carving_alphas[:, 1] == 1.0).all()
