"""One framing for captures, drawings and renderings."""

import math

import pytest
import torch

from charnerf.config.composition import compose_config
from charnerf.geometry.cameras import angles_from_direction, project
from charnerf.geometry.framing import (
    MARGIN,
    SOURCE_AZIMUTHS,
    framing_camera,
    framing_cameras,
    framing_radius,
    source_cameras,
)
from charnerf.geometry.world import BOX_HALF_EXTENT, CENTRE, HEIGHT


def test_a_standing_character_fills_all_but_the_margin():
    """Feet and crown lie on the sphere that is framed, short of the edges by the margin, in drawings to the point."""
    assert framing_radius(0.0) == framing_radius(0.5 * HEIGHT) == MARGIN * 0.5 * HEIGHT
    cameras = source_cameras(radius=framing_radius(0.0), size=210)
    feet_and_crown = torch.tensor([[0.0, 0.0, 0.0], [0.0, 0.0, HEIGHT]], dtype=torch.float64)
    pixels, _, _ = project(cameras[:, None], feet_and_crown)
    torch.testing.assert_close(
        pixels, torch.tensor([[105.0, 205.0], [105.0, 5.0]], dtype=torch.float64).expand(3, 2, 2)
    )


@pytest.mark.parametrize("radius, distance", [(1.05, 4.0), (1.6, 4.0), (2.0, 5.0)])
def test_cameras_keep_their_distance_and_touch_the_sphere(radius, distance):
    camera = framing_camera(30.0, 20.0, radius=radius, size=64)
    position = camera.world_from_camera[:3, 3].double()
    offset = position - torch.tensor(CENTRE, dtype=torch.float64)
    assert float(offset.norm()) == pytest.approx(distance, rel=1e-6)
    azimuth, elevation = angles_from_direction(offset)
    assert (float(azimuth), float(elevation)) == pytest.approx((30.0, 20.0), abs=1e-4)
    half_angle = math.atan(0.5 * 64 / float(camera.focal[0]))
    assert math.sin(half_angle) == pytest.approx(radius / distance, rel=1e-6)


def test_drawings_stand_in_their_order_and_keep_the_type_of_their_directions():
    azimuth, elevation = angles_from_direction(source_cameras(radius=1.2, size=8).world_from_camera[:, :3, 2])
    assert azimuth.tolist() == pytest.approx(list(SOURCE_AZIMUTHS.values()))
    assert elevation.tolist() == pytest.approx([0.0] * 3)
    assert framing_cameras(torch.eye(3), radius=1.2, size=8).focal.dtype == torch.float32


def test_the_model_looks_at_the_same_box():
    model = compose_config([]).model
    assert tuple(model.box_centre) == CENTRE and model.box_half_extent == BOX_HALF_EXTENT
