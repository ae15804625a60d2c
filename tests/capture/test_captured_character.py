import numpy as np
import pytest
import torch
import trimesh
from PIL import Image

from charnerf.capture.character import CaptureOptions, capture_character
from charnerf.capture.lights import Headlight
from charnerf.errors import ConfigError
from charnerf.geometry.cameras import angles_from_direction, project

SMALL = {"views": 3, "size": 48}


def ball(color=(255, 255, 255, 255), radius=1.0, subdivisions=5):
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    mesh.apply_translation((0.0, 0.0, 1.0))
    mesh.visual.vertex_colors = color
    return trimesh.Scene(mesh)


def test_coverage_of_a_ball_is_its_disc():
    """Alpha sums to the area of the outline, to a thousandth: silhouettes are antialiased without bias."""
    pictures = capture_character(ball(), CaptureOptions(**SMALL)).pictures
    cameras = pictures.cameras
    distance = float((cameras.world_from_camera[0, :3, 3] - torch.tensor((0.0, 0.0, 1.0))).norm())
    tangent = float(cameras.focal[0, 0]) / np.sqrt(distance**2 - 1.0)
    for image in pictures.images:
        assert (image[..., 3] / 255.0).sum() == pytest.approx(np.pi * tangent**2, rel=2e-3)
    flat = np.pi * float(pictures.source_cameras.focal[0, 0]) ** 2
    for image in pictures.source_images:
        assert (image[..., 3] / 255.0).sum() == pytest.approx(flat, rel=2e-3)


def test_closed_surfaces_have_no_holes_and_empty_pixels_are_zero():
    for image in capture_character(ball(), CaptureOptions(**SMALL)).pictures.images:
        y, x = np.mgrid[: len(image), : len(image)] + 0.5 - len(image) / 2
        radius = np.hypot(x, y)
        outline = np.sqrt((image[..., 3] / 255.0).sum() / np.pi)
        assert (image[radius < outline - 1.5, 3] == 255).all()
        assert (image[radius > outline + 1.5] == 0).all()


def test_linear_half_becomes_188():
    image = capture_character(ball((128, 128, 128, 255)), CaptureOptions(**SMALL)).pictures.images[0]
    assert set(np.unique(image[image[..., 3] > 0][:, :3])) == {188}  # 128 / 255 of the light


def test_pixels_average_light_not_codes():
    """Fine black and white stripes have half the light: 188, not 128."""
    stripes = np.zeros((256, 256, 3), np.uint8)
    stripes[:, ::2] = 255
    wall = trimesh.Trimesh(
        vertices=[[-1, 0, 0], [1, 0, 0], [1, 0, 2], [-1, 0, 2]], faces=[[0, 1, 2], [0, 2, 3]], process=False
    )
    wall.visual = trimesh.visual.TextureVisuals(
        uv=[[0, 0], [1, 0], [1, 1], [0, 1]],
        material=trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(stripes)),
    )
    front = capture_character(trimesh.Scene(wall), CaptureOptions(**SMALL)).pictures.source_images[0]
    inside = front[18:30, 18:30, :3].astype(float)
    np.testing.assert_allclose(inside, 188, atol=3)


def marked():
    """A grey trunk with a red face in front (-Y), a green left hand (+X) and a blue right hand (-X)."""
    parts = []
    for extents, centre, color in (
        ((0.6, 0.4, 2.0), (0, 0, 1), (90, 90, 90, 255)),
        ((0.4, 0.1, 0.3), (0, -0.25, 1.7), (255, 0, 0, 255)),
        ((0.3, 0.2, 0.2), (0.45, 0, 1.2), (0, 255, 0, 255)),
        ((0.3, 0.2, 0.2), (-0.45, 0, 1.2), (0, 0, 255, 255)),
    ):
        box = trimesh.creation.box(extents).apply_translation(centre)
        box.visual.face_colors = color
        parts.append(box)
    return trimesh.Scene(parts)


def columns_of(image, channel):
    rgb = image[..., :3].astype(int)
    others = [index for index in range(3) if index != channel]
    found = (rgb[..., channel] > 200) & (rgb[..., others].max(-1) < 50) & (image[..., 3] > 128)
    return np.nonzero(found)[1]


@pytest.mark.parametrize("sources", ["orthographic", "pinhole"])
def test_source_views_are_front_left_side_and_back(sources):
    pictures = capture_character(marked(), CaptureOptions(**SMALL, sources=sources)).pictures
    front, side, back = pictures.source_images
    middle = 24
    assert pictures.source_names == ("front", "side", "back")
    assert abs(columns_of(front, 0).mean() + 0.5 - middle) < 0.5  # the face
    assert columns_of(front, 1).min() > middle  # its left hand is on the picture's right
    assert columns_of(front, 2).max() < middle
    assert columns_of(side, 0).max() < middle  # the face looks to the picture's left
    assert len(columns_of(side, 1)) and not len(columns_of(side, 2))
    assert not len(columns_of(back, 0))
    assert columns_of(back, 1).max() < middle < columns_of(back, 2).min()
    towards = pictures.source_cameras.world_from_camera[:, :3, 2]
    azimuth, elevation = angles_from_direction(towards)
    np.testing.assert_allclose(azimuth % 360.0, (0.0, 90.0, 180.0), atol=1e-4)
    np.testing.assert_allclose(elevation, 0.0, atol=1e-4)
    assert bool(pictures.source_cameras.orthographic.all()) == (sources == "orthographic")


