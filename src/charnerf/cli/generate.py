"""`charnerf generate`: generated characters as a data set."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from charnerf.cli.options import Jobs, NewDataset, Size, Views
from charnerf.cli.summary import JsonFile, Summary, check_json, close, typed
from charnerf.errors import ConfigError
from charnerf.wording import counted

if TYPE_CHECKING:
    from charnerf.capture.generated import Generator

EXAMPLES = (
    "charnerf generate -o embedded --train 32 --val 4 --test 6",
    "charnerf generate -o few --train 2 --val 1 --test 1",
    "charnerf generate --shapes -o shapes --train 1000 --val 4 --test 4",
    "charnerf generate --people assets -o people --train 1000 --val 4 --test 4",
)
MOST = 1_000_000  # characters of a split

Shapes = Annotated[
    bool, typer.Option("--shapes", help="Shapes without meaning instead, as data=shapes trains on.")
]
People = Annotated[
    Path | None,
    typer.Option(
        metavar="ASSETS",
        file_okay=False,
        help="People instead, of the MakeHuman project's assets in this folder (docs/generators.md).",
    ),
]


def command(
    output: NewDataset,
    *,
    train: Annotated[int, typer.Option(min=0, max=MOST, help="Characters of the train split.")] = 32,
    val: Annotated[int, typer.Option(min=0, max=MOST, help="Characters of the val split.")] = 4,
    test: Annotated[int, typer.Option(min=0, max=MOST, help="Characters of the test split.")] = 6,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same characters.")] = 0,
    shapes: Shapes = False,
    people: People = None,
    views: Views = 48,
    size: Size = 128,
    jobs: Jobs = None,
    json_file: JsonFile = None,
) -> None:
    """Write generated characters as a data set: the embedded ones of `data=procedural`, unless others are asked for.

    Each hangs on the seed, its split and its number alone; the same command goes on with one that was interrupted.
    """
    from charnerf.capture.generated import generate_dataset
    from charnerf.data.digest import split_digest
    from charnerf.data.layout import read_dataset
    from charnerf.files import check_folder

    if train + val + test == 0:
        raise ConfigError("--train, --val, --test: found 0 each, expected at least one character.")
    began = time.perf_counter()
    check_json(json_file)
    check_folder(output)
    generator, one = _generator(shapes, people)
    generate_dataset(
        output, train, val, test, seed, generator=generator, views=views, size=size, processes=jobs
    )
    splits = read_dataset(output).splits
    close(
        Summary(
            made=counted(train + val + test, *one),
            files=(output,),
            began=began,
            next_=(typed("train", "data=folder", f"data.root={output}"),) if train and val and test else (),
            facts={
                "splits": {
                    split: {"characters": len(members), "digest": split_digest(output, split)}
                    for split, members in splits.items()
                    if members
                }
            },
        ),
        json_file,
    )


def _generator(shapes: bool, people: Path | None) -> "tuple[Generator, tuple[str, ...]]":
    """What is asked for, and what one of it and several are called.

    Raises:
        ConfigError: If two kinds are.
    """
    from charnerf.capture.generated import EMBEDDED
    from charnerf.capture.people_data import people_generator
    from charnerf.capture.shapes_data import shapes_generator

    if people is not None:
        if shapes:
            raise ConfigError("--shapes, --people: found both, expected one; write two data sets.")
        return people_generator(people), ("person", "people")
    return (shapes_generator(), ("shape",)) if shapes else (EMBEDDED, ("embedded character",))
