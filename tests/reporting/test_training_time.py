import pytest

from charnerf.reporting.training_time import quality_levels, time_to_quality

CURVE = [
    {"seconds": 10.0, "val_psnr": 10.0},
    {"seconds": 15.0},
    {"seconds": 20.0, "val_psnr": 20.0},
    {"seconds": 30.0, "val_psnr": 18.0},
    {"seconds": 40.0, "val_psnr": 22.0},
]


@pytest.mark.parametrize(
    ("level", "seconds"),
    [(9.0, 10.0), (10.0, 10.0), (15.0, 15.0), (19.0, 19.0), (21.0, 37.5), (22.0, 40.0), (22.1, None)],
)
def test_time_to_quality_is_the_first_crossing(level, seconds):
    assert time_to_quality(CURVE, "val_psnr", level) == (None if seconds is None else pytest.approx(seconds))


def test_a_curve_without_the_metric_never_reaches_it():
    assert time_to_quality(CURVE, "val_ssim", 0.0) is None


def test_levels_are_what_all_and_what_half_of_the_curves_reach():
    curves = [[{"seconds": 1.0, "val_psnr": best}] for best in (20.06, 21.57, 25.0)]
    assert quality_levels(curves, "val_psnr") == pytest.approx([20.0, 21.5])
    assert quality_levels([], "val_psnr") == []
    assert quality_levels([[{"seconds": 1.0, "val_ssim": 0.876}]], "val_ssim") == pytest.approx([0.87])
