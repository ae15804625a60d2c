"""Progress: a time left that does not swing, no carriage returns in files, and what listeners get."""

import io
import sys

import pytest

from charnerf import progress
from charnerf.progress import Progress, left_text, reported_to, time_left


def test_the_time_left_is_what_is_spent_times_what_is_left_over_what_is_done():
    assert time_left(30.0, 0.25, None) == 90.0
    assert time_left(30.0, 0.25, 1000.0) == 90.0, "past a tenth only its own pace counts"
    assert time_left(0.0, 0.0, 60.0) == 60.0
    assert time_left(0.5, 0.01, None) is None
    assert time_left(6.0, 0.05, 60.0) == pytest.approx(0.95 * (0.5 * 120.0 + 0.5 * 60.0))
    assert time_left(10.0, 1.0, None) == 0.0


def test_the_time_left_does_not_swing_where_stages_differ_in_their_steps(monkeypatch):
    """Ten fast steps, then one slow one, as costs say: at twice the cost the estimate falls evenly all the same."""
    clock = [0.0]
    monkeypatch.setattr(progress.time, "perf_counter", lambda: clock[0])
    moments = []
    with reported_to(moments.append), Progress("work", {"a": 10.0, "b": 30.0}, in_seconds=True) as work:
        step = work.counter(10)
        for _ in range(10):
            clock[0] += 2.0
            step()
        work.stage("b")
        for share in (0.25, 0.5, 0.75, 1.0):
            clock[0] += 15.0
            work.update(share)
    assert [one.left_s for one in moments][4:] == sorted((one.left_s for one in moments[4:]), reverse=True)
    for one in moments[5:]:
        assert one.left_s == pytest.approx(80.0 * (1.0 - one.share))
    assert moments[-1].share == 1.0 and moments[-1].stage == "b"


def test_a_file_gets_lines_and_no_carriage_returns(monkeypatch):
    out = io.StringIO()
    monkeypatch.setattr(sys, "stderr", out)
    with Progress("reconstruct", {"pictures": 1.0, "mesh": 3.0}) as work:
        step = work.counter(100)
        for _ in range(100):
            step()
        work.say("not captured: x")
        work.stage("mesh")
    assert "\r" not in out.getvalue()
    assert out.getvalue().splitlines()[0] == "reconstruct: pictures, 0 %"
    assert out.getvalue().splitlines()[1] == "not captured: x"
    assert out.getvalue().splitlines()[2].startswith("reconstruct: mesh, 25 %, about 0 s left")


def test_a_terminal_gets_a_bar(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", out := Terminal())
    with Progress("evaluate [test]", {"evaluate [test]": 9.0}, in_seconds=True) as work:
        work.update(0.5, note="step 3")
        work.say("a line")
    assert (
        "evaluate [test]" in out.getvalue()
        and "about 9 s left" in out.getvalue()
        and "a line" in out.getvalue()
    )


def test_a_listener_ends_the_work_by_raising_and_shares_never_go_back():
    seen = []

    def listener(moment):
        seen.append(moment.share)
        if moment.share > 0.5:
            raise InterruptedError

    with pytest.raises(InterruptedError), reported_to(listener), Progress("work") as work:
        for share in (0.4, 0.2, 0.6):
            work.update(share)
    assert seen == [0.0, 0.4, 0.4, 0.6]


@pytest.mark.parametrize(
    ("seconds", "text"), [(7.4, "7 s"), (33.0, "35 s"), (240.0, "4 min"), (7200.0, "2.0 h")]
)
def test_seconds_are_said_as_coarsely_as_they_are_known(seconds, text):
    assert left_text(seconds) == text
