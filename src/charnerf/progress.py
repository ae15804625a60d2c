"""Progress of long work: a bar with the time left on a terminal, a line now and then where output goes to a file.

The time left is what is spent times what is left over what is done, where stages count by what they are known to cost: it
does not swing with the pace of single steps.
"""

import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self, final

TRUSTED = 0.1  # share of the work from which on its own pace counts alone
KNOWN = 0.02  # and from which on it says anything where no seconds were expected
REFRESH = 0.25  # seconds between two drawings of a bar
LINE_EVERY = 20.0  # seconds between two lines in a file


@dataclass(frozen=True)
class Moment:
    """Where work stands.

    Attributes:
        title: What is done.
        stage: Of it.
        share: Of all stages, in [0, 1].
        left_s: Seconds left, None where nothing is known yet.
        note: More to show, such as an error so far.
    """

    title: str
    stage: str
    share: float
    left_s: float | None
    note: str = ""

    @property
    def what(self) -> str:
        """Title and stage."""
        return self.title if self.stage == self.title else f"{self.title}: {self.stage}"

    @property
    def left(self) -> str:
        """How long it takes still, in words after a comma; nothing where that is not known, or all is done."""
        return "" if self.left_s is None or self.share >= 1.0 else f", about {left_text(self.left_s)} left"

    def __str__(self) -> str:
        return f"{self.what}, {100 * self.share:.0f} %{self.left}{f' ({self.note})' if self.note else ''}"


Listener = Callable[[Moment], object]
_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)


@contextmanager
def reported_to(listener: Listener) -> Iterator[None]:
    """Give the progress of what runs meanwhile to a function, not to the terminal; what it raises ends the work."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


def left_text(seconds: float) -> str:
    """Seconds as coarsely as they are known: 7 s, 35 s, 4 min, 1.5 h."""
    if seconds < 10.0:
        return f"{seconds:.0f} s"
    if seconds < 100.0:
        return f"{5 * round(seconds / 5)} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def time_left(elapsed: float, share: float, expected: float | None) -> float | None:
    """Seconds left of work whose share in [0, 1] took a time; `expected` of all of it is believed until it has a pace.

    >>> time_left(5.0, 0.25, None)
    15.0
    """
    if expected is None:
        return elapsed * (1.0 - share) / share if share >= KNOWN else None
    trust = min(share / TRUSTED, 1.0)
    measured = elapsed / share if share > 0.0 else expected
    return (1.0 - share) * (trust * measured + (1.0 - trust) * expected)


@final
class Progress:
    """Work in stages; a context in which they are shown.

    Args:
        title: What is done.
        stages: What each stage costs, in their order: seconds on two cores, or any unit with `in_seconds` false.
        in_seconds: Whether costs are seconds, so that something can be said at the start.
        begun: Share that was done before, in [0, 1]; stages and costs are those of the rest.
    """

    def __init__(
        self,
        title: str,
        stages: Mapping[str, float] | None = None,
        *,
        in_seconds: bool = False,
        begun: float = 0.0,
    ) -> None:
        self.title, self.begun = title, begun
        self.costs = dict(stages or {title: 1.0})
        self.expected = sum(self.costs.values()) if in_seconds else None
        self.current = next(iter(self.costs))
        self.done = 0.0  # of the current stage
        self.text = ""
        self.start = 0.0
        self.display: Any = None

    def __enter__(self) -> Self:
        self.start = time.perf_counter()
        self.display = _display()
        self._show()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.current, self.done = list(self.costs)[-1], 1.0
            self._show()
        self.close()

    def close(self) -> None:
        """Leave the terminal as it was, the work done or not."""
        self.display.close()

    def stage(self, name: str) -> None:
        """Begin a stage; those before it are done."""
        self.current, self.done = name, 0.0
        self._show()

    def update(self, share: float, note: str | None = None) -> None:
        """The share of this stage that is done, which never goes back, and what to show beside it."""
        self.done = max(self.done, min(share, 1.0))
        self.text = self.text if note is None else note
        self._show()

    def counter(self, total: int, *, of: tuple[int, int] = (0, 1)) -> Callable[..., None]:
        """What counts steps of this stage, called after each or with a number of them.

        Args:
            total: How many there are.
            of: Which of how many equal parts of the stage they are.
        """
        count, (part, parts) = 0, of

        def step(number: int = 1) -> None:
            nonlocal count
            count += number
            self.update((part + count / max(total, 1)) / parts)

        return step

    def say(self, text: str) -> None:
        """Write a line without spoiling what is shown; a listener gets none."""
        self.display.say(text)

    def moment(self) -> Moment:
        """Where the work stands."""
        whole, before = sum(self.costs.values()), 0.0
        for name, cost in self.costs.items():
            if name == self.current:
                break
            before += cost
        share = (before + self.done * self.costs[self.current]) / whole if whole else 0.0
        left = time_left(time.perf_counter() - self.start, share, self.expected)
        return Moment(self.title, self.current, self.begun + (1.0 - self.begun) * share, left, self.text)

    def _show(self) -> None:
        if self.display is not None:
            self.display.show(self.moment())


def _display() -> "_Bar | _Lines | _Told":
    listener = _listener.get()
    if listener is not None:
        return _Told(listener)
    return _Bar() if sys.stderr.isatty() and os.environ.get("TERM") != "dumb" else _Lines()


@final
class _Told:
    """Tells a function."""

    def __init__(self, listener: Listener) -> None:
        self.show = listener

    def say(self, text: str) -> None:
        """Listeners take moments alone."""

    def close(self) -> None:
        """Nothing is open."""


@final
class _Lines:
    """Lines on standard error: at the start of a stage, and now and then."""

    def __init__(self) -> None:
        self.stage, self.time = "", 0.0

    def show(self, moment: Moment) -> None:
        """Write a line where it says something new."""
        now = time.monotonic()
        if moment.stage != self.stage or now - self.time >= LINE_EVERY:
            self.stage, self.time = moment.stage, now
            self.say(str(moment))

    def say(self, text: str) -> None:
        """Write a line."""
        print(text, file=sys.stderr, flush=True)  # noqa: T201

    def close(self) -> None:
        """Nothing is open."""


@final
class _Bar:
    """A bar on a terminal, drawn by this thread alone: workers are forked beside it."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        after = TextColumn("{task.percentage:>3.0f} %{task.fields[after]}", markup=False)
        columns = (TextColumn("{task.description}", markup=False), BarColumn(), after)
        console = Console(stderr=True, highlight=False, markup=False)
        self.bar = Progress(*columns, console=console, auto_refresh=False)
        self.task = self.bar.add_task("", total=1.0, after="")
        self.stage, self.time = "", 0.0
        self.last: Moment | None = None  # that is not drawn yet
        self.bar.start()

    def show(self, moment: Moment) -> None:
        """Draw it, at most a few times a second."""
        self.last = moment
        now = time.monotonic()
        if moment.stage != self.stage or now - self.time >= REFRESH:
            self.stage, self.time = moment.stage, now
            self._draw(moment)

    def _draw(self, moment: Moment) -> None:
        self.last = None
        note = f"  {moment.note}" if moment.note else ""
        self.bar.update(self.task, completed=moment.share, description=moment.what, after=moment.left + note)
        self.bar.refresh()

    def say(self, text: str) -> None:
        """Write a line above the bar."""
        self.bar.console.print(text)

    def close(self) -> None:
        """Leave the bar as it stands in the end."""
        if self.last is not None:
            self._draw(self.last)
        self.bar.stop()
