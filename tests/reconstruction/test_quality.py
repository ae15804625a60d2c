"""What a reconstruction says of itself, on surfaces whose figures are known."""

from dataclasses import replace

import pytest

from charnerf.meshing.options import MeshOptions
from charnerf.reconstruction.options import ReconstructionOptions
from charnerf.reconstruction.quality import Quality, Silhouette, quality_words, suggestions, surface_words
from charnerf.wording import worded_for_page

CLEAN = Quality(
    silhouettes=(Silhouette("front", 0.97, 0.97), Silhouette("back", 0.9, 0.95)),
    haze=0.04,
    dropped=1,
    parts=1,
    is_closed=True,
    handles=0,
)


def test_a_clean_result_needs_no_advice():
    assert not CLEAN.is_frayed
    assert suggestions(CLEAN, ReconstructionOptions(), num_drawings=3) == []
    assert quality_words(CLEAN) == (
        "Outlines fit the drawings with IoU 0.94 (worst: back, 0.90), haze 4 %; the surface is closed, 1 part; 1 loose part"
        " dropped."
    )


@pytest.mark.parametrize("worse", [{"dropped": 49}, {"handles": 24}, {"haze": 0.15}])
def test_closed_is_not_all(worse):
    frayed = replace(CLEAN, **worse)
    assert frayed.is_frayed and surface_words(frayed).startswith("frayed: closed")
    advice = " ".join(suggestions(frayed, ReconstructionOptions(), num_drawings=3))
    assert all(option in advice for option in ("--refine", "--symmetric", "--smooth", "--view"))
    used = ReconstructionOptions(mesh=MeshOptions(smooth=10), symmetric=True, refine_seconds=30.0)
    assert suggestions(frayed, used, num_drawings=4) == []


def test_on_the_page_advice_names_buttons_and_no_options():
    frayed = replace(CLEAN, dropped=49)
    with worded_for_page():
        advice = suggestions(frayed, ReconstructionOptions(), num_drawings=3)
    assert len(advice) == 4 and "--" not in " ".join(advice)
    assert advice[0].startswith("Refine (30 seconds) adapts") and advice[3].startswith(
        "A drawing of the back"
    )


def test_a_drawing_that_is_not_met_is_named():
    off = replace(
        CLEAN, silhouettes=(Silhouette("front", 0.97, 0.97), Silhouette("left", 0.52, 0.97)), haze=None
    )
    advice = suggestions(off, ReconstructionOptions(), num_drawings=2)
    assert "left drawing" in advice[0] and "52 %" in advice[0] and "haze" not in quality_words(off)
