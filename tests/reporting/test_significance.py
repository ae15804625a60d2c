from pathlib import Path

import pytest

from charnerf.reporting.rows import Row
from charnerf.reporting.runs import Run
from charnerf.reporting.significance import (
    attention_verdict,
    differences,
    scores_by_character,
    sentence,
    significance,
)

KEYS = ("psnr", "psnr_foreground", "ssim", "silhouette_iou")


def row(name, *gains, characters=12):
    """A row whose characters differ by far more than rows do; one gain a seed."""
    runs = []
    for seed, gain in enumerate(gains):
        scores = {f"c{number}": dict.fromkeys(KEYS, 3.0 * number + gain) for number in range(characters)}
        runs.append(Run(Path(name), name, (), {"seed": seed}, {"per_character": scores}, [], None))
    return Row(name, name, tuple(runs))


def test_seeds_are_averaged_before_pairing():
    assert scores_by_character(row("charnerf", 1.0, 3.0), "psnr")["c2"] == 8.0


@pytest.mark.parametrize(
    ("gain", "start", "told"),
    [
        (0.5, "View attention earns its place here", "ahead against no_mha (PSNR, foreground PSNR, SSIM)"),
        (-0.5, "View attention does not clearly earn", "behind against no_mha (PSNR, foreground PSNR, SSIM)"),
        (
            0.0,
            "View attention does not clearly earn",
            "undecided against no_mha (PSNR, foreground PSNR, SSIM)",
        ),
    ],
)
def test_the_question_of_the_table_is_answered(gain, start, told):
    rows = [row("no_mha", 0.0), row("charnerf", gain)]
    verdict = attention_verdict(rows, differences(rows))
    assert verdict is not None and verdict.startswith(start) and told in verdict


def test_a_grid_without_the_papers_rows_does_not_answer_it():
    rows = [row("a", 0.0), row("b", 1.0)]
    assert attention_verdict(rows, differences(rows)) is None


def test_sentences_say_who_is_ahead_and_what_is_open():
    rows = [row("a", 0.0), row("b", 1.0), row("c", 1.0)]
    found = differences(rows)["psnr"]
    assert sentence("psnr", found, ["a", "b", "c"]) == (
        "PSNR: b is ahead of a by 1.00 dB; c is ahead of a by 1.00 dB; the other 1 of 3 pairs can not be told apart."
    )
    assert sentence("ssim", [], []) == "SSIM: no difference holds (0 pairs)."


def test_too_few_characters_are_told():
    texts = [
        block.text for block in significance([row("a", 0.0, characters=4), row("b", 1.0, characters=4)])[1:3]
    ]
    assert "p is at least 0.12" in texts[1]
    assert significance([row("a", 0.0)]) == []
