import mmap
import time
from statistics import median

import pytest
import torch

from charnerf.evaluation.environment import environment
from charnerf.evaluation.timing import Stopwatch, process_peak_mib


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


def test_environment_gives_the_commit_or_the_reason():
    found = environment(torch.device("cpu"))
    assert (found["commit"] is None) == ("commit_reason" in found)
    assert found["threads"] == torch.get_num_threads()
