"""The form, and the plan that it makes."""

import pytest

from charnerf.app.settings import FIELDS, read_plan
from charnerf.app.words import page_words
from charnerf.errors import ConfigError
from charnerf.reconstruction.options import ReconstructionOptions


def test_an_untouched_form_asks_for_what_reconstruct_makes():
    plan = read_plan({})
    assert plan.options == ReconstructionOptions() and plan.levels == ()
    assert plan == read_plan({field.name: field.default for field in FIELDS})


def test_a_filled_form_is_taken_over():
    plan = read_plan(
        {
            "resolution": 64,
            "faces": 4000,
            "levels": " 500, 2000;500",
            "refine": 30,
            "symmetric": True,
            "as_drawn": True,
        }
    )
    assert (plan.options.mesh.resolution, plan.options.mesh.faces, plan.levels) == (64, 4000, (2000, 500))
    assert plan.options.refine_seconds == 30.0 and plan.options.symmetric and not plan.reading.reconciled
    assert sum(plan.seconds) > sum(read_plan({"resolution": 64, "faces": 4000}).seconds)


@pytest.mark.parametrize(
    ("values", "label"),
    [
        ({"resolution": 100_000}, "Resolution"),
        ({"resolution": 64.5}, "Resolution"),
        ({"resolution": True}, "Resolution"),
        ({"faces": ""}, "Faces"),
        ({"faces": None}, "Faces"),
        ({"texture": "gold"}, "Colours"),
        ({"texture": ["drawings"]}, "Colours"),
        ({"symmetric": 1}, "Symmetric"),
        ({"levels": "many"}, "Levels"),
        ({"levels": "9000"}, "Levels"),
        ({"levels": "٣٠٠"}, "Levels"),
        ({"levels": "1" * 200}, "Levels"),
        ({"refine": -1}, "Refine"),
        ({"rm -rf": 1}, "rm -rf"),
    ],
)
def test_a_wrong_value_is_named_as_the_page_names_it(values, label):
    with pytest.raises(ConfigError, match=label):
        read_plan(values)


def test_sentences_speak_of_the_page_and_not_of_options(tmp_path):
    said = (
        f"{tmp_path}/7/hero front.png: found 9 figures, expected at most 8: crop it to the views of one character, or give them one"
        " by one with --view.",
        "If it looks the other way, say --side right, or of a sheet --figure right=N.",
        "By the colours it shows the character's left side. If it does, say --side left, or of a sheet --figure left=N.",
        "Paint the background in one colour, save the figure with a transparent one, or take --segmenter rembg.",
        "--segmenter rembg: No module named 'rembg'. Install it: pip install 'charnerf[rembg]'.",
        "--refine 30 adapts the model to these drawings; it is kept only where it helps.",
        "--symmetric, if the character's left and right are alike, averages torn places out.",
        "--smooth 10 evens the surface out.",
        "--view back=FILE, or right=FILE for the other side: where front, sides or back lack one, it says most.",
        "taken for ink and painted over with the colours beside them (--keep-ink leaves them).",
    )
    shown = [page_words(text, tmp_path) for text in said]
    assert not any("--" in text or str(tmp_path) in text for text in shown)
    assert (
        shown[0]
        == "hero front.png: found 9 figures, expected at most 8: crop it to the views of one character."
    )
    assert shown[1] == "If it looks the other way, call it right."
