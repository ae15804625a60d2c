"""`charnerf evaluate`: a model measured on a split."""

import json
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import typer

from charnerf.cli.messages import say
from charnerf.cli.model import load_model
from charnerf.cli.options import Dataset, Device, Resolution, Trusted, Weights
from charnerf.errors import ConfigError
from charnerf.meshing.options import MeshOptions

FIXED_VIEWS = 24  # a character, by weights that lie in no run's folder
NumViews = Annotated[
    str | None,
    typer.Option(
        "--views", metavar="N|all", help="Fixed views a character; as many as the run measured if left out."
    ),
]
JsonFile = Annotated[
    Path | None,
    typer.Option("--json", metavar="FILE", dir_okay=False, help="Write the metrics there as well."),
]
Kept = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", metavar="DIR", file_okay=False, help="Keep predictions and a report there."
    ),
]
Renderer = Annotated[
    Literal["culled", "dense", "adaptive"] | None,
    typer.Option(help="Another renderer than the model was trained with."),
]
Mesh = Annotated[bool, typer.Option(help="Make every mesh, for Chamfer and F-score.")]
Baselines = Annotated[
    bool, typer.Option(help="Measure white, the visual hull and the nearest beside the model.")
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


def command(
    *,
    data: Dataset,
    weights: Weights = None,
    split: Annotated[str, typer.Option(metavar="NAME", help="Split to measure on.")] = "test",
    views: NumViews = None,
    json_file: JsonFile = None,
    output: Kept = None,
    renderer: Renderer = None,
    mesh: Mesh = True,
    resolution: Resolution = MeshOptions.resolution,
    baselines: Baselines = True,
    nearest_from: NearestFrom = None,
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Measure a model on a split: PSNR, SSIM, LPIPS, FLIP, IoU, Chamfer, F-score, by angle, with seconds.

    Prints metrics.json.
    """
    if views not in (None, "all") and not (views.isdigit() and int(views) >= 1):
        raise ConfigError(f"--views: found '{views}', expected a number from 1 on, or all.")
    options = MeshOptions(resolution=resolution, height=None)
    from charnerf.evaluation.evaluate import evaluate
    from charnerf.evaluation.metrics_file import write_metrics
    from charnerf.evaluation.nearest import TrainingCharacters
    from charnerf.inference.weights import run_folder
    from charnerf.meshing.build import build_mesh
    from charnerf.reporting.run_report import write_run_report

    model = load_model(weights, device=device, trust=trust, renderer=renderer)
    run = run_folder(model.source)
    metrics = evaluate(
        model.network,
        model.renderer,
        data,
        split,
        views=_views_of(run) if views is None else "all" if views == "all" else int(views),
        output=output,
        mesh=partial(build_mesh, options=options) if mesh else None,
        baselines=baselines,
        training=TrainingCharacters([_split_of(one) for one in nearest_from]) if nearest_from else None,
        train_seconds=_train_seconds(run),
    )
    if output is not None:
        write_metrics(output / "metrics.json", metrics)
        say(f"report: {write_run_report(output)}")
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        write_metrics(json_file, metrics)
    typer.echo(json.dumps(metrics, indent=2))


def _views_of(run: Path | None) -> int | Literal["all"]:
    """Fixed views a character that a run measured at its end."""
    from omegaconf import OmegaConf

    from charnerf.inference.weights import load_config

    if run is None:
        return FIXED_VIEWS
    return OmegaConf.select(load_config(run), "scale.eval_views", default=FIXED_VIEWS) or "all"


def _train_seconds(run: Path | None) -> float | None:
    """Training time that a run noted, None where there is none."""
    if run is None:
        return None
    try:
        return json.loads((run / "metrics.json").read_text(encoding="utf-8"))["seconds"]["train"]
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _split_of(text: str) -> tuple[Path, str]:
    """Folder and split of DATASET[:SPLIT]."""
    folder, _, split = text.rpartition(":")
    return (Path(text), "train") if not folder or Path(text).is_dir() else (Path(folder), split)
