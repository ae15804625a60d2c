import math
from pathlib import Path

import numpy as np
import pytest
import torch
from flip_evaluator import evaluate
from PIL import Image
from skimage.metrics import peak_signal_noise_ratio, structural_similarity
from torchmetrics.functional.image import structural_similarity_index_measure

from charnerf.errors import DataError, NumericalError, ShapeError
from charnerf.evaluation import metrics
from charnerf.evaluation.lpips import Lpips

EXAMPLES = Path(__file__).parent / "lpips"
PICTURE_METRICS = (metrics.psnr, metrics.ssim, metrics.flip, Lpips())


@pytest.fixture
def pair() -> tuple[torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(3)
    truth = torch.rand(40, 32, 3, generator=generator)
    return (truth + 0.1 * torch.randn(40, 32, 3, generator=generator)).clamp(0.0, 1.0), truth


def test_psnr_of_a_constant_error_by_hand():
    truth = torch.full((4, 5, 3), 0.5)
    assert metrics.psnr(truth + 0.1, truth) == pytest.approx(20.0, abs=1e-4)
    assert metrics.psnr(truth + 0.01, truth) == pytest.approx(40.0, abs=1e-3)


def test_psnr_of_equal_pictures_is_finite():
    truth = torch.rand(4, 5, 3)
    assert metrics.psnr(truth, truth) == pytest.approx(100.0)


def test_psnr_and_ssim_agree_with_scikit_image(pair):
    prediction, truth = pair
    expected = peak_signal_noise_ratio(truth.double().numpy(), prediction.double().numpy(), data_range=1.0)
    assert metrics.psnr(prediction, truth) == pytest.approx(expected, abs=1e-5)
    expected = structural_similarity(
        truth.double().numpy(),
        prediction.double().numpy(),
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        data_range=1.0,
        channel_axis=-1,
    )
    assert metrics.ssim(prediction, truth) == pytest.approx(expected, abs=1e-4)


def test_foreground_counts_only_pixels_of_alpha_above_a_half():
    truth, prediction = torch.ones(2, 2, 3), torch.ones(2, 2, 3)
    alpha = torch.tensor([[1.0, 0.5], [0.0, 0.51]])
    prediction[0, 0] = 0.9
    prediction[0, 1] = 0.0  # alpha of a half is background
    assert metrics.psnr_foreground(prediction, truth, alpha) == pytest.approx(
        -10.0 * math.log10(0.005), abs=1e-4
    )
    assert metrics.psnr_foreground(prediction, truth, torch.zeros(2, 2)) is None


def test_union_counts_what_is_missing_and_what_is_too_much():
    """Of four pixels one is right, one missing, one too much, one empty in both: two of three shown are wrong by 1."""
    truth, prediction = torch.ones(2, 2, 3), torch.ones(2, 2, 3)
    alpha, opacity = torch.tensor([[1.0, 1.0], [0.0, 0.5]]), torch.tensor([[1.0, 0.0], [1.0, 0.5]])
    truth[0] = prediction[0, 0] = prediction[1, 0] = 0.0
    found = metrics.psnr_union(prediction, truth, opacity, alpha)
    assert found == pytest.approx(-10.0 * math.log10(2.0 / 3.0))
    assert metrics.psnr_foreground(prediction, truth, alpha) == pytest.approx(-10.0 * math.log10(0.5))
    assert metrics.psnr_union(prediction, truth, torch.zeros(2, 2), torch.zeros(2, 2)) is None


def test_white_has_a_closed_form():
    """White against a black square that fills a quarter: MSE 1/4, foreground MSE 1."""
    truth, alpha = torch.ones(16, 16, 3), torch.zeros(16, 16)
    truth[:8, :8], alpha[:8, :8] = 0.0, 1.0
    white = torch.ones(16, 16, 3)
    assert metrics.psnr(white, truth) == pytest.approx(10.0 * math.log10(4.0))
    assert metrics.psnr_foreground(white, truth, alpha) == pytest.approx(0.0)
    assert metrics.silhouette_iou(torch.zeros(16, 16), alpha) == 0.0


def test_silhouette_iou_by_hand():
    found, true = torch.zeros(4, 4), torch.zeros(4, 4)
    found[:, :2], true[:, 1:3] = 0.9, 0.6
    assert metrics.silhouette_iou(found, true) == pytest.approx(1.0 / 3.0)
    assert metrics.silhouette_iou(torch.zeros(4, 4), torch.zeros(4, 4)) == 1.0


def test_flip_is_zero_for_equal_pictures_and_grows_with_the_error(pair):
    prediction, truth = pair
    assert metrics.flip(truth, truth) == 0.0
    small, large = metrics.flip(0.5 * (prediction + truth), truth), metrics.flip(prediction, truth)
    assert 0.0 < small < large < 1.0


@pytest.mark.parametrize("place", [(0, 20), (30, 33), (12, 14)])
def test_pictures_are_judged_around_their_figures_as_whole(place):
    """A figure on one colour in larger pictures: errors fall with the area alone, at edges and corners too."""
    top, left = place
    truth = torch.full((36, 40, 3), 0.9)
    prediction = truth.clone()
    generator = torch.Generator().manual_seed(5)
    truth[top : top + 6, left : left + 5] = torch.rand(6, 5, 3, generator=generator)
    prediction[top : top + 4, left : left + 7] = torch.rand(4, 7, 3, generator=generator)
    far = torch.zeros(36, 40, dtype=torch.bool)
    far[metrics.around_figures(prediction, truth, 0)] = True
    assert far.sum() == 6 * 7
    pairs = [picture[None].movedim(-1, 1).double() for picture in (prediction, truth)]
    whole = structural_similarity_index_measure(*pairs, data_range=1.0)
    assert metrics.ssim(prediction, truth) == pytest.approx(float(whole), abs=1e-9)
    whole = evaluate(truth.numpy(), prediction.numpy(), "LDR", applyMagma=False)[1]
    assert metrics.flip(prediction, truth) == pytest.approx(float(whole), abs=1e-7)


def test_pictures_of_one_colour_are_alike():
    grey = torch.full((40, 32, 3), 0.5)
    assert metrics.ssim(grey, grey) == pytest.approx(1.0, abs=1e-12)
    assert metrics.flip(grey, grey) == 0.0


def test_lpips_of_several_pictures_is_that_of_each(pair):
    prediction, truth = pair
    lpips, pictures = Lpips(), [prediction, truth, 1.0 - truth]
    found = [one["lpips"] for one in lpips.of_all(pictures, truth)]
    assert found == pytest.approx([lpips(one, truth)["lpips"] for one in pictures], abs=1e-6)
    assert found[1] == 0.0 < found[0] < found[2]


def test_lpips_is_as_its_authors_document():
    """Their three pictures and two distances; zero to itself, and the same either way round."""

    def picture(name: str) -> torch.Tensor:
        return torch.from_numpy(np.array(Image.open(EXAMPLES / name).convert("RGB")) / 255.0).float()

    lpips, reference = Lpips(), picture("ex_ref.png")
    for name, expected in (("ex_p0.png", 0.7219), ("ex_p1.png", 0.1376)):
        found = lpips(picture(name), reference)["lpips"]
        assert found == pytest.approx(expected, abs=5e-4)
        assert lpips(reference, picture(name))["lpips"] == pytest.approx(found, rel=1e-5)
    assert lpips(reference, reference)["lpips"] == 0.0


def test_pictures_too_small_for_lpips_have_none():
    assert Lpips()(torch.zeros(30, 40, 3), torch.ones(30, 40, 3))["lpips"] is None
    assert Lpips()(torch.zeros(31, 31, 3), torch.ones(31, 31, 3))["lpips"] is not None


def test_lpips_by_vgg_is_a_number_or_null_with_a_reason(pair):
    lpips = Lpips()
    value, reason = lpips(*pair)["lpips_vgg"], lpips.vgg_reason
    assert (value is None) != (reason is None)
    assert reason is None or "LPIPS with VGG needs" in reason


@pytest.mark.parametrize("metric", PICTURE_METRICS)
def test_bytes_nan_and_foreign_shapes_are_refused(metric, pair):
    prediction, truth = pair
    with pytest.raises(
        DataError, match=r"prediction: found values from .* expected the range \[0, 1\]; divide"
    ):
        metric(prediction * 255.0, truth)
    broken = truth.clone()
    broken[0, 0, 0] = math.nan
    with pytest.raises(NumericalError, match="truth: found 1 of 3840"):
        metric(prediction, broken)
    with pytest.raises(ShapeError, match="prediction and truth"):
        metric(prediction[:-1], truth)


def test_alpha_and_opacity_out_of_range_are_refused(pair):
    with pytest.raises(DataError, match="true_alpha"):
        metrics.psnr_foreground(*pair, torch.full((40, 32), 255.0))
    with pytest.raises(NumericalError, match="opacity"):
        metrics.silhouette_iou(torch.full((4, 4), math.nan), torch.zeros(4, 4))


def ball(radius: float, count: int) -> np.ndarray:
    directions = np.random.default_rng(0).normal(size=(count, 3))
    return radius * directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def test_chamfer_and_f_score_of_two_spheres():
    """Concentric spheres 30 mm apart: so is every point, up to the spacing of the points."""
    inner, outer = ball(0.5, 20_000), ball(0.53, 20_000)
    assert metrics.chamfer_mm(*metrics.surface_distances(inner, outer)) == pytest.approx(30.0, abs=1.0)
    assert metrics.f_score(*metrics.surface_distances(inner, outer)) == 0.0
    assert metrics.f_score(*metrics.surface_distances(inner, outer), radius=0.04) == 1.0


def test_chamfer_and_f_score_by_hand():
    """One of two predicted points is 1 m off; all true points are found: precision 1/2, recall 1."""
    true = np.zeros((1, 3))
    predicted = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert metrics.chamfer_mm(*metrics.surface_distances(predicted, true)) == pytest.approx(250.0)
    assert metrics.f_score(*metrics.surface_distances(predicted, true)) == pytest.approx(2.0 / 3.0)


def test_parts_lost_is_the_share_of_the_truth_that_is_far_from_ours():
    """A hand of a tenth of the points, a metre away; what ours has too much loses nothing."""
    body, hand = np.zeros((9, 3)), np.full((1, 3), 1.0)
    _, back = metrics.surface_distances(body, np.concatenate((body, hand)))
    assert metrics.parts_lost(back) == pytest.approx(0.1)
    _, back = metrics.surface_distances(np.concatenate((body, hand)), body)
    assert metrics.parts_lost(back) == 0.0
    assert metrics.parts_lost(np.array([0.049, 0.051])) == 0.5


def test_points_that_are_none_or_not_finite_are_refused():
    points = np.zeros((4, 3))
    with pytest.raises(NumericalError, match="predicted"):
        metrics.surface_distances(np.full((4, 3), np.nan), points)
    with pytest.raises(ShapeError, match="true"):
        metrics.surface_distances(points, np.zeros((0, 3)))


def test_haze_of_a_figure_and_of_fog():
    """A crisp disc has none; inside it, so many pixels of fog are so large a share."""
    y, x = np.mgrid[:64, :64] - 31.5
    radius = np.hypot(x, y)
    crisp = torch.from_numpy(np.clip(20.5 - radius, 0.0, 1.0))
    assert metrics.haze(crisp) == 0.0
    foggy = crisp.clone()
    foggy[30:34, 30:34] = 0.7
    assert metrics.haze(foggy) == pytest.approx(16 / int((crisp > 0.05).sum()))
    assert metrics.haze(torch.full((64, 64), 0.3)) == 1.0, "fog alone has no outline"
    assert metrics.haze(torch.zeros(64, 64)) is None
