"""The sweeps that docs/results.md writes down compose: the last cell of each."""

import re
import shlex
from pathlib import Path

import pytest

from charnerf.config import command_line

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "docs/results.md").read_text(encoding="utf-8")
TABLE = TEXT[TEXT.index("## Further ablations") : TEXT.index("## The report")]
SWEEPS = [piece for piece in re.findall(r"`([^`]+)`", TABLE) if "," in piece]


@pytest.mark.parametrize("sweep", SWEEPS)
def test_a_documented_sweep_composes(sweep: str, conf: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    every = command_line.jobs_of
    monkeypatch.setattr(command_line, "jobs_of", lambda overrides: every(overrides)[-1:])
    command_line.check_command_line(["-m", "scale=smoke", *shlex.split(sweep)], conf=conf)


def test_there_are_sweeps() -> None:
    assert len(SWEEPS) > 20
