"""A process that loads the model, encodes a character and renders it again and again does not grow."""

from pathlib import Path

import pytest

from benchmarks.repeats import repeat_row
from charnerf.inference.model import Model
from charnerf.inference.weights import load
from support.subjects import pictured_person


@pytest.mark.slow
def test_repeated_work_takes_no_more_memory():
    model: Model = load()
    row = repeat_row(Path(model.source), pictured_person(), rounds=60)
    assert row["rounds"] == 60 and row["MiB after 10"] > 100
    assert abs(row["growth"]) < 0.05 and row["tensors more"] == 0
