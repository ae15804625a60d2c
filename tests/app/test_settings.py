"""The form, and the plan that it makes."""

import pytest

from charnerf.app.settings import FIELDS, read_plan
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
