"""The folder of a fine-tuning: weights that load, a curve, a report that tells what happened."""

import csv
from dataclasses import replace

import pytest
import torch
from PIL import Image

import charnerf
from charnerf.cli import run
from charnerf.config.composition import compose_config
from charnerf.drawings.viewpoints import turnaround
from charnerf.errors import DataError
from charnerf.finetuning import Recipe, command, finetune
from charnerf.finetuning.report import write_finetuned
from charnerf.inference.build import build_model
from charnerf.inference.model import Model
from charnerf.inference.weights import save_weights

QUICK = Recipe(
    seconds=60.0,
    most_steps=10,
    check_every=5,
    rays=128,
    novel_rays=32,
    learning_rate=3e-3,
    least_likeness=0.0,
)


@pytest.fixture(scope="module")
def model(tmp_path_factory) -> Model:
    """An untrained model of scale=smoke, with a config of its own."""
    torch.manual_seed(0)
    cfg = compose_config(["scale=smoke"])
    file = tmp_path_factory.mktemp("smoke") / "weights.safetensors"
    return charnerf.load(save_weights(file, build_model(cfg), cfg))


def test_the_folder_loads_as_the_adapted_model(model, person_views, tmp_path):
    done = finetune(model, model.encode_views(person_views), QUICK)
    assert done.kept, done.reason
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "notes.txt").write_text("mine")
    report = write_finetuned(done, tmp_path / "out", recipe=QUICK, drawings=None)
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == [
        "config.yaml",
        "curve.csv",
        "curve.png",
        "notes.txt",
        "report.html",
        "report.md",
        "weights.safetensors",
    ]
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]
    again = charnerf.load(tmp_path / "out")
    assert again.note is not None and "one character" in again.note and model.note is None
    for name, tensor in again.network.state_dict().items():
        assert torch.equal(tensor, done.model.network.state_dict()[name])
    rows = list(csv.DictReader((tmp_path / "out" / "curve.csv").open()))
    assert [int(row["step"]) for row in rows] == [0, 5, 10]
    assert float(rows[0]["held_out"]) > done.best.held_out
    text = report.with_suffix(".md").read_text()
    for words in (
        "Kept: the error",
        "for this one character",
        "| seconds | step |",
        "Left out: 10 encoder passes",
    ):
        assert words in text


def test_what_was_not_kept_is_said_and_loads_too(model, person_views, tmp_path):
    recipe = replace(QUICK, learning_rate=0.0)
    done = finetune(model, model.encode_views(person_views), recipe)
    report = write_finetuned(done, tmp_path / "out", recipe=recipe, drawings=None)
    assert "Not kept" in report.with_suffix(".md").read_text()
    again = charnerf.load(tmp_path / "out" / "weights.safetensors")
    assert again.note is not None and "not kept" in again.note
    for name, tensor in again.network.state_dict().items():
        assert torch.equal(tensor, model.network.state_dict()[name])


def test_the_command_writes_weights_that_reconstruct_can_use(
    model, person_views, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(command, "Recipe", lambda: QUICK)  # so many steps, however busy the machine is
    drawings = _drawings(person_views, tmp_path)
    arguments = [*drawings, "-o", str(tmp_path / "fitted"), "--weights", str(model.source)]
    assert run(["finetune", *arguments, "--seconds", "600", "--device", "cpu"]) == 0
    told = capsys.readouterr().err
    assert "floor line" in told and "Left out" in told and "report.html" in told
    assert charnerf.load(tmp_path / "fitted").note is not None
    assert run(["finetune", *arguments, "--seconds", "0"]) == 2
    assert run(["finetune", *arguments[:3], "-o", drawings[0], "--seconds", "2"]) != 0


def test_time_that_preparing_uses_up_is_an_error_and_writes_nothing(
    model, person_views, tmp_path, monkeypatch
):
    monkeypatch.setattr(
        command, "refine", lambda *_, **__: finetune(model, hero, replace(QUICK, seconds=1e-6))
    )
    hero = model.encode_views(person_views)
    drawings = dict(zip(("front", "side", "back"), _drawings(person_views, tmp_path), strict=True))
    with pytest.raises(
        DataError, match=r"--seconds: found 1, but preparing the drawings took .* s here and no step"
    ):
        command.finetune_drawings(
            model, turnaround(**drawings), output=tmp_path / "out", seconds=1.0, say=lambda line: None
        )
    assert not (tmp_path / "out").exists()


def test_the_last_steps_are_looked_at_when_time_ends_between_looks(model, person_views):
    done = finetune(
        model,
        model.encode_views(person_views),
        replace(QUICK, seconds=0.4, check_every=10**6, most_steps=10**6),
    )
    assert len(done.curve) <= 2 and (len(done.curve) == 1 or done.curve[-1].step > 0)


def test_reconstruct_refines_first_and_reports_it(model, person_views, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(command, "Recipe", lambda: QUICK)  # so many steps, however busy the machine is
    arguments = [
        *_drawings(person_views, tmp_path),
        "-o",
        str(tmp_path / "hero"),
        "--weights",
        str(model.source),
    ]
    small = ["--frames", "1", "--size", "16", "--resolution", "24", "--faces", "200", "--texture", "vertex"]
    options = ["--refine", "60", "--smooth", "2", "--symmetric", "--device", "cpu"]
    assert run(["reconstruct", *arguments, *small, *options]) == 0
    told = capsys.readouterr().err
    assert "Left out" in told and "drawings' rays" in told
    text = (tmp_path / "hero" / "report.md").read_text()
    assert "## Refinement" in text and "| refine |" in text
    assert (tmp_path / "hero" / "refinement.png").is_file()


def _drawings(views, folder) -> list[str]:
    """The views as picture files."""
    paths = []
    for view, name in enumerate(("front", "side", "back")):
        picture = (255 * views.images[0, view].permute(1, 2, 0)).round().byte().numpy()
        paths.append(str(folder / f"{name}.png"))
        Image.fromarray(picture).resize((96, 96)).save(paths[-1])
    return paths
