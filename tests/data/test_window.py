"""The window that training draws from: it moves over all characters, and depends on seed and step alone."""

from collections import Counter

import pytest

from charnerf.data.window import Window, groups_of

NAMES = tuple("abcdefghij")


def test_every_character_comes_equally_often() -> None:
    """Exactly where one is held; where more are, one that ends a round and begins the next is held once for twice."""
    rounds = 100
    for held, least in ((1, rounds), (3, 0.95 * 3 * rounds)):
        window = Window(groups_of(NAMES, None), held=held, steps=5, seed=1)
        counts = Counter(name for step in range(0, 5 * len(NAMES) * rounds, 5) for name in window.names(step))
        assert set(counts) == set(NAMES)
        assert least <= min(counts.values()) <= max(counts.values()) <= held * rounds + held - 1


def test_one_goes_and_one_comes_at_a_time() -> None:
    window = Window(groups_of(NAMES, None), held=4, steps=8, seed=3)
    for turn in range(40):
        now, then = set(window.names(8 * turn)), set(window.names(8 * turn + 8))
        assert window.names(8 * turn) == window.names(8 * turn + 7)
        assert len(now - then) <= 1 and len(then - now) <= 1 and 3 <= len(now) <= 4


def test_it_is_the_same_for_every_process_and_after_a_resume() -> None:
    first, again = (Window(groups_of(NAMES, None), held=3, steps=2, seed=7) for _ in range(2))
    assert [first.names(step) for step in range(60)] == [again.names(step) for step in reversed(range(60))][
        ::-1
    ]
    other = Window(groups_of(NAMES, None), held=3, steps=2, seed=8)
    assert [first.names(step) for step in range(60)] != [other.names(step) for step in range(60)]


@pytest.mark.parametrize("held", [2, 5])
def test_shards_come_and_go_whole(held: int) -> None:
    groups = groups_of(NAMES, [("a", "b", "x"), ("c", "d"), ("y",), ("e", "f", "g", "h", "i", "j")])
    assert groups == (("a", "b"), ("c", "d"), ("e", "f", "g", "h", "i", "j"))
    window = Window(groups, held=held, steps=1, seed=0)
    for step in range(12):
        names = set(window.names(step))
        assert all(names.issuperset(group) or names.isdisjoint(group) for group in groups)
        assert held == 2 or names == set(NAMES)
