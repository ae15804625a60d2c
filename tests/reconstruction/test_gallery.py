"""The gallery: one row a folder, drawings as given, views by the model."""

import numpy as np
import pytest
from PIL import Image

from charnerf.errors import DataError
from charnerf.reconstruction import gallery


class RedModel:
    """Answers red pictures and notes what it was given."""

    def __init__(self):
        self.given = []

    def encode(self, **drawings):
        self.given.append(drawings)
        return self

    def render(self, *, azimuth_deg, elevation_deg, size):
        return np.broadcast_to(np.array((1.0, 0.0, 0.0, 1.0), np.float32), (size, size, 4))


@pytest.fixture
def folders(tmp_path):
    for name, side in (("one", "side.png"), ("two", "Right.jpg")):
        (tmp_path / name).mkdir()
        for file in ("front.png", side, "back.webp"):
            Image.new("RGB", (30, 60), (0, 0, 200)).save(tmp_path / name / file)
    return [tmp_path / "one", tmp_path / "two"]


def test_a_row_a_folder(folders, tmp_path):
    model = RedModel()
    output = gallery.write_gallery(model, folders, tmp_path / "pictures/gallery.png", size=40)
    assert [one["side_is"] for one in model.given] == ["left", "right"]
    picture = Image.open(output)
    assert picture.size == gallery.sheet_size(2, 40)
    centre_of_last = np.array(picture)[-20, -20]
    assert tuple(centre_of_last) == (255, 0, 0)
    first_drawing = np.array(picture)[-40:, :40]  # 30 by 60: blue in the middle, white beside it
    assert first_drawing[20, 20, 2] > 150 and tuple(first_drawing[20, 2]) == (255, 255, 255)
    assert [path.name for path in output.parent.iterdir()] == ["gallery.png"]


def test_a_missing_drawing_is_named_before_any_work(folders, tmp_path):
    (folders[1] / "back.webp").unlink()
    model = RedModel()
    with pytest.raises(DataError, match=r"two: found no picture of the back view"):
        gallery.write_gallery(model, folders, tmp_path / "gallery.png", size=40)
    assert model.given == []
    Image.new("RGB", (30, 60)).save(folders[0] / "right.png")
    with pytest.raises(DataError, match=r"right\.png, side\.png"):
        gallery.find_drawings(folders[0])
