"""The page's examples: there, small, and what the embedded generator makes."""

import numpy as np
import pytest
from PIL import Image

from charnerf.app.examples import EXAMPLES, draw_example, example_files


def test_all_are_there_and_small():
    files = [file for name in EXAMPLES for file in example_files(name)]
    assert len(files) == 8 and all(file.is_file() for file in files)
    assert sum(file.stat().st_size for file in files) < 500_000


@pytest.mark.slow
@pytest.mark.parametrize("name", EXAMPLES)
def test_they_are_drawn_by_the_generator(name):
    for view, pixels in draw_example(EXAMPLES[name]).items():
        (file,) = (one for one in example_files(name) if one.stem == view)
        with Image.open(file) as picture:
            np.testing.assert_allclose(np.asarray(picture).astype(int), pixels.astype(int), atol=8)
