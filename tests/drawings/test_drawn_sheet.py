"""Figures are found on a sheet and named; what stands beside them is left aside."""

import numpy as np
import pytest
from PIL import Image, ImageDraw, ImageFont

from charnerf.drawings.align import figure_box, half_extent, on_one_scale, place
from charnerf.drawings.cutout import cut_out
from charnerf.drawings.load import drawing_from_array
from charnerf.drawings.naming import Naming, colors_look_left, looks_left, name_views
from charnerf.drawings.read_sheet import read_sheet
from charnerf.drawings.sheet import find_figures
from charnerf.drawings.turnaround import read_views
from charnerf.drawings.viewpoints import Viewpoint, between_square_ones, viewpoint
from charnerf.errors import DataError
from support.painted import SCALE, paint

PAPER = (250, 247, 238)
EYE = 0.045 * SCALE


def figure(view: str, height: int) -> Image.Image:
    """A painted figure cut to its box, with eyes where it has a face; `right` looks to the picture's right."""
    picture = paint("side" if view == "right" else view)
    draw = ImageDraw.Draw(picture)
    if view == "front":
        for x in (-0.1, 0.1):
            middle, down = (1.3 + x) * SCALE, (1.3 + 1.0 - 1.8) * SCALE
            draw.ellipse((middle - EYE, down - EYE, middle + EYE, down + EYE), fill=(20, 60, 30, 255))
    if view in ("side", "right"):
        draw.ellipse(
            ((1.3 - 0.16) * SCALE, 0.5 * SCALE - EYE, (1.3 - 0.07) * SCALE, 0.5 * SCALE + EYE),
            fill=(20, 60, 30, 255),
        )
        draw.rectangle(
            ((1.3 - 0.3) * SCALE, 2.2 * SCALE, (1.3 - 0.1) * SCALE, 2.3 * SCALE), fill=(70, 40, 30, 255)
        )  # toes
    if view == "back":
        draw.pieslice(
            ((1.3 - 0.25) * SCALE, 0.3 * SCALE, (1.3 + 0.25) * SCALE, 0.8 * SCALE),
            0,
            360,
            fill=(90, 50, 20, 255),
        )
    if view == "right":
        picture = picture.transpose(Image.Transpose.FLIP_LEFT_RIGHT)
    picture = picture.crop(picture.getbbox())
    return picture.resize((round(picture.width * height / picture.height), height), Image.Resampling.BOX)


