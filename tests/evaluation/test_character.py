"""One character measured: a record, the same every time, and nothing else."""

import pytest

from charnerf.data.characters import load_character
from charnerf.evaluation.character import CharacterResult, measure_character
from charnerf.evaluation.lpips import Lpips
from charnerf.evaluation.nearest import NO_TRAINING_SET, TrainingCharacters
from support.figures import HullModel, HullRenderer

FRAMES = [1, 4]


@pytest.fixture(scope="module")
def doll(figure_dataset):
    return load_character(figure_dataset, "doll")


def measured(character, **options) -> CharacterResult:
    return measure_character(HullModel(), HullRenderer(), character, FRAMES, lpips=Lpips(), **options)


@pytest.fixture(scope="module")
def announced() -> list[int]:
    """An item a picture of `found` that was announced."""
    return []


@pytest.fixture(scope="module")
def found(doll, figure_dataset, announced) -> CharacterResult:
    training = TrainingCharacters([(figure_dataset, "test")])
    return measured(doll, training=training, on_picture=lambda: announced.append(1))


def test_measuring_again_gives_the_same_and_writes_nothing(found, doll, figure_dataset):
    before = {path: path.stat().st_mtime_ns for path in figure_dataset.rglob("*")}
    again = measured(doll, training=TrainingCharacters([(figure_dataset, "test")]))
    assert again.scores == found.scores
    assert (again.left_out, again.nearest.name) == (found.left_out, found.nearest.name)
    assert before == {path: path.stat().st_mtime_ns for path in figure_dataset.rglob("*")}


def test_every_method_draws_every_frame(found, doll):
    assert list(found.scores) == list(found.pictures) == ["ours", "white", "visual_hull", "nearest"]
    assert found.frames == ["001", "004"]
    assert found.nearest.name == "ball"
    for method, pictures in found.pictures.items():
        assert len(pictures) == len(found.scores[method].views) == len(FRAMES)
        assert pictures[0].rgb.shape == (doll.cameras.height, doll.cameras.width, 3)


def test_baselines_are_left_out_or_say_why_they_are_missing(doll):
    assert list(measured(doll, baselines=False).scores) == ["ours"]
    found = measured(doll)
    assert found.scores["nearest"].reasons["psnr"] == NO_TRAINING_SET
    assert "nearest" not in found.pictures


def test_every_execution_of_a_stage_is_timed_and_every_picture_is_announced(found, announced):
    counts = {stage: len(seconds) for stage, seconds in found.seconds.items()}
    assert counts == {"encode": 1, "render": 2, "hull_encode": 1, "hull_render": 2, "metrics": 1}
    assert len(announced) == len(FRAMES)
    assert set(found.peaks_mib) == set(counts)
