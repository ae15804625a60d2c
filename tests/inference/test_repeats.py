"""A process that loads, encodes and renders a character again and again, or opens it baked, does not grow."""

from pathlib import Path

import pytest

from benchmarks.repeats import repeat_rows
from charnerf.inference.model import Model
from charnerf.inference.weights import load
from support.subjects import pictured_person


@pytest.mark.slow
def test_repeated_work_takes_no_more_memory():
    model: Model = load()
    rows = repeat_rows(Path(model.source), pictured_person(), rounds=60)
    assert [row["again and again"] for row in rows] == ["load, encode, render", "load baked, render"]
    for row in rows:
        assert row["rounds"] == 60 and row["MiB after 10"] > 100
        assert abs(row["growth"]) < 0.05 and row["tensors more"] == 0
