"""`charnerf pack`: a data set in shards."""

from pathlib import Path
from typing import Annotated

import typer

from charnerf.cli.dataset import GivenDataset, dataset_options
from charnerf.cli.messages import say
from charnerf.cli.options import gathered

EXAMPLES = (
    "charnerf pack --data characters -o shards",
    "charnerf pack --data srn_cars --front 64 -o shards --shard-mib 256",
)


@gathered(data=dataset_options)
def command(
    *,
    data: GivenDataset,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="DIR", file_okay=False, help="New folder for the shards."),
    ],
    shard_mib: Annotated[
        int, typer.Option("--shard-mib", metavar="MIB", min=1, max=2048, help="Size of a shard.")
    ] = 64,
) -> None:
    """Pack a data set into shards, tar files of many characters, for `data=shards` from a folder, HTTP or S3."""
    from charnerf.data.layout import read_dataset
    from charnerf.data.packing import pack
    from charnerf.files import check_folder
    from charnerf.progress import Progress

    root = data.opened()
    check_folder(output)
    count = len({name for names in read_dataset(root).splits.values() for name in names})
    with Progress("pack") as progress:
        index = pack(root, output, shard_mib=shard_mib, packed=progress.counter(count))
    size = sum(shard.size for shard in index.shards)
    each = size / max(count, 1) / 1024
    say(
        f"{output}: characters: {count}, shards: {len(index.shards)}, {size / 2**20:.1f} MiB, {each:.0f} KiB a character."
        f" Next: python train.py data=shards data.root={output}"
    )
