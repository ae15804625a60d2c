"""What a command line says of drawings: files, views, a sheet; what does not fit is said with what to type."""

import numpy as np
import pytest
from PIL import Image

from charnerf.cli.drawings import GivenDrawings, given_drawings, reading_options
from charnerf.drawings.viewpoints import viewpoint
from charnerf.errors import ConfigError, DataError
from support.painted import on_background, paint


@pytest.fixture
def files(tmp_path):
    paths = [tmp_path / f"{view}.png" for view in ("front", "side", "back")]
    for path in paths:
        on_background(paint(path.stem)).resize((200, 200)).save(path)
    return paths


@pytest.fixture
def sheet(tmp_path, files):
    page = Image.fromarray(np.concatenate([np.asarray(Image.open(file)) for file in files], axis=1))
    page.save(tmp_path / "sheet.png")
    return tmp_path / "sheet.png"


def given(files, *, views=(), side="left", order=None, figures=None, said=None) -> GivenDrawings:
    lines = [] if said is None else said
    return given_drawings(files, views, side_shows=side, order=order, figures=figures, say=lines.append)


def names(found: GivenDrawings) -> list[str]:
    return [view.name for view in found.drawings]


def test_three_files_are_front_side_and_back(files):
    assert names(given(files)) == ["front", "left", "back"]
    assert names(given(files, side="right")) == ["front", "right", "back"]
    assert names(given(files[:2])) == ["front", "left"]


def test_views_come_beside_or_instead(files):
    assert names(given(files[:2], views=[f"45={files[2]}"])) == ["front", "left", "three-quarter-front"]
    alone = given(None, views=[f"back={files[2]}", f"0={files[0]}"])
    assert names(alone) == ["back", "front"], "the first given rules"
    assert alone.drawings[viewpoint("0")] == files[0]


def test_a_sheet_is_taken_apart(sheet):
    said: list[str] = []
    found = given([sheet], said=said)
    assert set(names(found)) == {"front", "left", "back"} and found.sheet is not None
    assert any("3 figures" in line for line in said)
    assert names(given([sheet], order="back,-,front")) == ["front", "back"]
    assert names(given([sheet], figures=["30=2"])) != names(found)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"views": ["45"]}, "--view: found '45', expected VIEW=..."),
        ({"views": ["front=x.png"]}, "--view front: found this view twice"),
        ({"views": ["45=a.png", "45=b.png"]}, "--view 45: found this view twice"),
        ({"views": ["45=gone.png"]}, "--view 45=gone.png: found no such file"),
        ({"order": "front,side,back"}, "--order, --figure: found without a SHEET"),
    ],
)
def test_what_does_not_fit_is_said(files, arguments, message):
    with pytest.raises(ConfigError, match=message):
        given(files, **arguments)


def test_views_that_are_no_two_are_refused_before_the_model_is_loaded(sheet, files):
    with pytest.raises(DataError, match=r"front\.png: given for two views"):
        given([files[0], files[0]])
    with pytest.raises(DataError, match="view 45: found two drawings from this azimuth"):
        given(files[:1], views=[f"45={files[1]}", f"45.5={files[2]}"])
    with pytest.raises(DataError, match="drawings: found 1, expected at least two"):
        given([sheet], order="front,-,-")


def test_wrong_names_and_numbers_of_a_sheet(sheet, files):
    with pytest.raises(ConfigError, match="--figure: found 'two', expected a number"):
        given([sheet], figures=["back=two"])
    with pytest.raises(DataError, match="view: found 'sideways', expected one of front"):
        given([sheet], order="front,sideways,back")
    with pytest.raises(DataError, match="found one figure, expected a sheet"):
        given([files[0]])
    with pytest.raises(ConfigError, match="found 4 files, expected FRONT SIDE BACK"):
        given([*files, files[0]])


def test_a_wrong_segmenter_is_refused_before_any_work():
    assert reading_options().segment is None
    for wrong in ("net", "paper:u2net", ""):
        with pytest.raises(ConfigError, match=r"--segmenter: found .* expected paper, rembg or rembg:MODEL"):
            reading_options(segmenter=wrong)
