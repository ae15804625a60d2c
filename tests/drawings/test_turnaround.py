"""Drawings of any size, crop and background come back as the source views of a capture."""

import numpy as np
import pytest
import torch
from PIL import Image, ImageOps

from charnerf.drawings.cutout import cut_out
from charnerf.drawings.load import drawing_from_array
from charnerf.drawings.options import ReadingOptions
from charnerf.drawings.turnaround import read_views
from charnerf.drawings.viewpoints import turnaround, viewpoint
from charnerf.errors import DataError
from charnerf.geometry.cameras import angles_from_direction, project
from charnerf.reconciling.agreement import iou
from charnerf.wording import worded_for_page
from support.painted import SCALE, cropped, noisy_paper, on_background, paint

VIEWS = ("front", "side", "back")
SIZE = 128


def read_turnaround(front, side, back, *, size, side_is="left", reconciled=True):
    """Front, side and back, the side seen from the character's left or right."""
    return read_views(
        turnaround(front, side, back, side_is=side_is), size=size, options=ReadingOptions(reconciled)
    )


def _arrays(pictures) -> list[np.ndarray]:
    return [np.asarray(picture) for picture in pictures]


@pytest.fixture(scope="module")
def reference():
    """The figure with its alpha, uncropped, as a capture would frame it."""
    return read_turnaround(*_arrays(paint(view) for view in VIEWS), size=SIZE)


def _difference(first, second) -> float:
    """Root mean square of the difference on white."""
    a, b = (views.images[0] for views in (first.views, second.views))
    on_white = [image[:, :3] * image[:, 3:] + 1.0 - image[:, 3:] for image in (a, b)]
    return float((on_white[0] - on_white[1]).square().mean().sqrt())


def test_the_canvas_is_that_of_a_capture(reference):
    cameras = reference.views.cameras
    assert reference.views.images.shape == (1, 3, 4, SIZE, SIZE) and cameras.shape == (1, 3)
    assert bool(cameras.orthographic.all()) and bool(reference.views.present.all())
    assert not bool(reference.views.mirrored.any())
    azimuth, elevation = angles_from_direction(cameras.world_from_camera[0, :, :3, 2])
    torch.testing.assert_close(azimuth, torch.tensor([0.0, 90.0, 180.0]))
    torch.testing.assert_close(elevation, torch.zeros(3), atol=1e-5, rtol=0)
    # the box of the front view runs from -0.75 to 0.85 m, so that a foot reaches 0.30 m from the axis
    assert reference.half_extent == pytest.approx(1.05 * np.hypot(0.30, 1.0), abs=0.005)


def test_figure_stands_on_the_floor_line_two_metres_tall(reference):
    """The painted crown, floor and nose project to where they are drawn."""
    alpha = reference.views.images[0, :, 3].numpy()
    for view in range(3):
        camera = reference.views.cameras[0, view]
        pixels, _, _ = project(camera, torch.tensor([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]))
        rows = np.flatnonzero(alpha[view].max(axis=1) > 0.5)
        assert rows[-1] + 1 == pytest.approx(float(pixels[0, 1]), abs=0.75)
        assert rows[0] == pytest.approx(float(pixels[1, 1]), abs=0.75)
    belly = round(float(project(reference.views.cameras[0, 1], torch.tensor([[0.0, 0.0, 1.1]]))[0][0, 1]))
    row = np.flatnonzero(alpha[1, belly] > 0.5)
    assert row.mean() + 0.5 > 0.5 * SIZE + 1.5  # the face looks towards the picture's left: the rest is right


@pytest.mark.parametrize("share", [0.23, 0.6])
def test_white_background_other_crops_and_sizes_change_little(reference, share):
    crops = [(5, 9, 31, 14), (40, 3, 3, 60), (12, 12, 12, 12)]
    pictures = [
        on_background(cropped(paint(view), share * (1 + 0.3 * k), crops[k])) for k, view in enumerate(VIEWS)
    ]
    found = read_turnaround(*_arrays(pictures), size=SIZE)
    assert found.half_extent == pytest.approx(reference.half_extent, abs=0.02)
    for view in range(3):
        a, b = (t.views.images[0, view, 3].numpy() for t in (reference, found))
        assert iou(a, b) > 0.96
    assert _difference(reference, found) < 0.05
    assert not found.warnings


def test_alpha_cropped_to_the_figure_changes_less(reference):
    pictures = [cropped(paint(view), 0.5, (0, 0, 0, 0)) for view in VIEWS]
    assert _difference(reference, read_turnaround(*_arrays(pictures), size=SIZE)) < 0.03


def test_paper_with_grain_and_shade_is_cut_away(reference):
    pictures = [noisy_paper(paint(view), seed) for seed, view in enumerate(VIEWS)]
    found = read_turnaround(*_arrays(pictures), size=SIZE)
    for view in range(3):
        a, b = (t.views.images[0, view, 3].numpy() for t in (reference, found))
        assert iou(a, b) > 0.97


def test_jpeg_files_are_cut_out(reference, tmp_path):
    paths = [tmp_path / f"{view}.jpg" for view in VIEWS]
    for path, view in zip(paths, VIEWS, strict=True):
        on_background(paint(view)).resize((500, 500), Image.Resampling.BOX).save(path, quality=75)
    found = read_turnaround(*paths, size=SIZE)
    for view in range(3):
        a, b = (t.views.images[0, view, 3].numpy() for t in (reference, found))
        assert iou(a, b) > 0.94
    assert all(any(path.name in one for one in found.assumptions) for path in paths)


