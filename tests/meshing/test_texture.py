"""Textures: an atlas that hides nothing, colours from where they were drawn, a surface that stays."""

from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh

from charnerf.errors import DataError
from charnerf.geometry.cameras import cameras_towards, direction_from_angles
from charnerf.meshing import atlas as atlas_module
from charnerf.meshing.atlas import rasterise, unwrap
from charnerf.meshing.exported import exported, read_texture, texture_picture, welded
from charnerf.meshing.extract import fit_height
from charnerf.meshing.projection import Projector
from charnerf.meshing.texture import _faded, padded_picture, texture_mesh
from charnerf.types import SourceViews
from support.analytic_scenes import scene_of, sphere, with_field

MAGENTA = (1.0, 0.0, 1.0)
FRONT, SIDE, BACK = (0.8, 0.2, 0.1), (0.1, 0.7, 0.2), (0.2, 0.3, 0.9)
SIZE = 96


def _views(painted, outside=MAGENTA, *, angles=(0.0, 90.0, 180.0), size=SIZE) -> SourceViews:
    """Orthographic views of 2.4 m; a function paints each: (view, x right, y up) in m to rgb and inside."""
    azimuth = torch.tensor(angles)
    cameras = cameras_towards(
        direction_from_angles(azimuth, torch.zeros_like(azimuth)),
        target=torch.tensor([0.0, 0.0, 1.0]),
        distance=4.0,
        half_extent=1.2,
        size=size,
        orthographic=True,
    )
    across = (torch.arange(size) + 0.5) / size * 2.4 - 1.2
    y, x = torch.meshgrid(-across, across, indexing="ij")
    images = []
    for view in range(len(angles)):
        rgb, inside = painted(view, x, y)
        rgb = torch.where(inside[..., None], rgb, torch.tensor(outside))
        images.append(torch.cat((rgb, inside[..., None].float()), -1).movedim(-1, 0))
    flags = torch.zeros(1, len(angles), dtype=torch.bool)
    return SourceViews(torch.stack(images)[None], cameras[None], ~flags, flags)


def _plain(view, x, y):
    """A disc of 0.8 m, one colour a view."""
    return torch.tensor((FRONT, SIDE, BACK)[view]).expand(*x.shape, 3), x**2 + y**2 < 0.64


def _ball(radius: float = 0.8) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(3, radius).apply_translation((0.0, 0.0, 1.0))


def _grey_scene():
    scene = scene_of(sphere)

    def field(points, view_dirs):
        answer = scene.field(points, view_dirs)
        return replace(answer, rgb=torch.full_like(points, 0.5))

    return with_field(scene, field)


def _color_at(mesh: trimesh.Trimesh, directions) -> np.ndarray:
    """Texture colours (n, 3) where rays from the ball's centre leave it, by the nearest vertices."""
    parts = welded(exported(mesh, ".ply", "x"))
    wanted = np.array((0.0, 0.0, 1.0)) + 0.8 * np.asarray(directions)
    near = np.linalg.norm(parts.vertices[None] - wanted[:, None], axis=-1).argmin(1)
    return parts.rgba[near, :3]


def test_an_atlas_keeps_triangles_apart_and_in_order(monkeypatch):
    monkeypatch.setattr(atlas_module, "PIECE", 300)  # several pieces
    mesh = _ball()
    flat = unwrap(mesh, 256)
    assert (flat.vertex_of[flat.faces] == mesh.faces).all()
    assert flat.uv.min() >= 0.0 and flat.uv.max() <= 1.0
    texels = rasterise(flat, 256)
    assert len(np.unique(texels.face)) == len(mesh.faces)
    np.testing.assert_allclose(texels.weights.sum(1), 1.0, atol=1e-9)
    corners = np.stack((flat.uv[:, 0], 1.0 - flat.uv[:, 1]), 1)[flat.faces] * 256
    back = (texels.weights[..., None] * corners[texels.face]).sum(1)
    centres = np.stack((texels.index % 256, texels.index // 256), 1) + 0.5
    np.testing.assert_allclose(back, centres, atol=1e-6)
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]).sum()
    assert len(texels.index) == pytest.approx(area, rel=0.02)  # nothing lies on anything


def test_texturing_moves_no_surface_and_no_normal():
    mesh = _ball()
    done = texture_mesh(_grey_scene(), mesh, _views(_plain), size=128)
    joined = welded(exported(fit_height(done.mesh, 1.6), ".ply", "x"))
    back = trimesh.Trimesh(joined.vertices, joined.faces, process=False)
    assert back.is_watertight and back.euler_number == 2
    assert len(back.vertices) == len(mesh.vertices) < len(done.mesh.vertices)
    np.testing.assert_allclose(done.mesh.triangles, mesh.triangles)
    order = np.lexsort(np.round(mesh.vertices, 6).T)
    other = np.lexsort(np.round(joined.vertices + np.array((0, 0, 0.2)), 6).T)
    np.testing.assert_allclose(joined.normals[other], mesh.vertex_normals[order], atol=1e-6)


def test_each_side_has_the_color_that_was_drawn_and_the_field_the_rest():
    done = texture_mesh(_grey_scene(), _ball(), _views(_plain), size=256)
    found = _color_at(done.mesh, [(0, -1, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0)])
    np.testing.assert_allclose(found[:3], (FRONT, SIDE, BACK), atol=0.02)
    np.testing.assert_allclose(found[3], 0.5, atol=0.06)  # the right side nobody drew
    assert 0.05 < done.num_from_field / done.num_texels < 0.5


