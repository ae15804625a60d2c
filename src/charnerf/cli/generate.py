"""`charnerf generate`: the embedded characters as a data set."""

from typing import Annotated

import typer

from charnerf.cli.messages import say
from charnerf.cli.options import Jobs, NewDataset, Size, Views
from charnerf.errors import ConfigError
from charnerf.wording import counted

MOST = 1_000_000  # characters of a split


def command(
    output: NewDataset,
    *,
    train: Annotated[int, typer.Option(min=0, max=MOST, help="Characters of the train split.")] = 32,
    val: Annotated[int, typer.Option(min=0, max=MOST, help="Characters of the val split.")] = 4,
    test: Annotated[int, typer.Option(min=0, max=MOST, help="Characters of the test split.")] = 6,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same characters.")] = 0,
    views: Views = 48,
    size: Size = 128,
    jobs: Jobs = None,
) -> None:
    """Write the embedded characters of `data=procedural` as a data set."""
    from charnerf.capture.procedural_data import generate_dataset
    from charnerf.data.digest import split_digest
    from charnerf.data.layout import read_dataset
    from charnerf.files import check_folder

    if train + val + test == 0:
        raise ConfigError("--train, --val, --test: found 0 each, expected at least one character.")
    check_folder(output)
    generate_dataset(output, train, val, test, seed, views=views, size=size, processes=jobs)
    say(f"{counted(train + val + test, 'character is', 'characters are')} in {output}.")
    for split, members in read_dataset(output).splits.items():
        if members:
            say(f"{split}: {counted(len(members), 'character')}, digest {split_digest(output, split)}")
