"""What drawing changes, what it leaves, and how far it may miss."""

from dataclasses import dataclass, replace

import pytest
import torch

from charnerf.data.augmentation.drawing import Drawing
from charnerf.data.drawing_style import (
    EXACT,
    contour_ink,
    draw_pictures,
    edge_ink,
    random_style,
)


def seeded(seed=0):
    return torch.Generator().manual_seed(seed)


@pytest.fixture
def disc():
    """Two views of a disc of radius 20 in 64 pixels, half red, half pale red."""
    y, x = torch.meshgrid(torch.arange(64) - 31.5, torch.arange(64) - 31.5, indexing="ij")
    alpha = (20.5 - (x**2 + y**2).sqrt()).clamp(0.0, 1.0)
    rgb = torch.stack((torch.full_like(x, 0.9), *(2 * [torch.where(x < 0, 0.2, 0.7)])))
    return torch.cat((rgb, alpha[None])).expand(2, 4, 64, 64).clone()


def test_a_style_that_changes_nothing_gives_the_picture_back(disc):
    drawn = draw_pictures(disc, EXACT, seeded())
    torch.testing.assert_close(drawn[:, 3], disc[:, 3], atol=1e-5, rtol=0)
    shown = disc[:, 3:] > 0.01
    torch.testing.assert_close(drawn[:, :3] * shown, disc[:, :3] * shown, atol=1e-3, rtol=0)


@pytest.mark.parametrize("width", [1.0, 1.5, 2.0, 3.0])
def test_contour_ink_is_as_wide_as_asked(width):
    """Of a half-plane: the ink across the contour sums to the width."""
    alpha = (torch.arange(24) > 9).float().expand(1, 1, 24, 24)
    ink = contour_ink(alpha, width)[0, 0, 12]
    assert float(ink[:22].sum()) == pytest.approx(width)
    assert bool((ink[:10] == 0.0).all())


def test_inner_lines_lie_on_the_dark_side_of_edges_and_nowhere_else(disc):
    ink = edge_ink(disc[:1, :3], disc[:1, 3:], 2.0)[0, 0, 32]
    assert float(ink[31]) > 0.9 and float(ink[32:].max()) < 0.05 and float(ink[:28].max()) < 0.05


def test_tones_are_as_many_as_asked_and_keep_the_hue():
    ramp = torch.linspace(0.02, 1.0, 50).expand(1, 1, 4, 50)
    picture = torch.cat((ramp, 0.5 * ramp, 0.25 * ramp, torch.ones_like(ramp)), dim=1)
    rgb = draw_pictures(picture, replace(EXACT, tones=4), seeded())[:, :3]
    tones = (rgb[0, 0, 0] * 1e3).round().unique()
    assert tones.tolist() == [143.0, 429.0, 714.0, 1000.0]
    torch.testing.assert_close(rgb[:, 1], 0.5 * rgb[:, 0], atol=1e-3, rtol=0)


def test_views_miss_by_no_more_than_their_bounds(disc):
    """Displacement of the disc's left and right edges, pixels, against the sum of all bounds."""
    style = replace(EXACT, wobble=0.01, shift=0.015, scale=0.02)
    bound = 64 * (1.3 * style.wobble + style.shift) + 20 * style.scale  # a cubic wave may overshoot its knots
    found = []
    for seed in range(12):
        for alpha in draw_pictures(disc, style, seeded(seed))[:, 3]:
            row = alpha[32]
            found += [float(row[:32].sum()) - 20.0, float(row[32:].sum()) - 20.0]
    assert max(abs(miss) for miss in found) < bound + 0.5
    assert max(abs(miss) for miss in found) > 0.3 * bound
    first, second = draw_pictures(disc, style, seeded(1))
    assert not torch.equal(first, second)  # each view has mistakes of its own


def test_one_seed_one_drawing(disc):
    def drawn(seed):
        generator = seeded(seed)
        style = random_style(generator, wobble=0.01, shift=0.01, scale=0.01)
        return draw_pictures(disc, style, generator)

    assert torch.equal(drawn(3), drawn(3))
    assert not torch.equal(drawn(3), drawn(4))
    assert float(drawn(3).min()) >= 0.0 and float(drawn(3).max()) <= 1.0


@dataclass(frozen=True)
class Views:
    """Of SourceViews what the augmentation reads."""

    images: torch.Tensor


@dataclass(frozen=True)
class Batch:
    """Of TrainBatch what the augmentation reads, and something that it leaves."""

    views: Views
    rgb: torch.Tensor


def test_only_the_source_views_of_a_batch_change(disc):
    images = disc[None].expand(2, 2, 4, 64, 64)
    batch = Batch(views=Views(images), rgb=torch.ones(2, 5, 3))
    mistakes = {"wobble": 0.01, "shift": 0.01, "scale": 0.01}
    no_draws = torch.zeros(0)
    drawn = Drawing(share=1.0, **mistakes)(batch, no_draws, seeded())
    assert drawn.rgb is batch.rgb and not torch.equal(drawn.views.images, images)
    assert not torch.equal(drawn.views.images[0], drawn.views.images[1])  # a style a character
    assert torch.equal(Drawing(share=0.0, **mistakes)(batch, no_draws, seeded()).views.images, images)
