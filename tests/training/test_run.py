"""A whole run from a composed config: its folder, TensorBoard's events, and going on from it."""

import csv
import json
import re
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from charnerf.cli import run as charnerf
from charnerf.errors import ConfigError
from charnerf.evaluation.scores import METRIC_KEYS
from charnerf.inference.build import build_model
from charnerf.inference.weights import load, load_config
from charnerf.training.checkpoint import find_checkpoint
from charnerf.training.clock import RunClock
from charnerf.training.optimization import rate_at
from charnerf.training.run import run_training, training_renderer
from charnerf.training.start import begin
from support import small_runs
from support.tags import promised_tags

STEPS = 12
MARKS = [STEPS // 2, STEPS]  # of validations
VALUES = ("reconstruction", "surface_rgb", "surface_alpha", "opacity", "depth", "occupancy")  # of the loss
WEIGHTS = (
    "reconstruction.weight",
    "surface.rgb_weight",
    "surface.alpha_weight",
    "opacity.weight",
    "depth.weight",
    "occupancy.weight",
)


@pytest.fixture(scope="module")
def run_folder(figure_dataset, tmp_path_factory) -> Path:
    """The smallest run with every term that a figure's data set can feed."""
    folder = tmp_path_factory.mktemp("outputs") / "smoke"
    settings = (
        "encoder=single",
        "loss=charnerf",
        *(f"loss.{key}=0.1" for key in WEIGHTS),
        "schedule=two_phase",
        "validation.times=2",
        "scale.eval_views=1",
        f"scale.steps={STEPS}",
        "scale.phase_rays=[16,32]",
        "scale.phase_surface_points=[8,16]",
    )
    run_training(small_runs.smoke_config(figure_dataset, *settings), folder)
    return folder


def test_the_run_folder_is_complete(run_folder):
    """As design.md lays it out; what tells of the run agrees with itself."""
    for name in (
        "config.yaml", "checkpoints/last.ckpt", "checkpoints/best.ckpt", "weights.safetensors", "tensorboard",
        "curve.csv", "metrics.json", "images", "meshes/twin.glb", "meshes/twin_sheet.png", "report.md",
    ):  # fmt: skip
        assert (run_folder / name).exists(), name
    metrics = json.loads((run_folder / "metrics.json").read_text())
    assert metrics["split"] == "test" and list(metrics["per_character"]) == ["twin"]
    assert metrics["seconds"]["train"] > 0
    assert metrics["environment"]["training_steps_by_threads"] == {str(torch.get_num_threads()): STEPS}
    assert load_config(run_folder).loss.depth.weight == 0.1
    model = load(run_folder)
    assert not model.network.training


def test_evaluating_the_run_gives_its_own_figures(run_folder, figure_dataset, tmp_path):
    """Typed without options: as many views, meshes as fine, and the renderer are the run's."""
    file = tmp_path / "metrics.json"
    command = ["evaluate", str(run_folder), "--data", str(figure_dataset), "--json", str(file)]
    assert charnerf([*command, "--nearest-from", str(figure_dataset), "--device", "cpu"]) == 0
    own, again = (json.loads(path.read_text()) for path in (run_folder / "metrics.json", file))
    assert again["num_views"] == own["num_views"] == 1
    measured = [key for key in METRIC_KEYS if own[key] is not None]  # VGG needs weights
    assert {*METRIC_KEYS} - {*measured} <= {"lpips_vgg"}
    assert [again[key] for key in measured] == pytest.approx([own[key] for key in measured], rel=1e-5)
    assert again["baselines"]["nearest"]["found"] == own["baselines"]["nearest"]["found"]
    assert again["seconds"]["train"] == own["seconds"]["train"]


def test_the_curve_has_a_row_a_validation(run_folder):
    with (run_folder / "curve.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [int(row["step"]) for row in rows] == MARKS
    assert [float(row["phase"]) for row in rows] == [0.0, 1.0]
    assert [float(row["rays"]) for row in rows] == [16.0, 32.0]
    assert 0 < float(rows[0]["seconds"]) < float(rows[1]["seconds"])
    assert all(
        float(row[name]) > 0 for row in rows for name in ("val_psnr", "val_psnr_foreground", "val_ssim")
    )
    assert all(float(row[term]) >= 0 for row in rows for term in VALUES)


def test_tensorboards_own_reader_finds_what_the_page_promises(run_folder):
    """No less, and no more."""
    events = EventAccumulator(str(run_folder / "tensorboard"), size_guidance={"tensors": 0}).Reload()
    tags, promised = events.Tags(), promised_tags()
    meshes = {re.sub("_(VERTEX|FACE|COLOR)$", "", tag) for tag in tags["tensors"] if tag.startswith("mesh/")}
    found = {*tags["scalars"], *tags["images"], *meshes}
    assert {tag for tag, one in promised.items() if not any(map(one.fullmatch, found))} == set()
    assert {tag for tag in found if not any(one.fullmatch(tag) for one in promised.values())} == set()
    assert {f"train/loss/{term}" for term in (*VALUES, "total")} <= found
    assert {"by_milliseconds/psnr/phase_0", "by_milliseconds/psnr/phase_1", "mesh/twin"} <= found
    assert {f"attention/{view}" for view in ("front", "side", "back")} <= found


def test_what_tensorboard_shows_is_true(run_folder):
    events = EventAccumulator(str(run_folder / "tensorboard"), size_guidance={"tensors": 0}).Reload()
    assert [event.value for event in events.Scalars("train/rays")] == [16.0, 32.0]
    assert [event.step for event in events.Scalars("val/ssim")] == MARKS
    seconds = [event.value for event in events.Scalars("train/seconds")]
    assert seconds == sorted(seconds) and seconds[0] > 0
    shares = [tag for tag in events.Tags()["scalars"] if tag.startswith("attention/")]
    for number in range(2):
        assert sum(events.Scalars(tag)[number].value for tag in shares) == pytest.approx(1.0, abs=1e-5)
    pictures = events.Images("val/target_prediction_error_depth_opacity/0")
    assert [(one.width, one.height, one.step) for one in pictures] == [(5 * 32, 32, step) for step in MARKS]
    metrics = json.loads((run_folder / "metrics.json").read_text())
    final = {tag: events.Scalars(f"Final/{tag}")[0].value for tag in ("psnr", "seconds_train")}
    expected = {"psnr": metrics["psnr"], "seconds_train": metrics["seconds"]["train"]}
    assert final == pytest.approx(expected, rel=1e-5)
    settings = events.summary_metadata["_hparams_/session_start_info"].plugin_data.content
    assert b"num_parameters" in settings and b"model.box_half_extent" in settings


@pytest.mark.parametrize("split", ["train=[train,more]", "val=more", "test=more"])
def test_a_split_that_is_not_there_is_found_before_training(figure_dataset, tmp_path, split):
    cfg = small_runs.smoke_config(figure_dataset, f"splits.{split}")
    with pytest.raises(
        ConfigError, match=r"^splits\.\w+: split 'more' does not exist; its splits are: .*test \(1\)"
    ):
        run_training(cfg, tmp_path / "run")
    assert not (tmp_path / "run" / "weights.safetensors").exists()


def test_pictures_of_another_size_are_told_before_training(figure_dataset, tmp_path):
    cfg = small_runs.smoke_config(figure_dataset, "scale.image_size=64")
    with pytest.raises(
        ConfigError, match=r"scale\.image_size: found 64, expected 32.*Set scale\.image_size=32"
    ):
        run_training(cfg, tmp_path / "run")


def test_a_checkpoint_is_found_or_named(run_folder, tmp_path):
    last = run_folder / "checkpoints/last.ckpt"
    assert find_checkpoint(None, tmp_path) is None
    assert find_checkpoint("last", run_folder) == last
    assert find_checkpoint("last", run_folder.parent / "next") is None  # not that of the run beside it
    assert find_checkpoint(str(last), tmp_path) == last
    with pytest.raises(ConfigError, match=r"ckpt_path: found 'gone\.ckpt', which is no file"):
        find_checkpoint("gone.ckpt", tmp_path)


def test_a_run_begins_with_the_weights_of_another(run_folder, figure_dataset, tmp_path):
    settings = (
        "encoder=single",
        "schedule=two_phase",
        "scale.phase_rays=[16,32]",
        f"start_from={run_folder}",
    )
    cfg = small_runs.smoke_config(figure_dataset, *settings)
    model = build_model(cfg)
    assert str(run_folder) in begin(model, cfg)
    for name, value in load(run_folder).network.state_dict().items():
        torch.testing.assert_close(model.state_dict()[name], value, rtol=0.0, atol=0.0)


def test_a_run_begins_with_the_weights_of_a_narrower_one(run_folder, figure_dataset, tmp_path):
    settings = (
        "encoder=single",
        "model.width=24",
        "model.num_multi_view_blocks=2",
        f"start_from={run_folder}",
    )
    cfg = small_runs.smoke_config(figure_dataset, *settings)
    model = build_model(cfg)
    assert "grown from model.width=16 model.num_multi_view_blocks=1" in begin(model, cfg)
    mine, its = model.state_dict(), load(run_folder).network.state_dict()
    name = "coarse.multi_view.blocks.0.first.weight"
    torch.testing.assert_close(mine[name][:16, :16], its[name], rtol=0.0, atol=0.0)


@pytest.mark.parametrize("change", ["scale.width=12", "scale.width=24"])
def test_weights_of_another_model_are_refused_before_work_starts(
    run_folder, figure_dataset, tmp_path, change
):
    """Narrower, or with another encoder too."""
    cfg = small_runs.smoke_config(figure_dataset, f"start_from={run_folder}", change)
    with pytest.raises(
        ConfigError, match=r"start_from: found the weights of another model.*model\.width=16 encoder=single "
    ):
        run_training(cfg, tmp_path / "run")
    assert not (tmp_path / "run" / "checkpoints").exists()


def test_a_checkpoint_holds_nothing_but_numbers_and_names(run_folder):
    content = torch.load(run_folder / "checkpoints/last.ckpt", weights_only=True)
    assert content["global_step"] == STEPS  # of the last validation, whether it was the best or not
    assert content["callbacks"]["RunClock"]["steps"] == STEPS


def test_the_rate_rises_then_falls_by_a_cosine():
    assert rate_at(0.0, final=0.1) == pytest.approx(0.05)
    assert rate_at(0.01, final=0.1) == pytest.approx(1.0, abs=1e-3)
    assert rate_at(0.5, final=0.1) == pytest.approx(0.55)
    assert rate_at(1.0, final=0.1) == pytest.approx(0.1)
    assert rate_at(0.7, final=1.0) == 1.0


def test_the_clock_counts_training_only():
    clock = RunClock(steps=10, seconds=None)
    assert clock.position().progress == 0.0 and clock.seconds == 0.0
    alone = SimpleNamespace(strategy=SimpleNamespace(broadcast=lambda seconds: seconds))
    clock.on_train_epoch_start(None, None)
    clock.on_train_batch_end(alone, None)
    clock.on_validation_start(None, None)
    stopped = clock.seconds
    clock.on_train_epoch_start(None, None)
    assert 0 < stopped == clock.seconds and clock.steps == 1
    clock.steps = 0
    assert clock.position(step=7).progress == 0.7 and clock.position().step == 0
    other = RunClock(steps=None, seconds=2.0 * stopped)
    other.load_state_dict(clock.state_dict())
    assert other.position().progress == pytest.approx(0.5)


def test_the_training_renderer_has_its_own_samples(figure_dataset):
    cfg = small_runs.smoke_config(figure_dataset, "scale.num_coarse=24", "scale.train_num_coarse=6")
    assert training_renderer(cfg).num_coarse == 6 and cfg.renderer.num_coarse == 24