def sheet(
    views, *, height=400, rows=1, lines=False, extras=True, jpeg_noise=False
) -> tuple[np.ndarray, list]:
    """A sheet of figures, and their boxes."""
    columns = -(-len(views) // rows)
    page = Image.new("RGB", (260 + 420 * columns, 160 + (height + 80) * rows), PAPER)
    draw, boxes = ImageDraw.Draw(page), []
    for place_, view in enumerate(views):
        picture = figure(view, height)
        left, top = 120 + 420 * (place_ % columns), 90 + (height + 80) * (place_ // columns)
        page.paste(picture, (left, top), picture)
        boxes.append((left, top, left + picture.width, top + height))
    if extras:
        draw.text((20, 12), "HERO, turnaround", fill=(30, 30, 30), font=ImageFont.load_default(size=30))
        for number in range(4):
            draw.rectangle(
                (30 + 40 * number, page.height - 50, 60 + 40 * number, page.height - 20),
                fill=(200, 40 * number, 90),
            )
    if lines:
        for y in (90, 90 + height // 2, 90 + height):
            draw.line((0, y, page.width, y), fill=(150, 170, 210), width=1)
    pixels = np.asarray(page).astype(np.float64)
    if jpeg_noise:
        pixels += np.random.default_rng(0).normal(0.0, 2.0, pixels.shape)
    return pixels.clip(0, 255).astype(np.uint8), boxes


def near(found, expected) -> bool:
    return all(abs(a - b) <= 3 for a, b in zip(found, expected, strict=True))


@pytest.mark.parametrize("lines", [False, True])
@pytest.mark.parametrize("jpeg_noise", [False, True])
def test_figures_are_found_and_the_rest_is_left_aside(lines, jpeg_noise):
    pixels, boxes = sheet(["front", "side", "back"], lines=lines, jpeg_noise=jpeg_noise)
    found = find_figures(drawing_from_array(pixels, "sheet"))
    assert len(found.figures) == 3
    assert all(near(one.box, box) for one, box in zip(found.figures, boxes, strict=True))
    reasons = {one.reason for one in found.left_aside}
    assert "a swatch or a panel" in reasons and "a detail or text" in reasons
    assert ("a line" in reasons) == lines


def test_edges_of_a_figure_are_no_lines_though_they_run_on_through_its_trunk():
    page = np.full((300, 600, 3), 255, np.uint8)
    for left in (100, 300):
        page[60:215, left : left + 40] = (60, 90, 160)  # a trunk, taller than a line is long
        page[215:240, left : left + 4] = (60, 90, 160)  # a thin leg below it, in the same columns
    found = find_figures(drawing_from_array(page, "sheet"))
    assert not [one for one in found.left_aside if one.reason == "a line"]
    page[148:150] = (150, 150, 200)
    lines = [
        one for one in find_figures(drawing_from_array(page, "sheet")).left_aside if one.reason == "a line"
    ]
    assert sum(right - left for left, _, right, _ in (one.box for one in lines)) > 400


def test_an_antenna_ends_in_its_figure_and_an_axis_goes_through_it():
    page = np.full((300, 600, 3), 255, np.uint8)
    for left in (100, 300):
        page[100:250, left : left + 60] = (60, 90, 160)
        # with the trunk below it longer than a line is at least
        page[60:100, left + 10 : left + 13] = (60, 90, 160)
    page[40:270, 330:332] = (150, 150, 200)
    found = find_figures(drawing_from_array(page, "sheet"))
    assert [one.box for one in found.figures] == [(100, 60, 160, 250), (300, 60, 360, 250)]
    assert [one.box for one in found.left_aside if one.reason == "a line"] == [
        (330, 40, 332, 100),
        (330, 250, 332, 270),
    ]


def test_a_hand_beyond_a_cuff_of_the_papers_colour_is_the_figures():
    page = np.full((300, 1000, 3), 255, np.uint8)
    for left in (100, 600):
        page[60:240, left : left + 60] = page[120:135, left : left + 120] = (60, 90, 160)
        page[120:135, left + 125 : left + 150] = (200, 140, 110)  # a hand, past the box, 5 pixels on
        # what it holds, beyond a ring of the paper's colour
        page[120:135, left + 155 : left + 160] = (60, 90, 160)
        page[120:122, left + 165 : left + 167] = (200, 140, 110)  # a speck
        page[120:135, left + 200 : left + 225] = (200, 140, 110)  # a detail
    found = find_figures(drawing_from_array(page, "sheet"))
    assert [one.box[2] for one in found.figures] == [260, 760]
    assert [one.reason for one in found.left_aside if one.box[3] > 122] == ["a swatch or a panel"] * 2


def test_a_figure_that_a_beard_of_the_papers_colour_takes_apart_is_one():
    page = np.full((300, 600, 3), 255, np.uint8)
    for left in (100, 300, 500):
        page[60:240, left : left + 60] = (60, 90, 160)
        page[60:200, left + 40 : left + 60] = 255  # so that none is a panel
    page[130:134, 300:360] = 255
    found = find_figures(drawing_from_array(page, "sheet"))
    assert [one.box for one in found.figures] == [(left, 60, left + 60, 240) for left in (100, 300, 500)]


def test_two_rows_are_read_row_by_row():
    pixels, boxes = sheet(["front", "side", "back", "right"], rows=2)
    found = find_figures(drawing_from_array(pixels, "sheet"))
    assert all(near(one.box, box) for one, box in zip(found.figures, boxes, strict=True))


def test_a_crop_holds_its_figure_alone():
    pixels, boxes = sheet(["front", "side", "back"], lines=True)
    for one, box in zip(find_figures(drawing_from_array(pixels, "sheet")).figures, boxes, strict=True):
        alpha = cut_out(one.drawing).rgba[..., 3]
        found = figure_box(alpha, "figure")
        assert found.height == pytest.approx(box[3] - box[1], abs=3)
        assert found.right - found.left == pytest.approx(box[2] - box[0], abs=3)


def test_a_figure_that_the_border_cuts_off_is_left_aside():
    """A neighbour of the turnaround, half of it on the sheet; two figures at the border alone are taken as they are."""
    pixels, boxes = sheet(["front", "side", "back"], extras=False)
    middle = (boxes[0][0] + boxes[0][2]) // 2
    found = find_figures(drawing_from_array(pixels[:, middle:], "sheet"))
    assert len(found.figures) == 2 and found.left_aside[0].reason == "cut off by the border"
    assert near(found.figures[0].box, [boxes[1][0] - middle, boxes[1][1], boxes[1][2] - middle, boxes[1][3]])
    tight = pixels[:, boxes[0][0] : boxes[1][2]]
    assert len(find_figures(drawing_from_array(tight, "sheet")).figures) == 2


def test_an_empty_page_is_refused():
    with pytest.raises(DataError, match="page: found nothing on its background"):
        find_figures(drawing_from_array(np.full((300, 300, 3), 240, np.uint8), "page"))


def test_too_many_figures_are_refused():
    pixels, _ = sheet(["front"] * 9, height=100, rows=3, extras=False)
    with pytest.raises(DataError, match="found 9 figures, expected at most 8"):
        find_figures(drawing_from_array(pixels, "crowd"))


@pytest.mark.parametrize(
    "order", [("front", "side", "back"), ("side", "front", "back"), ("back", "right", "front")]
)
def test_views_are_named_wherever_they_stand(order):
    pixels, _ = sheet(order)
    cut = [cut_out(one.drawing).rgba for one in find_figures(drawing_from_array(pixels, "sheet")).figures]
    boxes = [figure_box(one[..., 3], "figure") for one in cut]
    extent = half_extent([(one[..., 3], box) for one, box in zip(cut, boxes, strict=True)])
    naming = name_views(
        [place(one, box, extent=extent, size=96) for one, box in zip(cut, boxes, strict=True)]
    )
    names = {"side": "left", "right": "right"}
    assert [one.name for one in naming.viewpoints] == [names.get(view, view) for view in order]


def test_front_and_back_that_show_as_much_are_asked_about():
    front, side, back = (np.array(figure(view, 300)) for view in ("front", "side", "back"))

    def named(*pictures: np.ndarray) -> Naming:
        cut = [cut_out(drawing_from_array(one, "hero")).rgba for one in pictures]
        return name_views(on_one_scale(cut, ["hero"] * len(cut), 96))

    told, alike = named(back, front), named(front, front[:, ::-1])
    assert [one.name for one in told.viewpoints] == ["back", "front"] and not told.is_doubtful
    assert [one.name for one in alike.viewpoints] == ["front", "back"] and alike.is_doubtful
    four = named(front, np.array(figure("right", 300)), back, side)
    assert [one.name for one in four.viewpoints] == ["front", "right", "back", "left"]


def test_names_and_angles_of_views():
    assert viewpoint("back") == Viewpoint(180.0) and viewpoint("right").azimuth_deg == 270.0
    assert viewpoint("45,20") == Viewpoint(45.0, 20.0) and viewpoint(-90).name == "right"
    assert viewpoint("45").name == "three-quarter-front" and viewpoint("30").name == "30 degrees"
    for wrong in ("sideways", "1,2,3", "45,", ""):
        with pytest.raises(DataError, match="expected one of front"):
            viewpoint(wrong)
    with pytest.raises(DataError, match="an elevation within 80"):
        viewpoint("0,89")


def test_a_sheet_is_read_whole():
    pixels, _ = sheet(["front", "side", "back"], lines=True)
    read = read_sheet(pixels)
    assert [view.name for view in read.drawings] == ["front", "left", "back"]
    assert read.views == tuple(read.drawings) and len(read.sheet.figures) == 3
    assert "3 figures" in read.assumptions[0] and "1 front, 2 left, 3 back" in read.assumptions[0]
    assert "a swatch or a panel (4)" in read.assumptions[1] and not read.warnings
    assert (read.picture == (220, 40, 40)).all(-1).sum() > 500


def test_what_lies_between_square_views_is_left_out_where_these_are_whole(monkeypatch):
    front, left, back, between = (Viewpoint(azimuth) for azimuth in (0.0, 90.0, 180.0, 45.0))
    assert between_square_ones([front, left, back, between]) == [between]
    assert between_square_ones([front, between, back]) == between_square_ones([front, left, between]) == []
    pixels, _ = sheet(["front", "side", "back", "right"])
    found = Naming(viewpoints=(front, left, back, between), is_doubtful=False, reasons=())
    monkeypatch.setattr("charnerf.drawings.read_sheet.name_views", lambda canvases: found)
    read = read_sheet(pixels)
    assert list(read.drawings) == [front, left, back]
    assert any(
        "which the weights were trained on: 4 (--figure three-quarter-front=4" in line
        for line in read.assumptions
    )
    taken = read_sheet(pixels, figures={"three-quarter-front": 4})
    assert between in taken.drawings
    told = read_views(taken.drawings, size=64).warnings
    assert sum("three-quarter-front: seen from between" in line for line in told) == 1


def test_names_can_be_given():
    pixels, _ = sheet(["front", "side", "back", "right"])
    named = read_sheet(pixels, order=["back", "left", "front", "-"]).drawings
    assert [view.name for view in named] == ["front", "left", "back"]
    moved = read_sheet(pixels, figures={"45": 4}).drawings
    assert Viewpoint(45.0) in moved
    with pytest.raises(
        DataError, match=r"--order: found 2 names \(front, back\), expected one for each of the 4"
    ):
        read_sheet(pixels, order=["front", "back"])
    with pytest.raises(DataError, match="--figure back=5: found no such figure, expected 1 to 4"):
        read_sheet(pixels, figures={"back": 5})


def test_a_view_or_a_figure_given_twice_is_refused():
    pixels, _ = sheet(["front", "back"], height=100, extras=False)
    for given, message in (
        ({"order": ["left", "90"]}, "--order: found left for two figures, expected each view once"),
        ({"figures": {"back": 1, "180": 2}}, "--figure: found back for two figures"),
        ({"figures": {"back": 1, "front": 1}}, "--figure front=1: found this figure given for back too"),
    ):
        with pytest.raises(DataError, match=message):
            read_sheet(pixels, **given)


def test_one_figure_is_no_sheet():
    pixels, _ = sheet(["front"])
    with pytest.raises(DataError, match="found one figure, expected a sheet with at least two views"):
        read_sheet(pixels)


def test_two_characters_are_noticed():
    pixels, boxes = sheet(["front", "side", "back"])
    left, top, right, bottom = boxes[2]
    other = pixels.copy()
    other[top:bottom, left:right] = np.where(  # a figure in other colours
        np.abs(pixels[top:bottom, left:right].astype(int) - PAPER).sum(-1, keepdims=True) > 30,
        255 - pixels[top:bottom, left:right][..., ::-1] // 2,
        pixels[top:bottom, left:right],
    )
    assert any("are they of one character?" in one for one in read_sheet(other).warnings)


def test_a_profile_looks_where_its_colours_say_though_its_feet_trail():
    figures = [figure(view, 300) for view in ("front", "side", "back")]
    trailing = ImageDraw.Draw(figures[1])  # a robe on the ground behind a figure that looks to the left
    trailing.rectangle((figures[1].width - 60, 270, figures[1].width, 300), fill=(70, 40, 30, 255))
    for x in range(0, figures[1].width // 2, 2):  # and no foot before it
        trailing.line((x, 284, x, 300), fill=(0, 0, 0, 0), width=2)
    cut = [cut_out(drawing_from_array(np.array(one), "hero")).rgba for one in figures]
    front, side, back = on_one_scale(cut, ["hero"] * 3, 128)
    assert looks_left(side, front, back)
    assert not looks_left(side[:, ::-1], front, back)
    assert colors_look_left(side, front, back) is True
    assert colors_look_left(side[:, ::-1], front, back) is False


def test_a_profile_named_after_its_other_side_is_warned_of():
    pictures = {view: np.array(figure(view, 300)) for view in ("front", "side", "right", "back")}

    def warned(side: str) -> bool:
        given = {"front": "front", "left": side, "back": "back"}
        read = read_views({viewpoint(name): pictures[one] for name, one in given.items()}, size=128)
        return any("--side right" in line for line in read.warnings)

    assert warned("right") and not warned("side")


def test_what_is_much_lower_than_the_figures_is_asked_about():
    """A sword beside its owner, as tall as a figure may be that was drawn a little too small."""
    pixels, _ = sheet(["front"], height=200, extras=False)
    paper = np.full((pixels.shape[0], 160, 3), PAPER, np.uint8)
    paper[130:290, 70:90] = paper[240:250, 50:110] = (110, 60, 40)
    told = read_sheet(np.concatenate((pixels, paper), axis=1)).warnings
    (sword,) = (line for line in told if "is 80 % as tall as figure" in line)
    assert "leave it out by --order front,-," in sword
