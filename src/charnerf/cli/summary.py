"""How a command ends: what was made, where, how good, how long it took, and what may come next; for programs as JSON."""

import json
import shlex
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import typer

from charnerf.cli.messages import is_quiet, say

JsonFile = Annotated[
    Path | None,
    typer.Option(
        "--json",
        metavar="FILE",
        dir_okay=False,
        allow_dash=True,
        help="Write there what was made, where, how good and how long it took; - is standard output.",
    ),
]
STDOUT = Path("-")


@dataclass(frozen=True)
class Summary:
    """What a command did.

    Attributes:
        made: In words.
        files: Where it lies, what is to be opened first at first.
        began: When the command began, by `time.perf_counter`.
        quality: How good it is, in words; "" where nothing can be said.
        doubts: What looked wrong with what was given: it was said long before.
        try_: What may make it better.
        next_: Commands that go on from here.
        facts: More for programs.
    """

    made: str
    files: Sequence[Path]
    began: float
    quality: str = ""
    doubts: Sequence[str] = ()
    try_: Sequence[str] = ()
    next_: Sequence[str] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)


def close(summary: Summary, json_file: Path | None) -> None:
    """Tell the user, and write the JSON where it is asked for."""
    from charnerf.reporting.formats import seconds_text

    seconds = time.perf_counter() - summary.began
    parts = {
        "made": [summary.made],
        "where": [", ".join(map(str, summary.files))] if summary.files else [],
        "how good": [summary.quality] if summary.quality else [],
        "how long": [seconds_text(seconds)],
        "doubtful": summary.doubts,
        "try": summary.try_,
        "next": summary.next_,
    }
    say("")
    for title, lines in parts.items():
        for number, line in enumerate(lines):
            say(f"{title if number == 0 else '':<10}{line}")
    content = {
        "made": summary.made,
        "files": [str(file) for file in summary.files],
        "quality": summary.quality or None,
        "seconds": seconds,
        "try": list(summary.try_),
        "next": list(summary.next_),
        "details": summary.facts,
    }
    write_json(content, json_file)


def show(text: str, json_file: Path | None) -> None:
    """Print a result for people where the JSON does not go, and nothing where they asked for quiet."""
    if json_file != STDOUT and not is_quiet():
        typer.echo(text)


def write_json(content: Mapping[str, Any], json_file: Path | None) -> None:
    """Write content where it is asked for, if it is."""
    from charnerf.files import write_text

    text = json.dumps(content, indent=2)
    if json_file == STDOUT:
        typer.echo(text)
    elif json_file is not None:
        write_text(json_file, text + "\n")


def check_json(json_file: Path | None) -> None:
    """Check, before the work, that the JSON can be written."""
    from charnerf.files import check_folder

    if json_file is not None and json_file != STDOUT:
        check_folder(json_file.parent)


def typed(*words: str | Path) -> str:
    """A command as it is typed: words that shells would take apart are quoted, paths that begin with a dash are no options."""
    dashed = [isinstance(word, Path) and str(word).startswith("-") for word in words]
    return shlex.join(
        [
            "charnerf",
            *(f"./{word}" if is_dashed else str(word) for word, is_dashed in zip(words, dashed, strict=True)),
        ]
    )
