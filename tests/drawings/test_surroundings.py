"""What stands beside a figure in its picture is left out, whatever it is; the figure is as without it."""

import numpy as np
import pytest
from PIL import Image, ImageCms, ImageDraw, ImageFilter

from charnerf.drawings.background import find_checkerboard
from charnerf.drawings.cutout import Cutout, cut_out
from charnerf.drawings.load import load_drawing
from charnerf.drawings.surroundings import count_figures, cut_edges
from charnerf.drawings.turnaround import read_views
from charnerf.drawings.viewpoints import viewpoint
from charnerf.errors import DataError
from charnerf.reconciling.agreement import iou

PAPER, SIZE = (250, 245, 239), 400


def draw_figure(picture: Image.Image, *, x: int = 200) -> None:
    """Head, shirt, two legs with a gap of 8 pixels, dark shoes; every part inked."""
    draw = ImageDraw.Draw(picture)
    parts = [
        ((-30, 60, 30, 120), (235, 190, 150), draw.ellipse),
        ((-40, 120, 40, 220), (200, 60, 50), draw.rectangle),
        ((-34, 220, -4, 330), (50, 70, 140), draw.rectangle),
        ((4, 220, 34, 330), (50, 70, 140), draw.rectangle),
        ((-38, 330, -4, 348), (40, 40, 42), draw.rectangle),
        ((4, 330, 38, 348), (40, 40, 42), draw.rectangle),
    ]
    for (left, top, right, bottom), color, shape in parts:
        shape((x + left, top, x + right, bottom), fill=color, outline=(20, 20, 20), width=2)


def on_paper(color: tuple[int, int, int] = PAPER) -> Image.Image:
    picture = Image.new("RGB", (SIZE, SIZE), color)
    draw_figure(picture)
    return picture


def with_alpha() -> Image.Image:
    picture = Image.new("RGBA", (SIZE, SIZE))
    draw_figure(picture)
    return picture


def saved(tmp_path, picture: Image.Image, name: str = "drawing.png", **options) -> Cutout:
    picture.save(tmp_path / name, **options)
    return cut_out(load_drawing(tmp_path / name))


TRUTH = np.asarray(with_alpha())[..., 3] / 255.0


def test_a_drawn_checkerboard_is_transparency(tmp_path):
    """Cells of 8, and of 11.5 pixels as after a change of size; light or dark, as a PNG or a JPEG."""
    for cell, light, dark in ((8.0, 255, 204), (11.5, 255, 239), (16.0, 102, 153)):
        y, x = np.mgrid[:SIZE, :SIZE]
        odd = (np.floor(x / cell) + np.floor(y / cell)) % 2
        grey = np.where(odd == 1, dark, light).astype(np.uint8)
        picture = Image.fromarray(np.stack([grey] * 3, axis=-1))
        draw_figure(picture)
        for name, options in (("drawing.png", {}), ("drawing.jpg", {"quality": 80})):
            found = saved(tmp_path, picture, name, **options)
            assert iou(found.rgba[..., 3], TRUTH) > 0.97, (cell, name)
            assert light - dark < 20 or "checkerboard" in found.notes[0], "a faint one passes for plain paper"


