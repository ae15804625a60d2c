"""`charnerf evaluate`: a model measured on a split."""

import json
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from charnerf.cli.dataset import GivenDataset, dataset_options
from charnerf.cli.drawings import reading_options
from charnerf.cli.model import load_model
from charnerf.cli.options import Device, SplitName, Trusted, Weights, gathered, is_count
from charnerf.cli.summary import STDOUT, Summary, check_json, close
from charnerf.drawings.options import ReadingOptions
from charnerf.errors import ConfigError, DataError
from charnerf.files import check_folder
from charnerf.meshing.options import MeshOptions
from charnerf.pools import import_aside
from charnerf.wording import counted

if TYPE_CHECKING:
    from charnerf.data.characters import Character

EXAMPLES = (
    "charnerf evaluate --data characters --split test",
    "charnerf evaluate outputs/run --data characters --split test --json metrics.json -o measured",
)
MOST_VIEWS = 100_000
FIXED_VIEWS = 24  # a character, by weights that lie in no run's folder
NumViews = Annotated[
    str | None,
    typer.Option(
        "--views", metavar="N|all", help="Fixed views a character; as many as the run measured if left out."
    ),
]
JsonFile = Annotated[
    Path | None,
    typer.Option(
        "--json",
        metavar="FILE",
        dir_okay=False,
        help="Write the metrics there as well; - is standard output, where they go anyhow.",
    ),
]
Kept = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", metavar="DIR", file_okay=False, help="Keep predictions and a report there."
    ),
]
Renderer = Annotated[
    Literal["culled", "dense", "adaptive", "baked"] | None,
    typer.Option(help="Another renderer than the model was trained with."),
]
Mesh = Annotated[bool, typer.Option(help="Make every mesh, for Chamfer and F-score.")]
Resolution = Annotated[
    int | None,
    typer.Option(
        max=1024, help="Grid points along a mesh's longest side; as many as in the run if left out."
    ),
]
Jobs = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Characters at once, of one thread each; on a CPU as many as torch has threads, where each gets two.",
    ),
]
Baselines = Annotated[
    bool, typer.Option(help="Measure white, the visual hull and the nearest beside the model.")
]
Drawn = Annotated[
    str | None,
    typer.Option(
        "--drawn",
        metavar="LEVEL[:SEED]",
        help="Draw the source views anew, disagreeing: 1 in place and size, 2 limbs off by 10 degrees, 3 by 30 degrees.",
    ),
]
SourcesOption = Annotated[
    str | None,
    typer.Option(
        "--sources",
        metavar="VIEWS",
        help="Source views that the model gets, such as front,left or front,left,back,45, drawn of the characters' meshes; the"
        " captured ones if left out.",
    ),
]
NearestFrom = Annotated[
    list[str] | None,
    typer.Option(
        "--nearest-from",
        metavar="DATASET[:SPLIT]",
        help="Characters that the model was trained on, for the baseline `nearest`; split train if left out; may be"
        " given several times.",
    ),
]