def test_enclosed_white_stays_and_open_white_goes():
    """The white shirt is part of the figure, the gap between the legs is not."""
    rgba = cut_out(drawing_from_array(np.asarray(on_background(paint("front"))), "front")).rgba
    shirt, gap = (1.0 + 1.3 - 1.15) * SCALE, (1.0 + 1.3 - 0.4) * SCALE
    middle = round(1.3 * SCALE)
    assert rgba[round(shirt), middle, 3] == 1.0
    assert rgba[round(gap), middle, 3] == 0.0


def test_outline_is_freed_from_the_background():
    """On green, no green shines through the soft outline."""
    picture = on_background(paint("front"), (40, 220, 60)).resize((260, 260), Image.Resampling.BOX)
    rgba = cut_out(drawing_from_array(np.asarray(picture), "front")).rgba
    soft = (rgba[..., 3] > 0.05) & (rgba[..., 3] < 0.95)
    assert soft.sum() > 100
    greener = rgba[..., 1] - np.maximum(rgba[..., 0], rgba[..., 2])
    assert np.quantile(greener[soft], 0.95) < 0.1
    coverage = np.asarray(paint("front").resize((260, 260), Image.Resampling.BOX))[..., 3] / 255.0
    assert np.abs(rgba[..., 3] - coverage).mean() < 0.004


def test_right_side_moves_the_camera_and_keeps_the_drawing(reference):
    arrays = _arrays(paint(view) for view in VIEWS)
    arrays[1] = arrays[1][:, ::-1]
    found = read_turnaround(*arrays, size=SIZE, side_is="right")
    azimuth, _ = angles_from_direction(found.views.cameras.world_from_camera[0, 1, :3, 2])
    assert float(azimuth) == pytest.approx(270.0)
    flipped = reference.views.images[0, 1].flip(-1)
    torch.testing.assert_close(found.views.images[0, 1], flipped, atol=0.02, rtol=0)
    with pytest.raises(DataError, match="side: found 'up', expected 'left' or 'right'"):
        read_turnaround(*arrays, size=SIZE, side_is="up")


def test_a_back_that_is_no_mirrored_front_is_warned_of():
    front, side, back = _arrays(paint(view) for view in VIEWS)
    traced = read_turnaround(front, side, back[:, ::-1].copy(), size=SIZE)
    assert any("better unmirrored" in one for one in traced.warnings)
    other = read_turnaround(front, side, side, size=SIZE)
    assert any("differ in pose" in one for one in other.warnings)


@pytest.mark.parametrize(("pixels", "is_asked"), [(5, False), (20, True)])
def test_a_traced_back_is_asked_about_where_its_sides_differ_enough(pixels, is_asked):
    """A pose that is not quite the front's makes some difference too."""
    figure = np.full((300, 300, 3), 255, np.uint8)
    figure[40:260, 130:170] = figure[100:115, 70:230] = (60, 70, 160)
    side, front = figure.copy(), figure.copy()
    side[100:115] = 255
    side[100:115, 130:170] = (60, 70, 160)
    front[115 : 115 + pixels, 80:110] = (60, 70, 160)  # hangs from one arm
    back = np.where(front < 255, (90, 160, 60), 255).astype(np.uint8)
    read = read_turnaround(front, side, back, size=SIZE)
    assert any("better unmirrored" in one for one in read.warnings) == is_asked


def test_on_the_page_sentences_name_buttons_and_no_options():
    front, side, back = _arrays(paint(view) for view in VIEWS)
    with worded_for_page():
        read = read_turnaround(front, side, back, size=SIZE)
        guessed = read_views({viewpoint("front"): front, viewpoint("back"): back}, size=SIZE)
    told = " ".join((*read.assumptions, *read.warnings, *guessed.warnings))
    assert (
        "If it looks the other way, call it right." in told
        and "“As drawn” takes" in told
        and "--" not in told
    )


def test_of_two_sides_none_is_advised_to_take_the_name_of_the_other():
    front, left, right = _arrays((paint("front"), paint("side"), ImageOps.mirror(paint("side"))))
    drawn = {viewpoint("front"): front, viewpoint("left"): left, viewpoint("right"): right}
    told = " ".join(read_views(drawn, size=SIZE).assumptions)
    assert "swap the two" in told and "--side" not in told


def test_what_was_assumed_is_told_and_drawn(reference):
    told = " ".join(reference.assumptions)
    for word in ("alpha", "heights", "floor line", "left side", "--side right"):
        assert word in told
    picture = reference.picture
    assert picture.dtype == np.uint8 and picture.shape[1] == 3 * 320
    assert (picture == (220, 40, 40)).all(-1).sum() > 1000  # outlines
    assert (picture == (30, 90, 200)).all(-1).sum() > 1500  # floor and height lines


def test_views_are_the_same_every_time(reference):
    again = read_turnaround(*_arrays(paint(view) for view in VIEWS), size=SIZE)
    assert torch.equal(again.views.images, reference.views.images)