def test_paper_and_stripes_are_no_checkerboard():
    rng = np.random.default_rng(0)
    lab = np.full((64, 64, 3), (97.0, 0.0, 2.0))
    assert find_checkerboard(lab) is None
    assert find_checkerboard(lab + rng.normal(0.0, 2.0, lab.shape)) is None
    lab[:, (np.arange(64) // 8) % 2 == 1, 0] = 80.0
    assert find_checkerboard(lab) is None


def test_a_shadow_on_the_ground_is_no_part_of_the_figure(tmp_path):
    """By its alpha, strong and faint; on paper, soft and hard."""
    ellipse = (90, 325, 310, 365)
    for opacity in (60, 150):
        shadow = Image.new("RGBA", (SIZE, SIZE))
        ImageDraw.Draw(shadow).ellipse(ellipse, fill=(0, 0, 0, opacity))
        shadow = Image.alpha_composite(shadow.filter(ImageFilter.GaussianBlur(4)), with_alpha())
        found = saved(tmp_path, shadow)
        assert iou(found.rgba[..., 3], TRUTH) > 0.97 and "shadow" in found.notes[1], opacity
    for blur in (0, 5):
        paper = Image.new("RGB", (SIZE, SIZE), PAPER)
        ImageDraw.Draw(paper).ellipse(ellipse, fill=tuple(round(0.7 * one) for one in PAPER))
        paper = paper.filter(ImageFilter.GaussianBlur(blur))
        draw_figure(paper)
        found = saved(tmp_path, paper)
        assert iou(found.rgba[..., 3], TRUTH) > 0.97, blur
        assert any("shadow" in note for note in found.notes)


def test_a_figure_without_a_shadow_loses_nothing(tmp_path):
    """Grey shoes and a wide grey skirt on white paper stay."""
    for picture in (on_paper((255, 255, 255)), with_alpha()):
        assert not any("shadow" in note for note in saved(tmp_path, picture).notes)
    picture = on_paper((255, 255, 255))
    ImageDraw.Draw(picture).polygon(
        [(180, 200), (220, 200), (270, 300), (130, 300)], fill=(150, 150, 150), outline=(20, 20, 20)
    )
    found = saved(tmp_path, picture)
    assert found.rgba[295, 135:265, 3].min() == 1.0 and not any("shadow" in note for note in found.notes)


def test_a_frame_and_a_scanners_edge_are_left_out(tmp_path):
    framed = on_paper()
    ImageDraw.Draw(framed).rectangle((8, 8, SIZE - 9, SIZE - 9), outline=(0, 0, 0), width=3)
    scanned = on_paper()
    ImageDraw.Draw(scanned).rectangle((0, 0, 9, SIZE), fill=(30, 28, 28))
    for picture, window in ((framed, 11), (scanned, None)):
        found = saved(tmp_path, picture)
        assert "a frame or an edge" in found.notes[0]
        height, width = found.rgba.shape[:2]
        top = window + 1 if window else 1
        left = window + 1 if window else 11
        assert iou(found.rgba[..., 3], TRUTH[top : top + height, left : left + width]) > 0.98


def test_an_outline_is_no_frame(tmp_path):
    """A pale figure in a T pose whose ink alone differs clearly from the paper, and spans the picture."""
    picture = Image.new("RGB", (SIZE, SIZE), (255, 255, 255))
    draw = ImageDraw.Draw(picture)
    points = [
        (185, 10),
        (215, 10),
        (215, 100),
        (395, 110),
        (395, 130),
        (215, 140),
        (240, 390),
        (160, 390),
        (185, 140),
    ]
    points += [(5, 130), (5, 110), (185, 100)]
    draw.polygon(points, fill=(225, 232, 240), outline=(20, 20, 20), width=3)
    found = saved(tmp_path, picture)
    assert not any("frame" in note for note in found.notes)
    assert found.rgba.shape[:2] == (SIZE, SIZE) and found.rgba[250, 200, 3] == 1.0


def test_a_gap_that_compression_blurs_stays_open(tmp_path):
    """JPEG at quality 60: the paper between the legs, 8 pixels wide, is paper; and so is what lies beside outlines."""
    found = saved(tmp_path, on_paper(), "drawing.jpg", quality=60)
    assert iou(found.rgba[..., 3], TRUTH) > 0.97
    assert found.rgba[240:320, 200, 3].max() < 0.5


def test_color_that_compression_spreads_is_no_part_of_the_figure(tmp_path):
    """JPEG stores colour at half the size, so that yellow soles bleed up to 16 pixels far into bluish paper."""
    for down in (306, 318):
        picture = Image.new("RGB", (SIZE, SIZE), (214, 220, 228))
        ImageDraw.Draw(picture).rectangle((160, 100, 239, down), fill=(150, 60, 50))
        ImageDraw.Draw(picture).rectangle((160, 300, 239, down), fill=(255, 212, 64))
        found = saved(tmp_path, picture, "drawing.jpg", quality=60).rgba[..., 3] > 0.5
        assert found.sum() == pytest.approx(80 * (down - 99), rel=0.005), down


def test_a_swatch_at_the_border_is_no_noise_of_the_paper(tmp_path):
    """A pale figure stays whole beside something of nearly the paper's colour on the margin."""
    picture = Image.new("RGB", (SIZE, SIZE), (214, 220, 228))
    ImageDraw.Draw(picture).rectangle((150, 60, 250, 340), fill=(228, 232, 238))
    ImageDraw.Draw(picture).rectangle((0, 100, 7, 140), fill=(232, 232, 226))
    assert saved(tmp_path, picture).rgba[70:330, 160:240, 3].min() == 1.0


def test_pale_clothes_stay_closed_in_a_jpeg(tmp_path):
    picture = Image.new("RGB", (SIZE, SIZE), (255, 255, 255))
    draw_figure(picture)
    ImageDraw.Draw(picture).rectangle(
        (160, 120, 240, 220), fill=(243, 243, 240), outline=(20, 20, 20), width=3
    )
    assert iou(saved(tmp_path, picture, "drawing.jpg", quality=60).rgba[..., 3], TRUTH) > 0.97


def test_colours_come_as_their_profile_says(tmp_path):
    """A picture in another profile reads as its colours in sRGB; one in sRGB is not touched, a broken one is named."""
    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB"))
    plain = on_paper()
    plain.save(tmp_path / "plain.png")
    plain.save(tmp_path / "srgb.png", icc_profile=srgb.tobytes())
    expected = load_drawing(tmp_path / "plain.png").rgba
    assert np.array_equal(load_drawing(tmp_path / "srgb.png").rgba, expected)
    plain.save(tmp_path / "broken.png", icc_profile=b"no profile at all")
    with pytest.raises(DataError, match=r"broken\.png: found a colour profile"):
        load_drawing(tmp_path / "broken.png")
    wide = swapped_profile(srgb.tobytes())
    plain.save(tmp_path / "swapped.png", icc_profile=wide)
    found = load_drawing(tmp_path / "swapped.png").rgba
    shirt, was = found[170, 200], expected[170, 200]
    assert shirt[2] > 0.9 * was[0] and shirt[0] < was[0], "what the file calls red is this profile's blue"


def swapped_profile(profile: bytes) -> bytes:
    """An sRGB profile whose red and blue primaries are exchanged, under another name."""
    table = {}
    count = int.from_bytes(profile[128:132], "big")
    for index in range(count):
        entry = 132 + 12 * index
        table[profile[entry : entry + 4]] = entry
    changed = bytearray(profile)
    red, blue = table[b"rXYZ"], table[b"bXYZ"]
    changed[red + 4 : red + 12], changed[blue + 4 : blue + 12] = (
        profile[blue + 4 : blue + 12],
        profile[red + 4 : red + 12],
    )
    return (
        bytes(changed)
        .replace("sRGB".encode("utf-16-be"), "xRGB".encode("utf-16-be"))
        .replace(b"sRGB b", b"xRGB b")
    )


def test_a_sheet_given_as_one_view_is_said_to_be_one(tmp_path):
    sheet = Image.new("RGB", (600, SIZE), PAPER)
    for x in (100, 300, 500):
        draw_figure(sheet, x=x)
    with pytest.raises(
        DataError, match=r"drawing\.png: found 3 figures side by side, expected one: .* sheet"
    ):
        saved(tmp_path, sheet)


def test_a_figure_with_a_staff_is_one_figure():
    mask = np.zeros((100, 100), dtype=bool)
    mask[10:90, 30:60] = True
    mask[5:95, 70:74] = True  # a staff beside it
    assert count_figures(mask) == 1
    mask[10:90, 80:98] = True
    assert count_figures(mask) == 2


@pytest.mark.parametrize(
    ("window", "edges"),
    [
        ((slice(0, 60), slice(0, 60)), []),
        ((slice(10, 51), slice(10, 51)), []),  # tight: the outline's translucent pixels lie on all four edges
        ((slice(10, 40), slice(10, 51)), ["lower"]),
        ((slice(20, 51), slice(10, 35)), ["upper", "right"]),
    ],
)
def test_a_cut_is_opaque_where_a_tight_crop_is_not(window, edges):
    rows, columns = np.mgrid[:60, :60]
    disc = np.clip(20.4 - np.hypot(rows - 30, columns - 30), 0.0, 1.0)
    assert cut_edges(disc[window]) == edges
    assert cut_edges((disc[window] > 0.5).astype(float)) == [], "hard outlines say nothing"


def test_a_figure_that_is_cut_off_is_asked_about():
    rows, columns = np.mgrid[:200, :100]
    figure = np.full((200, 100, 4), 0.4)
    figure[..., 3] = np.clip(80.4 - np.hypot(rows - 100, (columns - 50) * 2.0), 0.0, 1.0)
    cut = {viewpoint("front"): figure, viewpoint("left"): figure[:150]}
    doubts = [str(one) for one in read_views(cut, size=32).doubts if "cut off" in str(one)]
    assert len(doubts) == 1 and doubts[0].startswith("the left drawing") and "lower edge" in doubts[0]
