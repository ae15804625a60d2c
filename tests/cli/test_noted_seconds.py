"""`charnerf evaluate` takes over what a run noted, and nothing that would make its own figures unreadable."""

import json
from pathlib import Path

import pytest

from charnerf.cli.evaluate import noted_seconds
from charnerf.evaluation.scores import METRIC_KEYS

METRICS = {
    **dict.fromkeys(METRIC_KEYS),
    "split": "test",
    "num_characters": 1,
    "num_views": 1,
    "by_azimuth": [],
    "per_character": {},
}


@pytest.mark.parametrize(
    ("noted", "expected"),
    [
        ('{"train": 21.5}', 21.5),
        ('{"train": null}', None),
        ("{}", None),
        ('{"train": NaN}', None),
        ('{"train": 1e999}', None),
        ('{"train": "long"}', None),
        ("3", None),
        ("{", None),
        ("[" * 100_000, None),
    ],
)
def test_only_a_number_is_taken_for_the_seconds_of_training(
    noted: str, expected: float | None, tmp_path: Path
) -> None:
    (tmp_path / "metrics.json").write_text(json.dumps(METRICS)[:-1] + f', "seconds": {noted}}}')
    assert noted_seconds(tmp_path) == expected


def test_weights_of_no_run_have_no_seconds(tmp_path: Path) -> None:
    assert noted_seconds(None) is None and noted_seconds(tmp_path) is None
