"""Phases change at the exact step, second or share."""

import pytest

from charnerf.errors import ConfigError
from charnerf.schedule import Phase, PhaseSchedule, progress_of_run


def two(until: dict[str, float]) -> PhaseSchedule:
    return PhaseSchedule(
        phases=[Phase(rays=1000, surface_points=3000, until=until), Phase(rays=10000, surface_points=10000)]
    )


def test_steps_count_from_zero() -> None:
    schedule = two({"steps": 100})
    steps = (0, 99, 100, 101, 10**9)
    assert [schedule.index_at(step=step, seconds=0.0, progress=0.0) for step in steps] == [0, 0, 1, 1, 1]


@pytest.mark.parametrize(
    ("unit", "key", "edge"), [("seconds", "seconds", 60.0), ("share", "progress", 4 / 7)]
)
def test_seconds_and_shares_change_at_the_edge(unit: str, key: str, edge: float) -> None:
    schedule = two({unit: edge})
    here = {"step": 5, "seconds": 0.0, "progress": 0.0}
    assert schedule.index_at(**{**here, key: edge * (1 - 1e-12)}) == 0  # type: ignore[arg-type]
    assert schedule.index_at(**{**here, key: edge}) == 1  # type: ignore[arg-type]


def test_a_resumed_run_is_in_the_phase_that_it_left() -> None:
    """The phase depends on what was done before, not on when the process began."""
    straight = [two({"steps": 7}).index_at(step=step, seconds=0.0, progress=0.0) for step in range(20)]
    for cut in range(20):
        resumed = two({"steps": 7})
        assert [
            resumed.index_at(step=step, seconds=0.0, progress=0.0) for step in range(cut, 20)
        ] == straight[cut:]


def test_a_phase_may_be_skipped_at_once() -> None:
    one, other = (
        Phase(rays=1, surface_points=0, until={"steps": 1}),
        Phase(rays=2, surface_points=0, until={"seconds": 1}),
    )
    schedule = PhaseSchedule(phases=[one, other, Phase(rays=3, surface_points=0)])
    assert schedule.index_at(step=1, seconds=5.0, progress=0.0) == 2


def test_a_constant_schedule_never_changes() -> None:
    schedule = PhaseSchedule(phases=[Phase(rays=8, surface_points=4, loss_weights={"opacity": 0.5})])
    assert schedule.index_at(step=10**9, seconds=1e9, progress=1.0) == 0 and len(schedule) == 1


@pytest.mark.parametrize(
    ("phases", "message"),
    [
        ([], "expected at least one phase"),
        ([(None,), (None,)], r"phases\.0\.until: not set"),
        ([({"steps": 5},)], r"phases\.0\.until: found .*expected none"),
        ([({"steps": 5},), ({"steps": 5},), (None,)], "to ascend"),
        ([({"share": 0.5},), ({"share": 0.2},), (None,)], "to ascend"),
    ],
)
def test_wrong_orders_are_refused(phases: list, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        PhaseSchedule(phases=[Phase(rays=1, surface_points=0, until=until) for (until,) in phases])


@pytest.mark.parametrize(
    ("until", "message"),
    [
        ({"epochs": 3}, "expected one of"),
        ({}, "expected one of"),
        ({"steps": 3, "seconds": 4}, "expected one of"),
        ({"steps": 0}, "expected above 0"),
        ({"share": 1.0}, "below 1"),
        ({"seconds": float("nan")}, "expected above 0"),
        ({"seconds": float("inf")}, "expected above 0"),
    ],
)
def test_wrong_ends_are_refused(until: dict[str, float], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        Phase(rays=1, surface_points=0, until=until)


def test_counts_must_make_sense() -> None:
    with pytest.raises(ConfigError, match="rays"):
        Phase(rays=0, surface_points=0)
    with pytest.raises(ConfigError, match="surface_points"):
        Phase(rays=1, surface_points=-1)
    with pytest.raises(ConfigError, match=r"square: found -1, expected 0 or more pixels"):
        Phase(rays=1, surface_points=0, square=-1)


def test_progress_is_the_larger_share_of_the_budget() -> None:
    assert progress_of_run(step=5, seconds=9.0, budget_steps=10, budget_seconds=10.0) == 0.9
    assert progress_of_run(step=5, seconds=9.0, budget_steps=10, budget_seconds=None) == 0.5
    assert progress_of_run(step=50, seconds=0.0, budget_steps=10, budget_seconds=None) == 1.0
    assert progress_of_run(step=5, seconds=9.0, budget_steps=None, budget_seconds=None) == 0.0
