"""Which pictures of a character are measured."""

import dataclasses

import pytest

from charnerf.data.characters import load_character
from charnerf.errors import DataError
from charnerf.evaluation.angles import azimuth_bin, view_angles
from charnerf.evaluation.frames import fixed_views
from support.figures import target_cameras


def test_fixed_views_are_the_same_every_time_and_spread(figure_dataset):
    character = load_character(figure_dataset, "ball")
    assert fixed_views(character, 3) == fixed_views(character, 3)
    assert len(set(fixed_views(character, 3))) == 3
    assert fixed_views(character, 100) == fixed_views(character, "all") == list(range(7))
    with pytest.raises(DataError, match="views: found 0"):
        fixed_views(character, 0)


@pytest.mark.parametrize("num_frames", [24, 64, 100, 200])
def test_fixed_views_reach_every_azimuth_whatever_the_number_of_frames(figure_dataset, num_frames):
    """Every n-th of 64 or 100 Fibonacci frames leaves four azimuth bins of twelve empty."""
    character = dataclasses.replace(
        load_character(figure_dataset, "ball"), cameras=target_cameras(num_frames)
    )
    chosen = fixed_views(character, 24)
    found = view_angles(character.cameras[chosen], character.sources)
    assert len({azimuth_bin(float(azimuth)) for azimuth in found.azimuth_deg}) == 12
    assert float(found.elevation_deg.mean()) == pytest.approx(32.7, abs=2.0)


def test_source_views_are_never_counted(figure_dataset):
    character = load_character(figure_dataset, "ball")
    sources = character.sources.cameras
    poses = character.cameras.world_from_camera.clone()
    poses[2] = sources.world_from_camera[0, 1]
    parallel = character.cameras.orthographic.clone()
    cameras = dataclasses.replace(character.cameras, world_from_camera=poses)
    assert 2 in fixed_views(dataclasses.replace(character, cameras=cameras), "all")  # a pinhole is no drawing
    parallel[2] = True
    cameras = dataclasses.replace(cameras, orthographic=parallel)
    assert 2 not in fixed_views(dataclasses.replace(character, cameras=cameras), "all")
