"""`charnerf search`: which configs give the least error for their seconds."""

import time
from functools import partial
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from charnerf.cli.options import Folder
from charnerf.cli.summary import JsonFile, Summary, check_json, close
from charnerf.cli.train import begin_process
from charnerf.wording import counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from charnerf.training.search import Tried

Overrides = Annotated[
    list[str],
    typer.Argument(
        metavar="KEY=VALUE...",
        help="As for train; what is searched has several values, range(1,5), interval(0.1,1.0) or tag(log,interval(1e-4,1e-2)).",
    ),
]

EXAMPLES = ("charnerf search encoder=single,double 'scale.width=32,64,128' -o outputs/search --trials 30",)


def command(
    overrides: Overrides,
    output: Folder,
    *,
    trials: Annotated[
        int, typer.Option(min=1, max=10_000, help="Runs in all, those of before counted.")
    ] = 20,
    seconds: Annotated[
        Literal["render_per_frame", "encode", "mesh", "train"], typer.Option(help="Which seconds count.")
    ] = "render_per_frame",
    seed: Annotated[int, typer.Option(min=0, help="What is chosen follows from it.")] = 0,
    json_file: JsonFile = None,
) -> None:
    """Train configs that Optuna chooses for the least error and seconds; DIR/front.csv has those that no other beats in both.

    The same command goes on with what was interrupted; typed on other machines that share DIR, it works on the same search.
    """
    from charnerf.config.command_line import check_command_line
    from charnerf.config.composition import compose_config
    from charnerf.config.options import conf_folder
    from charnerf.config.search_space import search_space
    from charnerf.files import check_folder
    from charnerf.training.grid import begin_grid, check_grid, report_grid
    from charnerf.training.run import run_training
    from charnerf.training.search import Search

    began = time.perf_counter()
    check_json(json_file)
    space = search_space(overrides, conf_folder())
    for probe in space.probes():
        check_command_line(probe, conf=conf_folder())
    check_folder(output)
    begin_process()
    search = Search(output, space, seconds=seconds, seed=seed)
    since = begin_grid(output)
    search.run(trials, compose_config, train=partial(run_training, begin_process=begin_process))
    report, front = report_grid(output), search.front()
    close(
        Summary(
            made=f"a front of {counted(len(front), 'config')}",
            files=(*([report.with_suffix(".html")] if report else []), search.write_front()),
            began=began,
            quality=_quality(front),
            facts={
                "front": [{"chosen": one.chosen, "error": one.error, "seconds": one.seconds} for one in front]
            },
        ),
        json_file,
    )
    check_grid(output, since=since)


def _quality(front: "Sequence[Tried]") -> str:
    """The ends of a front, fastest first; "" of none."""
    ends = [front[0], front[-1]] if len(front) > 1 else front
    return ", ".join(f"error {one.error:.4f} in {one.seconds:.3g} s" for one in ends)
