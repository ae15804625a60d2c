"""Levels of drawings that disagree in the benchmark: level 0 is what is captured, further ones are drawn and read."""

import pytest
import torch

from charnerf.bench.levels import METRICS, VIEWS, characters_of, drawn_levels
from charnerf.evaluation.character import OURS, measure_character
from charnerf.evaluation.frames import fixed_views
from charnerf.evaluation.lpips import Lpips
from charnerf.volume.renderers.culled import CulledRenderer
from support import tiny_models
from support.subjects import LIKE


@pytest.mark.slow
def test_a_level_is_a_row_and_level_0_is_as_captured(tmp_path):
    torch.manual_seed(1)
    network = tiny_models.shake(tiny_models.tiny_model(), scale=0.15).requires_grad_(False).eval()
    renderer = CulledRenderer(**LIKE)
    (character,) = characters_of(None, "test", 1, folder=tmp_path, size=network.image_size)
    rows = drawn_levels(network, renderer, [character], levels=(0, 2))
    assert [row["level"] for row in rows] == [0, 2]
    views = (
        measure_character(
            network, renderer, character, fixed_views(character, VIEWS), lpips=Lpips(), baselines=False
        )
        .scores[OURS]
        .views
    )
    for name in METRICS:
        assert rows[0][name] == sum(view[name] for view in views) / VIEWS
    assert rows[0]["psnr"] != rows[1]["psnr"]
    assert all(row["encode_seconds"] > 0.0 and row["render_seconds"] > 0.0 for row in rows)
