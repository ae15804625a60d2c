"""Grown models: the same answers everywhere, gradients for what is new, and refusals."""

import itertools

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from charnerf.errors import ShapeError
from charnerf.geometry.safe import safe_normalize
from charnerf.models.growth import grow_from
from support import tiny_models


def pair(*, width: int = 20, num_blocks: int = 2, **options) -> tuple[torch.nn.Module, torch.nn.Module]:
    """A shaken small model and a fresh larger one."""
    torch.manual_seed(0)
    small = tiny_models.shake(tiny_models.tiny_model(**options))
    return small, tiny_models.tiny_model(width=width, num_blocks=num_blocks, **options)


def combinations():
    """Any three of the choices in every combination, in half of the cases; the other half is slow."""
    choices = (("mean", "learned"), ("blend", "radiance"), ("view_free", "view_dependent"), (False, True))
    for picks in itertools.product((0, 1), repeat=4):
        values = (options[pick] for options, pick in zip(choices, picks, strict=True))
        yield pytest.param(*values, marks=[pytest.mark.slow] if sum(picks) % 2 else [])


@pytest.mark.parametrize(("combining", "head", "density", "fine"), list(combinations()))
def test_a_grown_model_answers_as_the_small_one(person_views, combining, head, density, fine):
    options = {"combining": combining, "head": head, "density": density, "fine": fine}
    small, large = pair(**options)
    grow_from(large, small)
    points = torch.rand(200, 3, generator=torch.Generator().manual_seed(1)) * 2.0 - torch.tensor(
        (1.0, 1.0, 0.0)
    )
    dirs = safe_normalize(points - 0.3)
    hull = small.carve(person_views)
    answers = []
    for model in (small, large):
        with torch.no_grad():
            scene = model.scene(model.encode(person_views, hull), 0)
            answers.append((scene.coarse(points, dirs), scene.field(points, dirs)))
    for mine, its in zip(*answers, strict=True):
        torch.testing.assert_close(mine.rgb, its.rgb, atol=1e-5, rtol=1e-4)
        torch.testing.assert_close(mine.densities, its.densities, atol=1e-4, rtol=1e-4)
    assert answers[0][1].densities.std() > 0.0


@settings(max_examples=10, deadline=None)
@given(width=st.integers(2 * tiny_models.WIDTH, 40), num_blocks=st.integers(1, 3))
def test_what_is_new_learns_from_the_first_step(person_views, width, num_blocks):
    """New units are written at random and read by none: the gradient reaches the weights that would read them."""
    small, large = pair(width=width, num_blocks=num_blocks)
    grow_from(large, small)
    scene = large.scene(large.encode(person_views, small.carve(person_views)), 0)
    points = torch.rand(50, 3, generator=torch.Generator().manual_seed(2)) + torch.tensor((-0.5, -0.5, 0.5))
    scene.coarse(points, torch.ones_like(points)).rgb.square().sum().backward()
    gradient = large.coarse.multi_view.blocks[0].first.weight.grad
    assert gradient[: tiny_models.WIDTH, tiny_models.WIDTH :].abs().sum() > 0.0
    assert large.coarse.multi_view.blocks[-1].second.weight.grad.abs().sum() > 0.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"width": 8}, r"found \(8, .* for a trained \(12"),
        ({"combining": "view_mha"}, "answer otherwise once they are larger"),
        ({"single_view": "camera", "num_blocks": 2}, "answer otherwise once they are larger"),
    ],
)
def test_what_can_not_grow_is_refused(changes, message):
    small, large = pair(**{"num_blocks": 1, **changes})
    with pytest.raises(ShapeError, match=message):
        grow_from(large, small)


def test_other_parts_are_refused():
    small, _ = pair()
    with pytest.raises(ShapeError, match=r"other parts in the two models: coarse\.head"):
        grow_from(tiny_models.tiny_model(head="radiance", width=20), small)
