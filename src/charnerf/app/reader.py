"""Pictures of sessions, read by one process for all of them."""

import asyncio
import shutil
from collections.abc import Callable
from dataclasses import replace
from multiprocessing.context import BaseContext
from pathlib import Path
from typing import Any, final

from charnerf.app.background import Background
from charnerf.app.figures import LEFT_OUT, Figure, in_order, view_text
from charnerf.app.limits import Limits
from charnerf.app.session import GivenPicture, Session, thumbnail_of
from charnerf.app.settings import Reading
from charnerf.app.worker import Ended, Refused, Worker
from charnerf.drawings.viewpoints import viewpoint
from charnerf.errors import CharNeRFError, ConfigError, DataError


def make_recognizer(load: Callable[[], Any]) -> Any:
    """What reads pictures, made in its process: the server imports nothing heavy."""
    from charnerf.app.recognizer import Recognizer

    return Recognizer(load)


@final
class Reader:
    """Takes pictures, and reads them again whenever something about them has changed.

    Args:
        context: How processes are started.
        load: Gives the model, in another process.
        limits: What it takes on.
    """

    def __init__(self, context: BaseContext, load: Callable[[], Any], limits: Limits) -> None:
        self.context, self.load, self.limits = context, load, limits
        self.worker: Worker | None = None
        self.background = Background()

    async def ready(self) -> None:
        """Wait until pictures can be read, and with that the model loaded.

        Raises:
            ConfigError: If it can not be loaded.
        """
        try:
            await self._ask("ready")
        except Refused as error:
            raise ConfigError(str(error)) from error

    async def _ask(self, name: str, **keywords: Any) -> Any:
        """Ask the process that reads pictures; one that does not answer is ended, and the next call starts another."""
        if self.worker is None:
            self.worker = Worker(self.context, make_recognizer, self.load)
        worker = self.worker
        try:
            return await asyncio.wait_for(worker.call(name, **keywords), self.limits.read_s)
        except (Ended, TimeoutError) as error:
            worker.end()
            if self.worker is worker:
                self.worker = None
            raise Refused(
                "Reading the pictures ended before it was done. Use smaller pictures, and try again."
            ) from error

    def new_picture(self, session: Session, title: str) -> Path:
        """Where a picture that comes goes.

        Raises:
            DataError: If there are too many.
        """
        if len(session.pictures) >= self.limits.pictures:
            raise DataError(
                f"{title}: there are {len(session.pictures)} pictures already, which is as many as a character may have. Remove one"
                " first."
            )
        folder = session.folder / str(session.next_number())
        folder.mkdir()
        return folder / title

    async def add_picture(self, session: Session, file: Path, *, more: bool) -> None:
        """Take a picture that has come; its figures are named with those that are there.

        Args:
            session: Whose.
            file: Where it lies.
            more: Whether another one comes at once, so that reading waits for it.

        Raises:
            Refused: If it can not be used.
        """
        try:
            found = await self._ask(
                "examine",
                file=file,
                title=file.name,
                thumbnail=thumbnail_of(file),
                most_pixels=self.limits.pixels,
                reading=session.reading,
            )
        except Refused as error:
            shutil.rmtree(file.parent, ignore_errors=True)
            if not more:
                self.read(session)
            raise Refused(session.words(str(error))) from error
        picture = GivenPicture(int(file.parent.name), file.name, file, found)
        session.pictures.append(picture)
        for index, box in enumerate(found.boxes):
            part = index if found.is_sheet else None
            session.figures.append(Figure(session.next_number(), file, file.name, part, box))
        if not more:
            self.read(session)

    def remove_picture(self, session: Session, number: int) -> None:
        """Take a picture away, with its figures."""
        for picture in [one for one in session.pictures if one.number == number]:
            session.pictures.remove(picture)
            session.figures = [one for one in session.figures if one.file != picture.file]
            shutil.rmtree(picture.file.parent, ignore_errors=True)
            for small in (picture.thumbnail, *session.folder.glob(f"{number}-*.png")):
                small.unlink(missing_ok=True)
        self.read(session)

    def edit(self, session: Session, changes: dict[int, tuple[str, bool]], reading: Reading | None) -> None:
        """Name, leave out and mirror figures, or read all in another way.

        Args:
            session: Whose.
            changes: View and whether it is mirrored, by the figure's number.
            reading: How all are read; None as before.

        Raises:
            DataError: If a view has no such name.
        """
        changes = {
            number: (view if view == LEFT_OUT else view_text(viewpoint(view)), is_mirrored)
            for number, (view, is_mirrored) in changes.items()
        }
        session.figures = [
            replace(
                one,
                view=changes.get(one.number, (one.view,))[0],
                is_mirrored=changes.get(one.number, ("", one.is_mirrored))[1],
            )
            for one in session.figures
        ]
        session.touched |= changes.keys()
        session.reading = session.reading if reading is None else reading
        self.read(session)

    def read(self, session: Session) -> None:
        """Read the figures anew, in the background; what is being read then is not shown any more."""
        session.revision += 1
        if not session.is_busy:
            session.is_busy = True
            self.background.begin(self._read(session))
        session.tell()

    async def _read(self, session: Session) -> None:
        """Read until nothing has changed meanwhile."""
        while session.read_revision != session.revision:
            session.read_revision = session.revision
            try:
                await self._name(session)
                in_order(session.figures)  # says at once what is missing
                folder = session.folder / f"read{session.next_number()}"
                recognized = await self._ask(
                    "recognize", figures=session.figures, reading=session.reading, folder=folder
                )
                self._show(session, recognized, folder)
            except (Refused, CharNeRFError) as error:
                self._show(session, None, None, session.words(str(error)) if session.figures else None)
        session.is_busy = False
        session.tell()

    def _show(
        self, session: Session, recognized: Any, folder: Path | None, problem: str | None = None
    ) -> None:
        """Show how pictures were read, or why not; pictures of the reading before go."""
        before, session.recognized_in = session.recognized_in, folder
        session.recognized, session.problem = recognized, problem
        if before is not None:
            shutil.rmtree(before, ignore_errors=True)

    async def _name(self, session: Session) -> None:
        """Name figures once new ones have come, each view once; those that the user has named stay."""
        figures, touched = session.figures, session.touched
        if {one.number for one in figures} <= session.named:
            return
        named: list[Figure] = await self._ask("name", figures=figures, reading=session.reading)
        session.named |= {one.number for one in named}
        views = {one.number: one.view for one in session.figures if one.number in touched}
        for one in named:
            if one.number not in touched:
                views[one.number] = LEFT_OUT if one.view in views.values() else one.view
        session.figures = [replace(one, view=views.get(one.number, one.view)) for one in session.figures]

    def close(self) -> None:
        """End all work."""
        self.background.cancel()
        if self.worker is not None:
            self.worker.end()
