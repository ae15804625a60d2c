"""What one open page works on: its pictures, how they were read, its job and what was made; and whoever is to be told of it."""

import asyncio
import re
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from charnerf.app.answers import Found, Product, Recognized
from charnerf.app.figures import Figure
from charnerf.app.settings import Plan, Reading
from charnerf.app.worker import Worker
from charnerf.progress import Moment

WAITING, RUNNING, DONE, FAILED, CANCELLED = "waiting", "running", "done", "failed", "cancelled"


@dataclass
class GivenPicture:
    """A picture that was dropped.

    Attributes:
        number: Of the session's pictures; its folder is called so.
        title: Its name, as it came.
        file: Where it lies.
        found: What was found in it.
    """

    number: int
    title: str
    file: Path
    found: Found

    @property
    def thumbnail(self) -> Path:
        """A small one of it."""
        return thumbnail_of(self.file)


def thumbnail_of(file: Path) -> Path:
    """Where the small one of a picture lies."""
    return file.parent.with_name(f"{file.parent.name}.png")


@dataclass
class Job:
    """A character to be made.

    Attributes:
        number: Of the session's.
        session: Whose.
        figures: Its drawings, as they were when it was asked for.
        plan: What is made.
        state: WAITING, RUNNING, DONE, FAILED or CANCELLED.
        worker: Where it is made, once it is.
        moment: Where it stands, as the page shows it.
        problem: Why it failed.
    """

    number: int
    session: "Session"
    figures: list[Figure]
    plan: Plan
    state: str = WAITING
    worker: Worker | None = None
    moment: dict[str, Any] = field(default_factory=dict)
    problem: str | None = None

    @property
    def is_active(self) -> bool:
        """Whether it waits or runs."""
        return self.state in (WAITING, RUNNING)

    def follow(self, moment: Moment) -> None:
        """Note where it stands, of all its parts together."""
        first, then = self.plan.seconds
        weight = first / (first + then)
        is_last = moment.title == "files"
        share = weight + (1.0 - weight) * moment.share if is_last else weight * moment.share
        left = None if moment.left_s is None else moment.left_s + (0.0 if is_last else then)
        self.moment = {"stage": moment.stage, "share": share, "left_s": left, "note": moment.note}
        self.session.tell()


class Session:
    """The work of one page; it lives in the server's one thread.

    Args:
        name: Its id, which nobody guesses.
        folder: For its files; its own.
    """

    def __init__(self, name: str, folder: Path) -> None:
        self.name, self.folder = name, folder
        self.pictures: list[GivenPicture] = []
        self.figures: list[Figure] = []
        self.named: set[int] = set()  # figures that have been named
        self.touched: set[int] = set()  # those of them that the user has named
        self.numbers = 0  # given so far, to pictures, figures and folders
        self.reading = Reading()
        self.recognized: Recognized | None = None
        self.recognized_in: Path | None = None
        self.problem: str | None = None  # why the figures are no character yet
        self.revision = self.read_revision = 0
        self.is_busy = False
        self.job: Job | None = None
        self.product: Product | None = None
        self.made_in: Path | None = None
        self.worker: Worker | None = None  # that looks at what was made
        self.pages = 0
        self.timers: list[asyncio.TimerHandle] = []
        self.listeners: set[asyncio.Event] = set()

    def next_number(self) -> int:
        """A number that was not given before."""
        self.numbers += 1
        return self.numbers

    def tell(self) -> None:
        """Let all its pages know that something has changed."""
        for listener in self.listeners:
            listener.set()

    def words(self, text: str) -> str:
        """A sentence with files by the names that they came with: each lies in a numbered folder of the session's."""
        return re.sub(rf"{re.escape(str(self.folder))}/(\d+/)?", "", text)

    def state(self, place: int | None) -> dict[str, Any]:
        """All that the page shows.

        Args:
            place: How many jobs are made before this session's; None where none waits.
        """
        return {
            "busy": self.is_busy,
            "revision": self.read_revision,
            "pictures": [
                {"number": one.number, "title": one.title, "is_sheet": one.found.is_sheet}
                for one in self.pictures
            ],
            "figures": [self._figure(one) for one in self.figures],
            "read": None if self.recognized is None else self._read(self.recognized),
            "problem": self.problem,
            "job": None if self.job is None else self._job(self.job, place),
            "product": None if self.product is None else self._product(self.product),
        }

    def _figure(self, figure: Figure) -> dict[str, Any]:
        (picture,) = (one.number for one in self.pictures if one.file == figure.file)
        return {
            "number": figure.number,
            "picture": picture,
            "title": figure.title,
            "part": figure.part,
            "box": figure.box,
            "view": figure.view,
            "mirrored": figure.is_mirrored,
        }

    def _read(self, recognized: Recognized) -> dict[str, Any]:
        folder = "" if self.recognized_in is None else self.recognized_in.name
        return {
            "folder": folder,
            "views": [asdict(one) for one in recognized.views],
            "assumptions": [self.words(one) for one in recognized.assumptions],
            "warnings": [self.words(one) for one in recognized.warnings],
        }

    def _job(self, job: Job, place: int | None) -> dict[str, Any]:
        return {
            "number": job.number,
            "state": job.state,
            "ahead": place,
            "problem": job.problem,
            **job.moment,
        }

    def _product(self, product: Product) -> dict[str, Any]:
        assert self.made_in is not None  # it lies there
        sizes = {name: (self.made_in / name).stat().st_size for name in product.files}
        return {
            **asdict(product),
            "folder": self.made_in.name,
            "sizes": sizes,
            "suggestions": [self.words(one) for one in product.suggestions],
            "notes": [self.words(one) for one in product.notes],
            "can_look": self.worker is not None,
        }
