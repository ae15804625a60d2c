"""`charnerf evaluate` takes over what a run noted, and nothing that would make its own figures unreadable."""

import json
from pathlib import Path

import pytest

from charnerf.cli.evaluate import noted_seconds


@pytest.mark.parametrize(
    ("noted", "expected"),
    [
        ('{"seconds": {"train": 21.5}}', 21.5),
        ('{"seconds": {"train": null}}', None),
        ('{"seconds": {"train": NaN}}', None),
        ('{"seconds": {"train": 1e999}}', None),
        ('{"seconds": {"train": "long"}}', None),
        ('{"seconds": 3}', None),
        ("{", None),
        ("[" * 100_000, None),
    ],
)
def test_only_a_number_is_taken_for_the_seconds_of_training(
    noted: str, expected: float | None, tmp_path: Path
) -> None:
    (tmp_path / "metrics.json").write_text(noted)
    found = noted_seconds(tmp_path)
    assert found == expected and json.dumps(found, allow_nan=False)


def test_weights_of_no_run_have_no_seconds(tmp_path: Path) -> None:
    assert noted_seconds(None) is None and noted_seconds(tmp_path) is None
