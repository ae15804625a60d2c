"""A bound on work done, which other work on the machine does not change."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

HANG = 60.0  # seconds of a processor; what is refused at once takes a hundredth


@contextmanager
def little_work(seconds: float = HANG) -> Iterator[None]:
    """Let a block take so many seconds of this process's processor time at most, in all of its threads."""
    begun = time.process_time()
    yield
    taken = time.process_time() - begun
    assert taken < seconds, f"{taken:.1f} s of processor time, expected less than {seconds:.0f}"
