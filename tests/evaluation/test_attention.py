import math

import pytest
import torch

from charnerf.data.characters import load_character
from charnerf.errors import ConfigError
from charnerf.evaluation.attention import (
    AttentionProfile,
    attention_profile,
    mean_parts,
    view_attention_of,
)
from charnerf.evaluation.records import read_record, write_record
from charnerf.geometry.safe import safe_normalize
from charnerf.models.combinators.view_attention import ViewAttention
from charnerf.volume.quadrature.constant import PiecewiseConstant
from charnerf.volume.renderers.culled import CulledRenderer
from support import tiny_models

WIDTH, HEADS, POINTS, VIEWS = 12, 3, 9, 4


@pytest.fixture
def attention():
    torch.manual_seed(3)
    combinator = ViewAttention(
        **{"width": WIDTH, "num_heads": HEADS, "attention_width": None, "residual": False, "norm": True},
        **{"temperature": None, "view_scale": 1.7, "lr_scale": 1.0},
    )
    return tiny_models.shake(combinator.double())


@pytest.fixture
def given():
    features = torch.randn(POINTS, VIEWS, WIDTH, dtype=torch.float64)
    dirs = safe_normalize(torch.randn(POINTS, 3, dtype=torch.float64))
    sources = safe_normalize(torch.randn(POINTS, VIEWS, 3, dtype=torch.float64))
    return features, dirs, sources


def test_the_parts_sum_to_the_dot_product_of_the_concatenated_vectors(attention, given):
    """Paper: Q = V + d and K = V + d^(i), concatenated; the split is exact because a sum over parts is a sum."""
    features, dirs, sources = given
    scale = attention.view_scale
    queries = safe_normalize(attention.split(attention.queries(features)))  # (P, V, K, D / K)
    keys = safe_normalize(attention.split(attention.keys(features)))
    own = (scale * dirs)[:, None, None].expand(-1, VIEWS, HEADS, -1)
    theirs = (scale * sources)[:, :, None].expand(-1, -1, HEADS, -1)
    whole = torch.einsum("pvkd,pwkd->pkvw", torch.cat((queries, own), -1), torch.cat((keys, theirs), -1))
    whole = whole / math.sqrt(WIDTH // HEADS + 3)
    logits = attention.logits(features, dirs, sources)
    torch.testing.assert_close(logits.features + logits.view, whole, rtol=0.0, atol=1e-13)


def test_means_of_the_parts_sum_to_the_mean_and_weights_to_one(attention, given):
    logits = attention.logits(*given)
    valid = torch.ones(POINTS, VIEWS, dtype=torch.bool)
    features, view, weights = mean_parts(logits, valid)
    torch.testing.assert_close(features + view, (logits.features + logits.view).mean((0, 2, 3)))
    torch.testing.assert_close(view, view[:1].expand(HEADS))  # every head holds the whole direction
    torch.testing.assert_close(weights.sum(-1), torch.ones(HEADS, dtype=torch.float64))
    valid[:, 1] = False
    assert not mean_parts(logits, valid)[2][:, 1].any()


@pytest.fixture(scope="module")
def profile(figure_dataset):
    model = tiny_models.tiny_model(
        combining="view_mha", head="radiance", density="view_dependent", features="image"
    )
    tiny_models.shake(model, seed=1)
    renderer = CulledRenderer(
        quadrature=PiecewiseConstant(), num_coarse=8, num_fine=0, hull_steps=32, memory_mib=128.0
    )
    doll = load_character(figure_dataset, "doll")
    return model.eval(), attention_profile(model.eval(), renderer, [doll], step_deg=30, size=16)


def test_the_view_part_follows_the_papers_curve(profile):
    """s^2 / sqrt(d_k) / 3 times cos x + cos(x - 90) + cos(x - 180), up to the pinhole's few degrees."""
    model, found = profile
    combinator = view_attention_of(model)
    factor = combinator.scale * combinator.view_scale.item() ** 2 / 3.0
    assert found.view_factor == pytest.approx(factor)
    theory = [
        factor * sum(math.cos(math.radians(azimuth - source)) for source in (0, 90, 180))
        for azimuth in found.azimuth_deg
    ]
    assert found.curve == pytest.approx(theory, abs=1e-6)
    for view, expected in zip(found.view, found.curve, strict=True):
        assert view == pytest.approx([expected] * len(view), abs=0.1 * factor)
    assert found.sources == ["front", "side", "back"]
    assert found.num_points > 12 * 5


def test_a_profile_is_read_as_it_was_written(profile, tmp_path):
    write_record(tmp_path / "attention.json", profile[1])
    assert (
        read_record(tmp_path / "attention.json", AttentionProfile, what="an attention profile") == profile[1]
    )


def test_other_combinators_have_no_view_part():
    with pytest.raises(ConfigError, match="found Mean, expected view_mha"):
        view_attention_of(tiny_models.tiny_model(combining="mean"))
