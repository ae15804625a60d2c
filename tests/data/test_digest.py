"""The digest names the content of a split, whoever made it and however many characters lie beside it."""

import shutil

import numpy as np
import pytest
from PIL import Image

from charnerf.capture.generated import generate_dataset
from charnerf.data.digest import split_digest
from charnerf.errors import DataError

SETTINGS = {"seed": 5, "views": 1, "size": 16}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    root = tmp_path_factory.mktemp("digest") / "one"
    generate_dataset(root, 0, 1, 1, **SETTINGS, processes=1)
    return root


def test_a_test_split_does_not_depend_on_the_training_characters(made, tmp_path):
    other = tmp_path / "other"
    generate_dataset(other, 1, 0, 1, **SETTINGS, processes=2)  # made in processes of their own
    assert split_digest(other, "test") == split_digest(made, "test")
    assert split_digest(other, "train") != split_digest(other, "test")
    with pytest.raises(DataError, match="val"):
        split_digest(other, "val")


def test_it_follows_pixels_and_names_and_not_the_files_bytes(made, tmp_path):
    root = tmp_path / "copy"
    shutil.copytree(made, root)
    file = root / "test-00000/sources/side.png"
    before = split_digest(made, "test")
    picture = Image.open(file)
    picture.save(file, compress_level=0)
    assert file.read_bytes() != (made / "test-00000/sources/side.png").read_bytes()
    assert split_digest(root, "test") == before
    pixels = np.array(picture)
    pixels[8, 8, 0] ^= 1
    Image.fromarray(pixels).save(file)
    assert split_digest(root, "test") != before
    shutil.rmtree(root)
    shutil.copytree(made, root)
    (root / "test-00000").rename(root / "test-00001")
    text = (root / "dataset.json").read_text().replace("test-00000", "test-00001")
    (root / "dataset.json").write_text(text)
    assert split_digest(root, "test") != before
