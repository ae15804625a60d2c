"""The soak sees what leaks, and its figures are those of its rounds."""

import csv
import mmap
import sys
from dataclasses import asdict
from pathlib import Path

import pytest

from benchmarks.soak import Held, held, main, plot, soak, summary

linux = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


@linux
def test_handles_and_memory_that_stay_are_seen(tmp_path: Path) -> None:
    kept, noted = [], []

    def leak() -> None:
        kept.append((tmp_path / "leak").open("w"))
        kept.append(mmap.mmap(-1, 2**24))  # no memory that the process has kept
        kept[-1].write(b"x" * 2**24)

    rounds = soak([leak], seconds=0.0, least=5, note=noted.append)
    assert noted == rounds and [one.round for one in rounds] == [1, 2, 3, 4, 5]
    assert [one.handles - rounds[0].handles for one in rounds] == [0, 1, 2, 3, 4]
    assert rounds[-1].resident_mib - rounds[0].resident_mib > 3 * 16
    for one in kept:
        one.close()
    assert held(1, 0.0).handles == rounds[0].handles - 1


def test_the_summary_is_of_the_rounds_after_the_first(tmp_path: Path) -> None:
    rounds = [Held(n, 30.0 * n, mib, handles, 3, 2) for n, (mib, handles) in enumerate(
        [(50.0, 9), (100.0, 10), (104.0, 12), (101.0, 10)], start=1
    )]  # fmt: skip
    found = summary(rounds, warm=2)
    assert (found["rounds"], found["minutes"], found["warm_mib"], found["last_mib"]) == (4, 2.0, 100.0, 101.0)
    assert found["largest_rise"] == pytest.approx(0.04)
    assert (found["handles"], found["threads"], found["children"]) == ([10, 12], [3, 3], [2, 2])
    assert plot(rounds, tmp_path / "soak.png").read_bytes().startswith(b"\x89PNG")


@linux
@pytest.mark.slow
def test_eleven_rounds_leave_no_handles(tmp_path: Path) -> None:
    main(["--seconds", "0", "-o", str(tmp_path)])
    with (tmp_path / "soak.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 11 and list(rows[0]) == list(asdict(held(1, 0.0)))
    assert len({(row["handles"], row["threads"], row["children"]) for row in rows[1:]}) == 1
    assert (tmp_path / "soak.json").is_file() and (tmp_path / "soak.png").is_file()
