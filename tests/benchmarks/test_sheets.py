"""Composed sheets are judged by what was found, named and aligned, and by whether anything was asked."""

import io
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from benchmarks.sheets import Composed, compose, judged, naming, read_right
from charnerf.drawings.read_sheet import read_sheet
from support.painted import paint


@pytest.fixture(scope="module")
def cut():
    """Front, left and back, a mark where the face is, and less on the back."""
    pictures = {"front": paint("front"), "left": paint("side"), "back": paint("back")}
    views = {}
    for name, picture in pictures.items():
        small = np.asarray(picture.resize((260, 260), Image.Resampling.BOX), np.float32) / 255.0
        views[name] = small
    return views


def test_a_page_is_right_only_as_it_was_composed(cut, tmp_path):
    page = compose(cut, seed=2)
    (tmp_path / "page.jpg").write_bytes(page.page)
    read = read_sheet(tmp_path / "page.jpg")
    named = replace(page, names=tuple(view.name for view in read.views))
    assert judged(read, named)["right"] == 1
    swapped = replace(named, names=(*named.names[1:], named.names[0]))
    moved = replace(
        named, boxes=tuple((left + 50, top, right + 50, down) for left, top, right, down in page.boxes)
    )
    other = replace(named, figures=tuple(figure[:, : figure.shape[1] // 2] for figure in page.figures))
    for wrong in (swapped, moved, other):
        assert not judged(read, wrong)["right"] and judged(read, wrong).total() == 1


def test_an_empty_page_is_refused(cut):
    coded = io.BytesIO()
    Image.new("RGB", (300, 200), (250, 250, 250)).save(coded, "JPEG")
    assert read_right(Composed(coded.getvalue(), (), (), (), False)) == Counter(["refused"])


def test_every_order_is_named_and_every_sheet_counted(cut):
    rows = list(naming([cut]))
    assert len(rows) == 6 and {row["sheets"] for row in rows} == {1}
    for row in rows:
        assert row["right"] + row["wrong and asked about"] + row["silently wrong"] == 1
