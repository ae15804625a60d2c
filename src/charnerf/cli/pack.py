"""`charnerf pack`: a data set in shards."""

import time
from pathlib import Path
from typing import Annotated

import typer

from charnerf.cli.dataset import GivenDataset, dataset_options
from charnerf.cli.options import gathered
from charnerf.cli.summary import JsonFile, Summary, check_json, close, typed
from charnerf.wording import counted

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
    json_file: JsonFile = None,
) -> None:
    """Pack a data set into shards, tar files of many characters, for `data=shards` from a folder, HTTP or S3."""
    from charnerf.data.layout import read_dataset
    from charnerf.data.packing import pack
    from charnerf.files import check_folder
    from charnerf.progress import Progress

    began = time.perf_counter()
    check_json(json_file)
    root = data.opened()
    check_folder(output)
    count = len({name for names in read_dataset(root).splits.values() for name in names})
    with Progress("pack") as progress:
        index = pack(root, output, shard_mib=shard_mib, packed=progress.counter(count))
    size = sum(shard.size for shard in index.shards)
    close(
        Summary(
            made=f"{counted(count, 'character')} in {counted(len(index.shards), 'shard')}",
            files=(output,),
            began=began,
            quality=f"{size / 2**20:.1f} MiB, {size / max(count, 1) / 1024:.0f} KiB a character",
            next_=(typed("train", "data=shards", f"data.root={output}"),),
            facts={"characters": count, "shards": len(index.shards), "bytes": size},
        ),
        json_file,
    )
