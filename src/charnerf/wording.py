"""Words of sentences: numbers, what every terminal can show, and what to do where options are typed or clicked."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar

_on_page: ContextVar[bool] = ContextVar("on_page", default=False)


@contextmanager
def worded_for_page() -> Iterator[None]:
    """Let sentences that are made meanwhile speak of the page's names and buttons, not of options."""
    token = _on_page.set(True)
    try:
        yield
    finally:
        _on_page.reset(token)


def typed_or_clicked(typed: str, clicked: str) -> str:
    """What a sentence tells to do, as a command line has it or as the page has it."""
    return clicked if _on_page.get() else typed


def install_words(extra: str) -> str:
    """How an optional part of the package is installed."""
    return f"{typed_or_clicked('Install', 'Whoever runs this page can install')} it: pip install 'charnerf[{extra}]'."


def counted(number: int, one: str, many: str | None = None) -> str:
    """A number with its noun: 1 run, 2 runs; `many` where an s is not enough."""
    return f"{number} {one if number == 1 else many or one + 's'}"


def listed(names: Sequence[str], most: int) -> str:
    """The first few names, and how many more there are: "one, two, and 3 more"; "" without any."""
    left = len(names) - most
    return ", ".join([*names[:most], *([f"and {left} more"] if left > 0 else [])])


def printable(text: str) -> str:
    """A message as every terminal can show it: half characters and control signs, as names of files hold them, escaped."""
    return "".join(one if one.isprintable() or one in "\n\t" else ascii(one)[1:-1] for one in text)