def test_pictures_show_points_where_cameras_project_them():
    """A small ball anywhere appears at its projection, at its depth."""
    centre = np.array((0.4, -0.3, 1.5))
    small = trimesh.creation.icosphere(subdivisions=3, radius=0.08).apply_translation(centre)
    anchor = trimesh.creation.icosphere(subdivisions=1, radius=0.01).apply_translation((-0.4, 0.3, 0.0))
    pictures = capture_character(trimesh.Scene([small, anchor]), CaptureOptions(**SMALL, depth=True)).pictures
    pixels, depth, _ = project(pictures.cameras, torch.tensor(centre).expand(3, 3))
    for image, distances, pixel, far in zip(pictures.images, pictures.depths, pixels, depth, strict=True):
        alpha = image[..., 3] / 255.0
        near = np.hypot(*(np.mgrid[:48, :48] + 0.5 - pixel.flip(0).numpy()[:, None, None])) < 6
        weights = alpha * near
        rows, columns = np.mgrid[:48, :48] + 0.5
        found = np.array([(weights * columns).sum(), (weights * rows).sum()]) / weights.sum()
        np.testing.assert_allclose(found, pixel, atol=0.1)
        row, column = (int(value) for value in pixel.flip(0))
        assert distances[row, column] / 1000.0 == pytest.approx(float(far) - 0.08, abs=0.02)
    assert (pictures.depths[pictures.images[..., 3] == 0] == 0).all()


def test_thin_parts_are_seen():
    """A pole a sixth of a pixel wide keeps its coverage, though centre rays miss it."""
    width = 0.007
    pole = trimesh.creation.box((width, width, 2.0)).apply_translation((0.011, 0.0, 1.0))
    front = capture_character(trimesh.Scene(pole), CaptureOptions(**SMALL)).pictures.source_images[0]
    pixel = 2.0 * 1.05 / 48
    column = front[10:38, :, 3].sum(axis=1) / 255.0
    np.testing.assert_allclose(column, width / pixel, atol=0.02)


def test_cut_outs_show_what_is_behind():
    holes = np.full((2, 8, 4), 255, np.uint8)
    holes[:, 4:, 3] = 0
    wall = trimesh.Trimesh(
        vertices=[[-1, -0.5, 0], [1, -0.5, 0], [1, -0.5, 2], [-1, -0.5, 2]],
        faces=[[0, 1, 2], [0, 2, 3]],
        process=False,
    )
    wall.visual = trimesh.visual.TextureVisuals(
        uv=[[0, 0], [1, 0], [1, 1], [0, 1]],
        material=trimesh.visual.material.PBRMaterial(
            baseColorTexture=Image.fromarray(holes), alphaMode="MASK", alphaCutoff=0.5
        ),
    )
    behind = trimesh.creation.box((0.6, 0.2, 2.0)).apply_translation((0.5, 0.5, 1.0))
    behind.visual.face_colors = (255, 0, 0, 255)
    front = capture_character(trimesh.Scene([wall, behind]), CaptureOptions(**SMALL)).pictures.source_images[
        0
    ]
    assert (front[20:28, 12:20, :3] == 255).all() and (front[20:28, 12:20, 3] == 255).all()
    red = columns_of(front, 0)
    assert len(red) and red.min() > 24
    assert (front[20:28, 38:40, 3] == 0).all()  # through the hole, beside what is behind


def test_both_sides_of_open_sheets_are_seen():
    sheet = trimesh.Trimesh(vertices=[[-1, 0, 0], [1, 0, 0], [0, 0, 2]], faces=[[0, 1, 2]], process=False)
    front, side, back = capture_character(
        trimesh.Scene(sheet), CaptureOptions(**SMALL)
    ).pictures.source_images
    area = 2.0 * (48 / (2.1 * np.sqrt(2.0))) ** 2
    assert (front[..., 3] / 255).sum() == pytest.approx(area, rel=0.01)
    assert (back[..., 3] / 255).sum() == pytest.approx(area, rel=0.01)
    assert (side[..., 3] == 0).all()


def test_headlight_darkens_slants_only():
    plain = capture_character(ball(), CaptureOptions(**SMALL)).pictures.images[0].astype(int)
    lit = capture_character(ball(), CaptureOptions(**SMALL, light=Headlight())).pictures.images[0].astype(int)
    assert (plain[..., 3] == lit[..., 3]).all()
    assert lit[24, 24, 0] >= 254
    rim = (plain[..., 3] > 0) & (plain[..., 3] < 255)
    assert lit[rim][:, 0].max() < 235


@pytest.mark.parametrize(
    "change, message",
    [
        ({"views": 0}, "views: found 0"),
        ({"size": 4}, "size: found 4"),
        ({"sources": "fisheye"}, "sources: found 'fisheye'"),
    ],
)
def test_wrong_options_are_named(change, message):
    with pytest.raises(ConfigError, match=message):
        CaptureOptions(**change)
