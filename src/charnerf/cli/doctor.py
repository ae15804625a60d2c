"""`charnerf doctor`: what is wrong with a data set, drawings or a run."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from charnerf.cli.options import Jobs, Trusted
from charnerf.cli.summary import JsonFile, Summary, check_json, close, show
from charnerf.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from charnerf.doctor.finding import Finding
    from charnerf.drawings.viewpoints import Viewpoint

EXAMPLES = (
    "charnerf doctor characters",
    "charnerf doctor front.png side.png back.png",
    "charnerf doctor outputs/run",
)
BROKEN = 1  # exit status
SHOWN = 20  # findings on the terminal
ORDER = ("front", "left", "back")
Subject = Annotated[
    list[Path],
    typer.Argument(
        metavar="DATASET | RUN | FRONT SIDE [BACK] | DRAWINGS",
        exists=True,
        help="A data set, ours or a foreign one; a run folder; drawings, or a folder with front.png, side.png, back.png.",
    ),
]


def command(
    subject: Subject,
    *,
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="DIR", file_okay=False, help="For doctor.html and doctor.json."
        ),
    ] = Path("outputs/doctor"),
    jobs: Jobs = None,
    trust: Trusted = None,
    json_file: JsonFile = None,
) -> None:
    """Find what is wrong with a data set, drawings or a run; each fault with its evidence, the fix and a command.

    Silhouettes are carved into a hull and seen again by every camera, and so is the mesh. Exit status 1 if
    anything is broken.
    """
    from charnerf.doctor.report import NUMBERS, verdict, write_findings
    from charnerf.files import check_folder

    began = time.perf_counter()
    check_json(json_file)
    check_folder(output)
    findings = list(_findings(subject, jobs, tuple(trust or ())))
    page = write_findings(output, " ".join(map(str, subject)), findings)
    show("\n".join(_lines(findings)), json_file)
    broken = sum(one.is_broken for one in findings)
    close(
        Summary(
            made=f"an examination of {' '.join(map(str, subject))}",
            files=(page, output / NUMBERS),
            began=began,
            quality=verdict(findings),
            facts={"broken": broken, "notes": len(findings) - broken},
        ),
        json_file,
    )
    if broken:
        raise typer.Exit(BROKEN)


def _lines(findings: "Sequence[Finding]") -> "Iterator[str]":
    """The first findings, how many there are more, and the verdict."""
    from charnerf.doctor.report import verdict

    for one in findings[:SHOWN]:
        yield one.line()
        if one.command:
            yield f"    {one.command}"
    if len(findings) > SHOWN:
        yield f"... and {len(findings) - SHOWN} more."
    yield verdict(findings)


def _findings(subject: list[Path], jobs: int | None, trusted: tuple[str, ...]) -> "Iterator[Finding]":
    """What is wrong with what was given, by what it is."""
    from charnerf.doctor.characters import dataset_findings
    from charnerf.doctor.drawings import drawing_findings, drawings_in
    from charnerf.doctor.run import is_run, run_findings
    from charnerf.progress import Progress

    first = subject[0]
    if len(subject) > 1 or first.is_file():
        yield from drawing_findings(_by_view(subject))
    elif is_run(first):
        yield from run_findings(first, trusted=trusted)
    elif drawings := drawings_in(first):
        yield from drawing_findings(_named(drawings))
    else:
        with Progress("examine") as progress:
            yield from dataset_findings(first, processes=jobs, counter=progress.counter)


def _by_view(files: list[Path]) -> "dict[Viewpoint, Path]":
    """FRONT SIDE [BACK]."""
    from charnerf.drawings.viewpoints import viewpoint

    if any(not one.is_file() for one in files) or not 2 <= len(files) <= len(ORDER):
        raise ConfigError(
            f"{' '.join(map(str, files))}: expected FRONT SIDE [BACK], files; a sheet is cut up by `charnerf reconstruct` first."
        )
    return {viewpoint(name): file for name, file in zip(ORDER, files, strict=False)}


def _named(drawings: dict[str, Path]) -> "dict[Viewpoint, Path]":
    """Drawings by the views of their names; side is the left one."""
    from charnerf.drawings.viewpoints import viewpoint

    return {viewpoint("left" if name == "side" else name): file for name, file in drawings.items()}
