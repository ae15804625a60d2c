"""One character measured: a record, the same every time, and nothing else."""

import pytest

from charnerf.data.characters import load_character
from charnerf.evaluation.character import CharacterResult, measure_character
from charnerf.evaluation.nearest import NO_TRAINING_SET, TrainingCharacters
from support.figures import HullModel, HullRenderer

FRAMES = [1, 4]


@pytest.fixture
def doll(figure_dataset):
    return load_character(figure_dataset, "doll")


def measured(character, **options) -> CharacterResult:
    return measure_character(HullModel(), HullRenderer(), character, FRAMES, **options)


def test_measuring_again_gives_the_same_and_writes_nothing(doll, figure_dataset):
    training = TrainingCharacters([(figure_dataset, "test")])
    before = {path: path.stat().st_mtime_ns for path in figure_dataset.rglob("*")}
    first, second = measured(doll, training=training), measured(doll, training=training)
    assert first.scores == second.scores
    assert (first.left_out, first.nearest.name) == (second.left_out, second.nearest.name)
    assert before == {path: path.stat().st_mtime_ns for path in figure_dataset.rglob("*")}


def test_every_method_draws_every_frame(doll, figure_dataset):
    found = measured(doll, training=TrainingCharacters([(figure_dataset, "test")]))
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


def test_every_execution_of_a_stage_is_timed_and_every_picture_is_announced(doll):
    announced = []
    found = measured(doll, on_picture=lambda: announced.append(1))
    counts = {stage: len(seconds) for stage, seconds in found.seconds.items()}
    assert counts == {"encode": 1, "render": 2, "hull_encode": 1, "hull_render": 2}
    assert len(announced) == len(FRAMES)
    assert set(found.peaks_mib) == set(counts)
