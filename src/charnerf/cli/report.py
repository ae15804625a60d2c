"""`charnerf report`: the report of a run, or over all runs below a folder."""

import time
from pathlib import Path
from typing import Annotated

import typer

from charnerf.cli.options import Trusted
from charnerf.cli.summary import JsonFile, Summary, check_json, close

EXAMPLES = ("charnerf report outputs/run", "charnerf report outputs --drawings drawings/")


def command(
    folder: Annotated[
        Path,
        typer.Argument(metavar="FOLDER", exists=True, file_okay=False, help="A run, or runs lie below it."),
    ],
    *,
    drawings: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            exists=True,
            file_okay=False,
            help="Show these drawings in every row: NAME/front.png, side.png, back.png, or pictures of fronts.",
        ),
    ] = None,
    trust: Trusted = None,
    json_file: JsonFile = None,
) -> None:
    """Write FOLDER/report.md and FOLDER/report.html: of a run, or over all runs below a folder.

    Runs that differ in their seed alone are one row. Interactive diagrams need plotly (the extra `report`).
    """
    from charnerf.files import check_folder
    from charnerf.reporting.folder_report import report

    began = time.perf_counter()
    check_json(json_file)
    check_folder(folder)
    file = report(folder, drawings=drawings, trusted=trust or ())
    close(Summary(made="a report", files=(file.with_suffix(".html"), file), began=began), json_file)
