import math
from dataclasses import replace

import pytest
import torch

from charnerf.evaluation import baselines, metrics
from charnerf.evaluation.baselines import (
    VisualHullBaseline,
    grid_field,
    hull_field,
    signed_edge_distances,
    white_prediction,
)
from charnerf.evaluation.surface_error import seen_points, surface_scores
from charnerf.pictures import on_white
from charnerf.surfaces.raycast import RayCaster
from charnerf.types import SourceViews
from support.figures import SIZE, figure, photograph, source_views, target_cameras


@pytest.fixture(scope="module", params=["ball", "doll"])
def case(request):
    mesh = figure(request.param)
    views = source_views(mesh)
    return mesh, views, VisualHullBaseline(views)


def test_edge_distances_follow_the_contour_to_a_fraction_of_a_pixel():
    """A half-plane from x = 4.3 on: exact beside the contour, within half a pixel further off.

    The picture's own edge counts as a contour too, so columns near the right one are not asked.
    """
    centres = torch.arange(12) + 0.5
    alpha = (centres - 4.3 + 0.5).clamp(0.0, 1.0).expand(41, 12)
    found = signed_edge_distances(alpha)[20, :8]
    torch.testing.assert_close(found[4], torch.tensor(0.2), atol=1e-5, rtol=0)
    torch.testing.assert_close(found, centres[:8] - 4.3, atol=0.5, rtol=0)


def test_white_is_white():
    white = white_prediction(target_cameras(1)[0])
    assert bool((white.rgb == 1.0).all()) and bool((white.opacity == 0.0).all())
    assert white.rgb.shape == (SIZE, SIZE, 3)


def test_hull_reproduces_the_silhouettes_and_the_drawings(case):
    _, views, hull = case
    for index in range(3):
        picture = hull.render(views.cameras[0, index])
        alpha = views.images[0, index, 3]
        sure = (alpha - 0.5).abs() > 0.35  # pixels that the edge does not halve
        assert metrics.silhouette_iou(picture.opacity[sure], alpha[sure]) > 0.995
        assert float((picture.opacity - alpha).abs().sum() / alpha.sum()) < 0.08
        truth = on_white(views.images[0, index].movedim(0, -1))
        assert metrics.psnr(picture.rgb, truth) > 25.0


def test_hull_holds_the_object(case):
    """Rays out of a point of the object leave the closed hull: every one of them hits it from inside."""
    mesh, _, hull = case
    assert hull.mesh.is_watertight
    assert hull.mesh.volume > mesh.volume * (0.99 if mesh.body_count == 1 else 0.9)
    inside = torch.from_numpy(mesh.sample(400, seed=0)).float()
    inside = inside + (torch.tensor([0.0, 0.0, 1.0]) - inside) * 0.05  # a little towards the middle
    up = torch.tensor([0.0, 0.0, 1.0]).expand(len(inside), 3)
    from_below = RayCaster(hull.mesh.triangles).occluded(inside.numpy(), up.numpy())
    assert from_below.mean() > 0.97


def test_hull_is_drawn_from_any_camera_in_the_colors_of_the_drawings(case):
    mesh, _, hull = case
    for camera in (target_cameras(9)[5], target_cameras(9)[8]):
        rgba = photograph(mesh, camera) / 255.0
        truth, alpha = on_white(rgba), rgba[..., 3]
        picture = hull.render(camera)
        assert metrics.silhouette_iou(picture.opacity, alpha) > 0.75
        assert metrics.psnr_foreground(picture.rgb, truth, alpha) > 12.0
        seen = picture.opacity > 0.99
        assert 2.0 < float(picture.depth[seen].min()) < float(picture.depth[seen].max()) < 6.0


def test_a_box_is_its_own_hull():
    """Three axis-aligned silhouettes of a box carve the box: Chamfer distance within a pixel."""
    import trimesh

    box = trimesh.creation.box((0.8, 0.5, 1.6)).apply_translation((0, 0, 1.0))
    hull = VisualHullBaseline(source_views(box))
    scores, reasons = surface_scores(hull.mesh, seen_points(box, target_cameras(24)), target_cameras(24))
    assert reasons == {}
    assert scores["chamfer_mm"] < 10.0  # a pixel is 46 mm
    assert scores["f_score"] > 0.97


@pytest.mark.parametrize("turned_deg", [0.0, 0.3])
def test_a_grid_has_the_fields_of_its_points(turned_deg, monkeypatch):
    """Whether views look along its axes or not; of one that does a single layer is asked."""
    views = source_views(figure("doll"))
    c, s = math.cos(math.radians(turned_deg)), math.sin(math.radians(turned_deg))
    turned = torch.eye(4)
    turned[:2, :2] = torch.tensor([[c, -s], [s, c]])
    cameras = replace(views.cameras[0], world_from_camera=turned @ views.cameras.world_from_camera[0])
    distances = signed_edge_distances(views.images[0, :, 3])
    low, cell, counts = torch.tensor((-1.0, -0.6, -0.1)), 0.1, (20, 13, 23)
    steps = torch.cartesian_prod(*map(torch.arange, counts))
    expected = hull_field(cameras, distances, low + cell * steps).view(counts)
    asked = []
    monkeypatch.setattr(
        baselines, "hull_field", lambda *given: asked.append(len(given[2])) or hull_field(*given)
    )
    found = grid_field(cameras, distances, low, cell, counts)
    torch.testing.assert_close(found, expected, atol=1e-5, rtol=0.0)
    layers = [20 * 23, 13 * 23, 20 * 23]
    assert asked == (layers if turned_deg == 0.0 else [math.prod(counts)] * 3)


def test_contradicting_drawings_have_no_hull_and_draw_white():
    views = source_views(figure("ball"))
    images = views.images.clone()
    images[0, 1] = 0.0
    empty = VisualHullBaseline(SourceViews(images, views.cameras, views.present, views.mirrored))
    assert empty.mesh is None
    assert bool((empty.render(target_cameras(1)[0]).opacity == 0.0).all())
    scores, reasons = surface_scores(None, figure("ball").vertices, target_cameras(1))
    assert scores == {"chamfer_mm": None, "f_score": None, "parts_lost": None}
    assert reasons["chamfer_mm"] == "no surface was found"


def test_absent_and_mirrored_views_are_not_used():
    views = source_views(figure("doll"))
    only_front = torch.tensor([[True, False, False]])
    one = VisualHullBaseline(SourceViews(views.images, views.cameras, only_front, ~only_front))
    all_three = VisualHullBaseline(views)
    assert one.mesh.volume > 2.0 * all_three.mesh.volume


def test_hidden_inner_faces_do_not_count():
    import trimesh

    shell = trimesh.creation.icosphere(subdivisions=3, radius=0.8).apply_translation((0, 0, 1))
    core = trimesh.creation.icosphere(subdivisions=3, radius=0.4).apply_translation((0, 0, 1))
    points = seen_points(trimesh.util.concatenate([shell, core]), target_cameras(16), num_points=4000)
    radii = ((points - [0.0, 0.0, 1.0]) ** 2).sum(-1) ** 0.5
    assert radii.min() > 0.75