@gathered(data=dataset_options, reading=reading_options)
def command(
    *,
    data: GivenDataset,
    weights: Weights = None,
    split: SplitName = "test",
    views: NumViews = None,
    json_file: JsonFile = None,
    output: Kept = None,
    renderer: Renderer = None,
    mesh: Mesh = True,
    resolution: Resolution = None,
    baselines: Baselines = True,
    nearest_from: NearestFrom = None,
    drawn: Drawn = None,
    sources: SourcesOption = None,
    reading: ReadingOptions,
    jobs: Jobs = None,
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Measure a model on a split: PSNR, SSIM, LPIPS, FLIP, IoU, Chamfer, F-score, by angle, with seconds. Prints metrics.json."""
    began, num_views = time.perf_counter(), _number_of_views(views)
    _check(output, json_file, resolution)
    if jobs != 1 and device in ("auto", "cpu"):
        import_aside("charnerf.evaluation.side_by_side")
    from charnerf.evaluation.evaluate import evaluate
    from charnerf.evaluation.nearest import TrainingCharacters
    from charnerf.inference.weights import run_folder
    from charnerf.meshing.build import find_surface

    source_drawer = _source_drawer(drawn, sources, reading)
    model = load_model(weights, device=device, trust=trust, renderer=renderer)
    run_views, run_resolution = _measured_by(run := run_folder(model.source))
    options = MeshOptions(resolution=resolution or run_resolution, height=None)
    metrics = evaluate(
        model.network,
        model.renderer,
        data.opened(),
        split,
        views=num_views or run_views,
        output=output,
        mesh=partial(find_surface, options=options) if mesh else None,
        baselines=baselines,
        training=TrainingCharacters([split_of(one) for one in nearest_from]) if nearest_from else None,
        train_seconds=noted_seconds(run),
        redrawn=source_drawer(model.image_size),
        processes=jobs,
    )
    _write(metrics, output, json_file, began)
    typer.echo(json.dumps(metrics, indent=2))


def _check(output: Path | None, json_file: Path | None, resolution: int | None) -> None:
    """Check, before any work, that meshes can be made and what is measured can be written."""
    if resolution is not None:
        MeshOptions(resolution=resolution)
    if output is not None:
        check_folder(output)
    check_json(json_file)


def _write(metrics: dict[str, Any], output: Path | None, json_file: Path | None, began: float) -> None:
    """Write metrics.json and the report into the folder of predictions, and the metrics to a file; say how good they are."""
    from charnerf.evaluation.metrics_file import write_metrics
    from charnerf.reporting.run_report import verdict, write_run_report

    files: list[Path] = []
    if output is not None:
        write_metrics(output / "metrics.json", metrics)
        files += [write_run_report(output).with_suffix(".html"), output / "metrics.json"]
    if json_file is not None and json_file != STDOUT:  # which gets them anyhow
        write_metrics(json_file, metrics)
        files.append(json_file)
    made = f"figures of {counted(metrics['num_characters'], 'character')}"
    close(Summary(made=made, files=files, began=began, quality=verdict(metrics)), None)


def _number_of_views(text: str | None) -> int | Literal["all"] | None:
    """Fixed views a character of a number or `all`; None where nothing is said."""
    if text is None:
        return None
    if text == "all":
        return "all"
    if not is_count(text, least=1, most=MOST_VIEWS):
        raise ConfigError(f"--views: found '{text[:60]}', expected a number from 1 to {MOST_VIEWS}, or all.")
    return int(text)


def _source_drawer(
    drawn: str | None, sources: str | None, reading: ReadingOptions
) -> "Callable[[int], Callable[[Character], Character]]":
    """What draws source views at LEVEL[:SEED], of a size, where any are to be drawn."""
    from charnerf.drawings.redrawn import redrawn
    from charnerf.drawings.viewpoints import viewpoint
    from charnerf.evaluation.evaluate import as_captured

    if drawn is None and sources is None:
        return lambda size: as_captured
    level, _, seed = (drawn or "0").partition(":")
    if not is_count(level) or not (is_count(seed, most=2**63) or not seed):
        raise ConfigError(
            f"--drawn: found '{(drawn or '')[:60]}', expected LEVEL or LEVEL:SEED, such as 2 or 2:7."
        )
    views = None if sources is None else [viewpoint(name.strip()) for name in sources.split(",")]
    return lambda size: partial(
        redrawn, level=int(level), seed=int(seed or 0), size=size, views=views, options=reading
    )


def _measured_by(run: Path | None) -> tuple[int | Literal["all"], int]:
    """Fixed views a character and grid points of its mesh that a run measured at its end."""
    from omegaconf import OmegaConf

    from charnerf.config.bounds import largest
    from charnerf.config.hints import shown
    from charnerf.inference.weights import load_config

    if run is None:
        return FIXED_VIEWS, MeshOptions.resolution
    cfg = load_config(run, ["scale"])
    views = OmegaConf.select(cfg, "scale.eval_views", default=FIXED_VIEWS)
    resolution = OmegaConf.select(cfg, "scale.mesh_resolution", default=MeshOptions.resolution)
    numbers = {"eval_views": 1 if views is None else views, "mesh_resolution": resolution}
    for name, value in numbers.items():
        if type(value) is not int or not 1 <= value <= largest(name):
            raise DataError(
                f"{run / 'config.yaml'}: scale.{name}: found {shown(value)}, expected 1 to {largest(name)}."
            )
    return "all" if views is None else views, resolution


def noted_seconds(run: Path | None) -> float | None:
    """Training time that a run noted, seconds; None where it noted none, or its metrics can not be read."""
    from charnerf.reporting.run_files import read_metrics

    try:
        return None if run is None else read_metrics(run / "metrics.json")["seconds"].get("train")
    except DataError:
        return None


def split_of(text: str) -> tuple[Path, str]:
    """Folder and split of DATASET[:SPLIT]."""
    folder, _, split = text.rpartition(":")
    return (Path(text), "train") if not folder or Path(text).is_dir() else (Path(folder), split)