def test_no_background_bleeds_in_even_where_the_mesh_is_larger_than_drawn():
    def red(view, x, y):
        return torch.tensor((1.0, 0.2, 0.0)).expand(*x.shape, 3), x**2 + y**2 < 0.76**2

    soft = _views(red, size=512)
    soft.images[:, :, :3] = torch.nn.functional.avg_pool2d(soft.images[0, :, :3], 3, 1, 1)[None]
    drawn = Projector(soft, mesh := _ball()).at(mesh.vertices, mesh.vertex_normals, _some_face(mesh))
    seen = drawn.trust > 0
    assert seen.mean() > 0.6
    assert drawn.rgb[seen, 2].max() < 0.02
    assert drawn.rgb[seen, 1].min() > 0.18


def _some_face(mesh: trimesh.Trimesh) -> np.ndarray:
    face = np.zeros(len(mesh.vertices), np.int64)
    face[mesh.faces] = np.arange(len(mesh.faces))[:, None]
    return face


def test_what_stands_behind_something_is_not_painted_with_it():
    wall = (
        trimesh.creation.box(bounds=[(-0.9, 0.3, 0.1), (0.9, 0.4, 1.9)]).subdivide().subdivide().subdivide()
    )
    post = trimesh.creation.box(bounds=[(-0.2, -0.5, 0.1), (0.2, -0.3, 1.9)])
    mesh = trimesh.util.concatenate([wall, post])

    def painted(view, x, y):
        green = torch.tensor((0.0, 1.0, 0.0)).expand(*x.shape, 3)
        blue = torch.tensor((0.0, 0.0, 1.0)).expand(*x.shape, 3)
        return torch.where((x.abs() < 0.2)[..., None], blue, green), (x.abs() < 0.9) & (y.abs() < 0.9)

    drawn = Projector(_views(painted, angles=(0.0,)), mesh).at(
        mesh.triangles_center, mesh.face_normals, np.arange(len(mesh.faces))
    )
    front = mesh.face_normals[:, 1] < -0.9
    on_wall = front & (mesh.triangles_center[:, 1] > 0)
    hidden = on_wall & (np.abs(mesh.triangles_center[:, 0]) < 0.17)
    assert hidden.any() and (drawn.trust[hidden] == 0).all()
    clear = on_wall & (np.abs(mesh.triangles_center[:, 0]) > 0.26)
    np.testing.assert_allclose(drawn.rgb[clear], np.tile((0.0, 1.0, 0.0), (clear.sum(), 1)), atol=0.02)
    on_post = front & ~on_wall
    np.testing.assert_allclose(drawn.rgb[on_post], np.tile((0.0, 0.0, 1.0), (on_post.sum(), 1)), atol=0.02)
    assert (drawn.trust[~front] == 0).all()


def test_views_of_unequal_brightness_meet_without_a_step():
    def shaded(view, x, y):
        return torch.full((*x.shape, 3), (0.4, 0.6, 0.5)[view]), x**2 + y**2 < 0.64

    mesh = _ball()
    drawn = Projector(_views(shaded), mesh).at(mesh.vertices, mesh.vertex_normals, _some_face(mesh))
    ring = np.flatnonzero((np.abs(mesh.vertices[:, 2] - 1.0) < 0.05) & (mesh.vertices[:, 0] > 0.1))
    ring = ring[np.argsort(np.arctan2(mesh.vertices[ring, 1], mesh.vertices[ring, 0]))]
    steps = np.abs(np.diff(drawn.rgb[ring, 0]))
    assert np.ptp(drawn.rgb[ring, 0]) > 0.15 and steps.max() < 0.08


def test_the_field_paints_everything_when_asked():
    scene = scene_of(sphere)
    done = texture_mesh(scene, _ball(), None, size=128)
    assert done.num_from_field == done.num_texels
    place = np.asarray(done.mesh.vertices, np.float32)
    wanted = scene.field(torch.from_numpy(place), torch.zeros(len(place), 3)).rgb.numpy()
    found = read_texture(texture_picture(done.mesh), np.asarray(done.mesh.visual.uv))
    assert np.median(np.abs(found - wanted)) < 0.01


def test_a_part_of_no_size_leaves_the_other_colors_alone():
    """Decimation can leave a loose triangle whose corners lie in one place: nothing ties it to anything."""
    ball = trimesh.creation.icosphere(2, 0.5)
    speck = trimesh.Trimesh(np.full((3, 3), 2.0), [[0, 1, 2]], process=False)
    both = trimesh.util.concatenate([ball, speck])
    known = np.arange(len(both.vertices)) < 40
    values = np.where(known[:, None], 0.25, 0.0) * np.ones(3)
    alone = _faded(ball, values[:-3], known[:-3])
    with_speck = _faded(both, values, known)
    assert np.isfinite(with_speck).all()
    np.testing.assert_allclose(with_speck[:-3], alone, atol=1e-3)
    assert 0.0 < alone[~known[:-3]].max() <= 0.25


def test_padding_leaves_no_texel_blank():
    mesh = _ball()
    texels = rasterise(unwrap(mesh, 64), 64)
    picture = padded_picture(np.tile((0.2, 0.4, 0.6), (len(texels.index), 1)), texels, 64)
    assert (picture == (51, 102, 153)).all()


@pytest.mark.parametrize("size", [0, 15, 9000])
def test_a_bad_texture_size_is_refused(size):
    with pytest.raises(DataError, match=f"texture size: found {size}, expected 16 to 8192"):
        unwrap(_ball(), size)
