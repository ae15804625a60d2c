"""Names of figures: what a file's name tells, and the order in which views rule."""

from pathlib import Path

import pytest

from charnerf.app.figures import Figure, in_order, view_by_name, view_text
from charnerf.drawings.viewpoints import viewpoint
from charnerf.errors import DataError


@pytest.mark.parametrize(
    ("title", "view"),
    [
        ("front.png", "front"),
        ("Hero_Front-2.PNG", "front"),
        ("héros back (1).jpg", "back"),
        ("rear.webp", "back"),
        ("side.png", "side"),
        ("profile left.png", "left"),
        ("three-quarter-front.png", None),
        ("front and back.png", None),
        ("backpack.png", None),
        ("IMG_0001.jpg", None),
    ],
)
def test_a_name_tells_a_view_only_where_it_is_plain(title, view):
    assert view_by_name(title) == view


@pytest.mark.parametrize("text", ["front", "45,20", "350", "left"])
def test_a_view_is_read_as_it_is_written(text):
    assert viewpoint(view_text(viewpoint(text))) == viewpoint(text)


def figure(number, view):
    return Figure(number, Path("a.png"), "a.png", None, (0, 0, 1, 1), view)


def test_the_front_rules_and_two_of_one_view_do_not_pass():
    views = ("back", "", "right", "left", "0")
    assert [one.number for one in in_order(figure(i, view) for i, view in enumerate(views))] == [4, 3, 2, 0]
    with pytest.raises(DataError, match="Two figures are called front"):
        in_order([figure(1, "front"), figure(2, "360")])
    with pytest.raises(DataError, match="one view so far"):
        in_order([figure(1, "front"), figure(2, "")])
