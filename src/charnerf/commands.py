"""What the commands of `charnerf` do; `charnerf.cli` reads their options."""

import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Literal

import torch
from omegaconf import OmegaConf

from charnerf.capture.character import CaptureOptions
from charnerf.capture.dataset import capture_dataset
from charnerf.capture.lights import Headlight, Unlit
from charnerf.config.options import option
from charnerf.data.characters import load_character
from charnerf.data.digest import split_digest
from charnerf.data.layout import read_dataset
from charnerf.errors import ConfigError, DataError
from charnerf.evaluation.evaluate import evaluate as evaluate_split
from charnerf.evaluation.metrics_file import write_metrics
from charnerf.evaluation.nearest import TrainingCharacters
from charnerf.files import write_text
from charnerf.geometry.resizing import resized_cameras
from charnerf.inference.build import build_renderer
from charnerf.inference.model import Model
from charnerf.inference.weights import load
from charnerf.meshing.build import build_mesh
from charnerf.meshing.options import MeshOptions
from charnerf.process import use_fastest_products
from charnerf.reporting.folder_report import report as write_report
from charnerf.reporting.run_report import write_run_report
from charnerf.types import Cameras, SourceViews

LIGHTS = {"unlit": Unlit, "headlight": Headlight}


def say(text: str) -> None:
    """Tell the user, beside what a command prints for programs."""
    sys.stderr.write(f"{text}\n")


def load_model(path: Path | None, *, device: str, trust: Sequence[str], renderer: str | None = None) -> Model:
    """Load a model onto a device, with its own renderer or another one of the same settings."""
    use_fastest_products()
    model = load(path, trusted_targets=trust).to(pick_device(device))
    if model.note is not None:
        say(f"{model.source}: {model.note}")
    if renderer is None:
        return model
    changed = OmegaConf.masked_copy(model.config, ["quadrature"])
    changed.renderer = option("renderer", renderer, like=model.config.renderer)
    return replace(model, renderer=build_renderer(changed))


def pick_device(name: str) -> torch.device:
    """Device of a name; `auto` is a GPU if there is one.

    Raises:
        ConfigError: If there is no such device.
    """
    if name == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    try:
        device = torch.device(name)
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError, NotImplementedError) as error:
        raise ConfigError(
            f"--device: found '{name}', expected auto, cpu or a GPU of this machine."
        ) from error
    return device


def capture(
    meshes: Sequence[Path],
    output: Path,
    *,
    split: str,
    views: int,
    size: int,
    up: str | None,
    facing: str | None,
    sources: str,
    light: str,
    depth: bool,
    variants: int,
    swaps: int,
    seed: int,
    jobs: int | None,
) -> None:
    """Capture meshes into a data set.

    Raises:
        DataError: After all others are done, if some could not be captured.
    """
    options = CaptureOptions(views=views, size=size, sources=sources, depth=depth, light=LIGHTS[light]())  # type: ignore[arg-type]
    axes = {"up": up, "facing": facing}
    done = capture_dataset(
        meshes,
        output,
        split,
        options=options,
        variants=variants,
        swaps=swaps,
        seed=seed,
        processes=jobs,
        **axes,
    )
    say(f"{len(done.captured)} characters captured into {output}, split {split}.")
    if done.captured:
        say(f"{split}: digest {split_digest(output, split)}")
    if done.failed:
        raise DataError(f"{len(done.failed)} meshes could not be captured:\n  " + "\n  ".join(done.failed))


def generate(
    output: Path, *, train: int, val: int, test: int, seed: int, views: int, size: int, jobs: int | None
) -> None:
    """Write the embedded characters."""
    from charnerf.capture.procedural_data import generate_dataset

    if train + val + test == 0:
        raise ConfigError("--train, --val, --test: found 0 each, expected at least one character.")
    generate_dataset(output, train, val, test, seed, views=views, size=size, processes=jobs)
    say(f"{train + val + test} characters are in {output}.")
    for split, members in read_dataset(output).splits.items():
        if members:
            say(f"{split}: {len(members)} characters, digest {split_digest(output, split)}")


def evaluate(
    weights: Path | None,
    data: Path,
    *,
    split: str,
    views: str | None,
    json_file: Path | None,
    output: Path | None,
    renderer: str | None,
    resolution: int | None,
    baselines: bool,
    nearest_from: Sequence[str],
    device: str,
    trust: Sequence[str],
) -> None:
    """Measure a model on a split and print the metrics as JSON."""
    if views not in (None, "all") and not (views.isdigit() and int(views) >= 1):
        raise ConfigError(f"--views: found '{views}', expected a number from 1 on, or all.")
    model = load_model(weights, device=device, trust=trust, renderer=renderer)
    if views is None:
        views = str(OmegaConf.select(model.config, "scale.eval_views", default=24) or "all")
    if output is not None:
        output.mkdir(parents=True, exist_ok=True)
    metrics = evaluate_split(
        model.network,
        model.renderer,
        data,
        split,
        views="all" if views == "all" else int(views),
        output=output,
        mesh=None
        if resolution is None
        else partial(build_mesh, options=MeshOptions(resolution=resolution, height=None)),
        baselines=baselines,
        training=TrainingCharacters([split_of(one) for one in nearest_from]) if nearest_from else None,
        train_seconds=train_seconds(model.source),
    )
    if output is not None:
        write_metrics(output / "metrics.json", metrics)
        say(f"report: {write_run_report(output)}")
    if json_file is not None:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        write_metrics(json_file, metrics)
    sys.stdout.write(json.dumps(metrics, indent=2) + "\n")


