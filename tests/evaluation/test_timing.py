import mmap
import sys
import time
from pathlib import Path
from statistics import median

import pytest
import torch

from charnerf.evaluation import metrics_file, timing
from charnerf.evaluation.environment import environment
from charnerf.evaluation.timing import Stopwatch, process_peak_mib
from charnerf.reporting.metrics_shape import check_metrics


def test_stages_report_medians_and_drop_what_raised():
    with Stopwatch(torch.device("cpu")) as watch:
        for pause in (0.0, 0.02, 0.5):
            with watch.stage("nap"):
                time.sleep(pause)
        with pytest.raises(KeyError), watch.stage("fails"):
            raise KeyError
    assert 0.02 <= median(watch.seconds()["nap"]) < 0.5 * watch.total_seconds("nap")
    assert watch.seconds().get("fails") is None
    assert watch.seconds().get("never") is None


def test_memory_of_a_stage_is_seen_after_it_was_freed():
    size = 256
    with Stopwatch(torch.device("cpu")) as watch:
        with watch.stage("small"):
            time.sleep(0.05)
        with watch.stage("large"):
            with mmap.mmap(-1, size * 2**20) as held:  # no memory that the process has kept
                held.write(bytes([1]) * (size * 2**20))
                time.sleep(0.1)
    peaks = watch.peaks_mib()
    assert peaks["large"] > peaks["small"] + 0.8 * size
    assert process_peak_mib() > peaks["large"] - 64


def test_memory_is_absent_where_the_system_does_not_tell(monkeypatch):
    """On Windows there is no module `resource`, and no /proc."""
    monkeypatch.setitem(sys.modules, "resource", None)
    monkeypatch.setattr(timing, "_STATM", timing._STATM / "none")
    with Stopwatch(torch.device("cpu")) as watch, watch.stage("work"):
        pass
    assert process_peak_mib() is None and watch.peaks_mib() == {}
    found = metrics_file._memory([], torch.device("cpu"))
    check_metrics({**found, "peak_memory_by_stage_mib": watch.peaks_mib()}, Path("metrics.json"))
    assert found["peak_memory_mib"] is None and found["peak_memory_mib_reason"] == "the system does not tell"


def test_environment_gives_the_commit_or_the_reason():
    found = environment(torch.device("cpu"))
    assert (found["commit"] is None) == ("commit_reason" in found)
    assert found["threads"] == torch.get_num_threads()
