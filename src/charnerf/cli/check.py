"""`charnerf check`: numerical kernels, and a trained field, on stiff and extreme cases."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from charnerf.cli.dataset import GivenDataset
from charnerf.cli.model import load_model, pick_device
from charnerf.cli.options import Device, SomeCharacter, SomeDataset, Trusted
from charnerf.cli.summary import JsonFile, Summary, check_json, close, show
from charnerf.errors import DataError

if TYPE_CHECKING:
    from charnerf.inference.model import Model
    from charnerf.types import Cameras, SourceViews

EXAMPLES = (
    "charnerf check",
    "charnerf check released -o checked",
    "charnerf check outputs/run --data characters",
)
BROKEN = 1  # exit status
CHECKED_SIZE = 48  # pixels: each one is a ray of its own
CHECKED_SEED = 20  # of the embedded character that a field is checked with


def command(
    weights: Annotated[
        str | None,
        typer.Argument(
            metavar="RUN_OR_WEIGHTS",
            help="A run folder, a .ckpt, a .safetensors, or `released`: its field is checked too.",
        ),
    ] = None,
    *,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="DIR", file_okay=False, help="For check.json and check.png."),
    ] = Path("outputs/check"),
    data: SomeDataset = None,
    character: SomeCharacter = None,
    device: Device = "auto",
    trust: Trusted = None,
    json_file: JsonFile = None,
) -> None:
    """Measure every numerical kernel, and a trained field, on stiff and extreme cases.

    Each row compares with a reference of higher precision and has a bound; the usual formulas stand beside
    and have to fail. Exit status 1 if any bound is broken.
    """
    from charnerf.files import check_folder
    from charnerf.stability import TrainedField, run_check

    began = time.perf_counter()
    check_json(json_file)
    check_folder(output)
    trained = None
    if weights is not None:
        model = load_model(None if weights == "released" else Path(weights), device=device, trust=trust)
        views, camera = _character(model, data, character)
        trained = TrainedField(model.network, model.renderer, views.to(model.device), camera.to(model.device))
    result = run_check(trained, devices=None if device == "auto" else [pick_device(device)])
    output.mkdir(parents=True, exist_ok=True)
    result.to_json(output / "check.json")
    result.plot(output / "check.png")
    show(result.table(), json_file)
    files = (output / "check.json", output / "check.png")
    told = "passed" if result.passed else "BROKEN"
    facts = {"passed": result.passed}
    close(
        Summary(made="a check of the kernels", files=files, began=began, quality=told, facts=facts), json_file
    )
    if not result.passed:
        raise typer.Exit(BROKEN)


def _character(model: "Model", data: Path | None, name: str | None) -> tuple["SourceViews", "Cameras"]:
    """Source views (B = 1) of a data set's or of the embedded character, and a small camera of it."""
    import torch

    if data is not None:
        from charnerf.data.characters import load_character
        from charnerf.data.layout import read_dataset

        root = GivenDataset(data, None).opened()
        names = [one for split in read_dataset(root).splits.values() for one in split]
        if not names:
            raise DataError(f"{data}: found no characters, expected at least one.")
        character = load_character(root, name or names[0])
        return character.sources, _small(character.cameras[0])
    from charnerf.capture.character import CaptureOptions, capture_character
    from charnerf.capture.lights import Unlit
    from charnerf.procedural import make_character

    options = CaptureOptions(views=3, size=model.image_size, light=Unlit())
    pictures = capture_character(make_character(CHECKED_SEED), options).pictures
    return pictures.source_views, _small(pictures.cameras[1].to(torch.float32))


def _small(camera: "Cameras") -> "Cameras":
    """The same view with few pixels."""
    from charnerf.geometry.resizing import resized_cameras

    factor = CHECKED_SIZE / max(camera.width, camera.height)
    return resized_cameras(camera, round(camera.width * factor), round(camera.height * factor))