def split_of(text: str) -> tuple[Path, str]:
    """Folder and split of DATASET[:SPLIT]."""
    folder, _, split = text.rpartition(":")
    return (Path(text), "train") if not folder or Path(text).is_dir() else (Path(folder), split)


def train_seconds(weights: Path) -> float | None:
    """Training time that the run of some weights noted, None where there is none."""
    for folder in (weights.parent, weights.parent.parent):
        try:
            return json.loads((folder / "metrics.json").read_text(encoding="utf-8"))["seconds"]["train"]
        except (OSError, ValueError, KeyError, TypeError):
            continue
    return None


def finetune(
    drawings: tuple[Path, Path, Path],
    output: Path,
    *,
    weights: Path | None,
    seconds: float,
    side_is: Literal["left", "right"],
    device: str,
    trust: Sequence[str],
) -> None:
    """Adapt weights to a character's drawings, and tell what was assumed and whether it helped."""
    from charnerf.finetuning.command import finetune_drawings

    front, side, back = drawings
    model = load_model(weights, device=device, trust=trust)
    finetune_drawings(
        model, front=front, side=side, back=back, output=output, seconds=seconds, side_is=side_is, say=say
    )


def draw(data: Path, characters: Sequence[str], output: Path, *, size: int, seed: int) -> None:
    """Write drawings of characters of a data set."""
    from charnerf.drawings.artist import draw_character, write_drawings

    known = [load_character(data, name) for name in characters]
    for character in known:
        folder = output / character.name if len(known) > 1 else output
        files = write_drawings(draw_character(character, size=size, seed=seed), folder)
        say(", ".join(str(file) for file in files))


def gallery(
    folders: Sequence[Path],
    output: Path,
    *,
    weights: Path | None,
    size: int,
    device: str,
    trust: Sequence[str],
) -> None:
    """Write one picture of the reconstructions of several folders of drawings."""
    from charnerf.reconstruction.gallery import write_gallery

    model = load_model(weights, device=device, trust=trust)
    say(f"gallery: {write_gallery(model, folders, output, size=size)}")


def report(folder: Path, *, drawings: Path | None, trust: Sequence[str]) -> None:
    """Write the report of a run, or over all runs below a folder."""
    say(f"report: {write_report(folder, drawings=drawings, trusted=trust)}")


def bench(
    weights: Path | None,
    data: Path | None,
    split: str,
    quick: bool,
    json_file: Path | None,
    output: Path,
    *,
    device: str,
    trust: Sequence[str],
) -> None:
    """Measure error against run time."""
    from charnerf.bench.run import run, summary

    model = load_model(weights, device=device, trust=trust)
    result = run(model, data=data, split=split, quick=quick, output=output, say=say)
    if json_file is not None:
        write_text(json_file, json.dumps(result, indent=2) + "\n")
    sys.stdout.write(summary(result) + "\n")


CHECKED_SIZE = 48  # pixels: each one is a ray of its own
CHECKED_SEED = 20  # of the embedded character that a field is checked with


def check(
    weights: str | None,
    output: Path,
    *,
    data: Path | None,
    character: str | None,
    device: str,
    trust: Sequence[str],
) -> bool:
    """Run the catalogue of stiff cases, print its table and write JSON and plot; say whether it passed."""
    from charnerf.stability import TrainedField, run_check

    trained = None
    if weights is not None:
        model = load_model(None if weights == "released" else Path(weights), device=device, trust=trust)
        views, camera = _checked_character(model, data, character)
        trained = TrainedField(model.network, model.renderer, views.to(model.device), camera.to(model.device))
    result = run_check(trained, devices=None if device == "auto" else [pick_device(device)])
    output.mkdir(parents=True, exist_ok=True)
    result.to_json(output / "check.json")
    result.plot(output / "check.png")
    sys.stdout.write(result.table() + "\n")
    say(f"{output / 'check.json'}, {output / 'check.png'}: {'passed' if result.passed else 'BROKEN'}.")
    return result.passed


def _checked_character(model: Model, data: Path | None, character: str | None) -> tuple[SourceViews, Cameras]:
    """Source views (B = 1) of a data set's or of the embedded character, and a small camera of it."""
    if data is not None:
        splits = read_dataset(data).splits
        names = [name for split in splits.values() for name in split]
        if not names:
            raise DataError(f"{data}: found no characters, expected at least one.")
        known = load_character(data, character or names[0])
        return known.sources, _small(known.cameras[0])
    from charnerf.capture.character import capture_character
    from charnerf.procedural import make_character

    options = CaptureOptions(views=3, size=model.image_size, light=Unlit())
    pictures = capture_character(make_character(CHECKED_SEED), options).pictures
    return pictures.source_views, _small(pictures.cameras[1].to(torch.float32))


def _small(camera: Cameras) -> Cameras:
    """The same view with few pixels."""
    factor = CHECKED_SIZE / max(camera.width, camera.height)
    return resized_cameras(camera, round(camera.width * factor), round(camera.height * factor))
