"""The card's figures are those of the files, and what people wrote around them stays."""

import json
from pathlib import Path

import pytest

from charnerf.errors import ConfigError, DataError
from charnerf.evaluation.scores import METRIC_KEYS
from charnerf.reporting.card import BEGIN, END, join_curves, titled, write_card

WRITTEN = f"# Weights\n\nWords before.\n\n{BEGIN}\nold\n{END}\n\nWords after.\n"
CURVE = "step,seconds,val_psnr,val_psnr_foreground\n100,10.5,18,15\n200,21,{last},{last}\n"


@pytest.fixture
def material(tmp_path):
    bins = [{"azimuth_deg": 30 * k, "psnr": 20.0 + k, "psnr_foreground": None} for k in range(12)]
    scores = dict.fromkeys(METRIC_KEYS, 0.5)
    hull = {**scores, "psnr": 17.25, "by_azimuth": bins}
    metrics = {
        **scores, "psnr": 23.456, "split": "test", "num_characters": 2, "num_views": 48, "by_azimuth": bins,
        "per_character": {}, "data_root": "/home/somebody/characters",
        "seconds": {"encode": 0.5, "render_per_frame": 0.25, "mesh": None},
        "baselines": {"white": dict.fromkeys(METRIC_KEYS, None), "visual_hull": hull},
    }  # fmt: skip
    (tmp_path / "measured").mkdir()
    (tmp_path / "measured/metrics.json").write_text(json.dumps(metrics))
    for number, last in (("1", 19), ("2", 17)):
        (tmp_path / f"curve_{number}.csv").write_text(CURVE.format(last=last))
    (tmp_path / "card").mkdir()
    card = tmp_path / "card/README.md"
    card.write_text(WRITTEN)
    return card, [tmp_path / "curve_1.csv", tmp_path / "curve_2.csv"], {"Real, test": tmp_path / "measured"}


def test_tables_curve_and_metrics_are_written_and_words_stay(material):
    card, curves, measured = material
    files = write_card(card, curves, measured)
    assert [file.name for file in files] == ["README.md", "curve.png", "metrics_real_test.json"]
    assert all(file.parent == card.parent and file.stat().st_size > 100 for file in files)
    text = card.read_text()
    assert text.startswith(WRITTEN[: WRITTEN.index("old")]) and text.endswith(WRITTEN[WRITTEN.index(END) :])
    assert "old" not in text
    assert "| charnerf | 23.46 |" in text and "| visual hull (carved, coloured) | 17.25 |" in text
    assert "white" not in text  # nothing of it was measured
    assert (
        "2 runs, 42 s of training, 400 steps; best validation: 19.00 dB on the foreground after 21 s." in text
    )
    assert "2 characters of the test split, 24 views each" in text
    assert "| charnerf, PSNR | 20.0 | 21.0 |" in text
    published = json.loads(files[-1].read_text())
    assert published["data_root"] == "characters"  # no folder of somebody's machine
    assert published["psnr"] == 23.456
    write_card(card, curves, measured)
    assert card.read_text() == text  # the same again


def test_runs_that_resumed_the_clock_are_not_added_twice():
    one = [{"step": 1.0, "seconds": 10.0}, {"step": 2.0, "seconds": 20.0}]
    resumed = [{"step": 3.0, "seconds": 30.0}]
    anew = [{"step": 1.0, "seconds": 5.0}]
    assert [row["seconds"] for row in join_curves([one, resumed, anew])] == [10.0, 20.0, 30.0, 35.0]
    assert [row["step"] for row in join_curves([one, resumed, anew])] == [1.0, 2.0, 3.0, 4.0]


def test_a_card_without_its_marks_is_left_alone(material):
    card, curves, measured = material
    card.write_text("# Weights\n")
    with pytest.raises(DataError, match="end of figures"):
        write_card(card, curves, measured)
    assert card.read_text() == "# Weights\n" and list(card.parent.iterdir()) == [card]


def test_titles_may_hold_anything_but_the_sign():
    assert titled(["Real, 12 characters=a/b=c"]) == {"Real, 12 characters": Path("a/b=c")}
    with pytest.raises(ConfigError, match="TITLE=FOLDER"):
        titled(["measured/real"])
