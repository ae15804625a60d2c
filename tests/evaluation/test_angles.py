import pytest
import torch

from charnerf.evaluation import angles
from charnerf.geometry.cameras import cameras_towards, direction_from_angles
from charnerf.types import Cameras, SourceViews

KEYS = ("psnr",)


def cameras_at(azimuths: list[float], elevations: list[float]) -> Cameras:
    directions = direction_from_angles(torch.tensor(azimuths), torch.tensor(elevations))
    target = torch.tensor([0.0, 0.0, 1.0])
    return cameras_towards(
        directions, target=target, distance=4.0, half_extent=1.0, size=8, orthographic=False
    )


@pytest.mark.parametrize(
    ("azimuth", "expected"),
    [
        (0.0, 0),
        (14.999, 0),
        (15.0, 1),
        (44.999, 1),
        (45.0, 2),
        (344.999, 11),
        (345.0, 0),
        (359.9999, 0),
        (180.0, 6),
    ],
)
def test_azimuth_bins_are_centred_and_hold_their_lower_edge(azimuth, expected):
    assert angles.azimuth_bin(azimuth) == expected


@pytest.mark.parametrize(("angle", "expected"), [(0.0, 0), (14.999, 0), (15.0, 1), (75.0, 5), (90.0, 5)])
def test_source_angle_bins_hold_their_lower_edge_and_the_last_both(angle, expected):
    assert angles.edge_bin(angle, (0, 15, 30, 45, 60, 75, 90)) == expected


def test_view_angles_against_present_sources_only():
    sources = cameras_at([0.0, 90.0, 180.0], [0.0, 0.0, 0.0])
    present = torch.tensor([[True, False, True]])
    views = SourceViews(torch.zeros(1, 3, 4, 8, 8), sources[None], present, ~present)
    found = angles.view_angles(cameras_at([10.0, 90.0, 200.0], [0.0, 0.0, 30.0]), views)
    torch.testing.assert_close(
        found.azimuth_deg, torch.tensor([10.0, 90.0, 200.0]).double(), atol=1e-3, rtol=0
    )
    torch.testing.assert_close(
        found.elevation_deg, torch.tensor([0.0, 0.0, 30.0]).double(), atol=1e-3, rtol=0
    )
    torch.testing.assert_close(found.source_deg[:2], torch.tensor([10.0, 90.0]).double(), atol=1e-2, rtol=0)


def test_means_are_over_views_then_over_characters():
    """Characters count the same, however many views each has; a missing value is no zero."""
    characters = [[{"psnr": 10.0}], [{"psnr": 20.0}, {"psnr": 30.0}, {"psnr": None}]]
    assert angles.mean_over_characters(characters, KEYS) == {"psnr": 17.5}
    assert angles.mean_over_characters([[{"psnr": None}]], KEYS) == {"psnr": None}


def test_twelve_azimuth_bins_with_reasons_where_empty():
    characters = [
        [{"psnr": 10.0, "azimuth_deg": 359.0}, {"psnr": 20.0, "azimuth_deg": 1.0}],
        [{"psnr": 30.0, "azimuth_deg": 5.0}, {"psnr": 7.0, "azimuth_deg": 31.0}],
    ]
    rows = angles.by_azimuth(characters, KEYS)
    assert [row["azimuth_deg"] for row in rows] == list(range(0, 360, 30))
    assert (rows[0]["psnr"], rows[0]["num_views"]) == (22.5, 3)
    assert (rows[1]["psnr"], rows[1]["num_views"]) == (7.0, 1)
    assert rows[2] == {"azimuth_deg": 60, "num_views": 0, "psnr": None, "psnr_reason": "no view in this bin"}


def test_source_angle_rows_go_beyond_90_only_where_views_are():
    rows = angles.by_source_angle([[{"psnr": 1.0, "source_angle_deg": 90.0}]], KEYS)
    assert len(rows) == 7
    assert (rows[-1]["source_angle_deg_from"], rows[-1]["num_views"]) == (90, 1)
    assert len(angles.by_source_angle([[{"psnr": 1.0, "source_angle_deg": 10.0}]], KEYS)) == 6
