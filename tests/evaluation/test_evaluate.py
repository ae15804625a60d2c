import csv
import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from PIL import Image

from charnerf.data.characters import load_character
from charnerf.errors import NumericalError
from charnerf.evaluation import metrics
from charnerf.evaluation.evaluate import evaluate
from charnerf.evaluation.frames import fixed_views
from charnerf.evaluation.metrics_file import write_metrics
from charnerf.evaluation.scores import METRIC_KEYS
from charnerf.pictures import on_white
from charnerf.types import LeftOut, RenderOutput
from support.figures import BlindModel, HullModel, HullRenderer, WhiteRenderer, write_figure


def find_surface(scene, views):
    assert views.images.shape[0] == 1
    return SimpleNamespace(
        extraction=SimpleNamespace(mesh=scene.hull.mesh), left_out=LeftOut(grid_cells=5, grid_cells_of=8)
    )


class Broken:
    """Draws NaN."""

    def prepared(self, scene):
        return scene

    def render_camera(self, scene, camera):
        shape = (camera.height, camera.width)
        output = RenderOutput(torch.full((*shape, 3), math.nan), torch.zeros(shape), torch.zeros(shape))
        return SimpleNamespace(finest=output, left_out=LeftOut())


@pytest.fixture(scope="module")
def outcome(figure_dataset, tmp_path_factory):
    output = tmp_path_factory.mktemp("run")
    found = evaluate(
        HullModel(),
        HullRenderer(),
        figure_dataset,
        "test",
        views=4,
        output=output,
        mesh=find_surface,
        train_seconds=12.5,
    )
    return found, output


def test_every_key_of_the_format_is_there_and_every_null_has_its_reason(outcome):
    found, _ = outcome
    assert (found["split"], found["num_characters"], found["num_views"]) == ("test", 2, 8)
    assert list(found["per_character"]) == ["ball", "doll"]
    assert list(found["baselines"]) == ["white", "visual_hull", "nearest"]
    for scores in (found, *found["per_character"].values(), *found["baselines"].values()):
        for key in METRIC_KEYS:
            assert (scores[key] is None) == (f"{key}_reason" in scores)
    assert found["seconds"]["train"] == 12.5
    assert all(found["seconds"][key] > 0.0 for key in ("encode", "render_per_frame", "mesh"))
    assert found["left_out"] == {"rays": 0.75, "samples": 0.9, "grid_cells": 0.625}
    assert {"device", "torch", "commit", "threads", "machine"} <= set(found["environment"])
    assert found["peak_memory_mib"] > 50.0
    assert len(found["by_azimuth"]) == 12
    assert sum(row["num_views"] for row in found["by_elevation"]) == 8


@pytest.mark.slow
def test_two_processes_measure_what_one_does(outcome, figure_dataset, tmp_path):
    """Numbers, files and the order of characters; the record says how many there were."""
    found, output = outcome
    again = evaluate(
        HullModel(),
        HullRenderer(),
        figure_dataset,
        "test",
        views=4,
        output=tmp_path,
        mesh=find_surface,
        train_seconds=12.5,
        processes=3,
    )
    assert again["environment"]["processes"] == 2 and again["environment"]["threads"] == 1
    untimed = [{**one, "seconds": 0, "environment": 0, "peak_memory_mib": 0} for one in (found, again)]
    for one in untimed:
        one["baselines"] = {name: {**scores, "seconds": 0} for name, scores in one["baselines"].items()}
        del one["peak_memory_by_stage_mib"]
    assert untimed[0] == untimed[1]
    for file in ("views.csv", "images/doll/sheet.png"):
        assert (tmp_path / file).read_bytes() == (output / file).read_bytes()


@pytest.mark.slow
def test_an_error_of_a_process_is_the_errors_own(figure_dataset):
    with pytest.raises(NumericalError, match=r"(ball|doll), view \d: rgb"):
        evaluate(BlindModel(), Broken(), figure_dataset, "test", views=1, processes=2)


def test_a_model_that_answers_the_hull_scores_as_the_hull(outcome):
    found, _ = outcome
    for key in METRIC_KEYS:
        assert found[key] == found["baselines"]["visual_hull"][key]
    assert found["baselines"]["visual_hull"]["ahead"] == {
        "silhouette_iou": [],
        "psnr_union": [],
        "chamfer_mm": [],
    }
    assert found["baselines"]["white"]["chamfer_mm"] is None
    assert found["baselines"]["white"]["silhouette_iou"] == 0.0


def test_means_are_over_the_characters(outcome):
    found, _ = outcome
    for key in ("psnr", "psnr_foreground", "ssim", "flip", "silhouette_iou", "chamfer_mm", "f_score"):
        both = [found["per_character"][name][key] for name in ("ball", "doll")]
        assert found[key] == pytest.approx(sum(both) / 2.0)


def test_every_view_is_a_row_and_the_rows_mean_is_the_metric(outcome, figure_dataset):
    found, output = outcome
    with (output / "views.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * 8
    assert found["data_root"] == str(figure_dataset.resolve())
    doll = [row for row in rows if (row["method"], row["character"]) == ("ours", "doll")]
    mean = sum(float(row["psnr"]) for row in doll) / len(doll)
    assert mean == pytest.approx(found["per_character"]["doll"]["psnr"])
    assert {row["view"] for row in doll} == {
        path.stem for path in (output / "images" / "doll").glob("0*.png")
    }
    assert all(row["lpips_vgg"] == "" for row in rows)


def test_kept_predictions_give_the_same_metric_again(outcome, figure_dataset):
    """A metric can be added later: PNG bytes move PSNR by less than 0.05 dB."""
    found, output = outcome
    character = load_character(figure_dataset, "doll")
    again = []
    for index in fixed_views(character, 4):
        kept = output / "images" / "doll" / f"{index:03d}.png"
        prediction = on_white(torch.from_numpy(np.array(Image.open(kept)) / 255.0)).float()
        again.append(metrics.psnr(prediction, on_white(character.images([index])[0] / 255.0)))
    assert np.mean(again) == pytest.approx(found["per_character"]["doll"]["psnr"], abs=0.05)
    assert (output / "images" / "doll" / "sheet.png").is_file()


def test_what_was_not_made_is_null_with_its_reason(figure_dataset):
    found = evaluate(BlindModel(), WhiteRenderer(), figure_dataset, "test", views=1, baselines=False)
    assert found["baselines"] == {}
    assert found["chamfer_mm_reason"] == found["seconds"]["mesh_reason"] == "no mesh was made"
    assert found["seconds"]["train"] is None and found["seconds"]["train_reason"]
    assert found["left_out"]["rays"] is None and found["left_out"]["rays_reason"]
    assert found["silhouette_iou"] == 0.0


def test_a_mesh_that_fails_is_a_reason_and_no_end(figure_dataset):
    def fail(scene, views):
        raise NumericalError("density: found 3 values not finite.")

    found = evaluate(
        BlindModel(),
        WhiteRenderer(),
        figure_dataset,
        "test",
        views=1,
        mesh=fail,
        baselines=False,
    )
    assert found["chamfer_mm_reason"] == "density: found 3 values not finite."


def test_a_prediction_of_nan_names_its_picture(figure_dataset):
    with pytest.raises(NumericalError, match=r"ball, view \d: rgb"):
        evaluate(BlindModel(), Broken(), figure_dataset, "test", views=1)


def test_a_data_set_without_meshes_says_so(tmp_path):
    write_figure(tmp_path, "ball", "ball", num_views=2)
    (tmp_path / "ball" / "mesh" / "mesh.obj").unlink()
    found = evaluate(
        HullModel(),
        HullRenderer(),
        tmp_path,
        "test",
        views=1,
        mesh=find_surface,
        baselines=False,
    )
    assert found["f_score_reason"] == "the data set has no mesh of the character"


def test_metrics_are_written_whole_or_not_at_all(tmp_path):
    path = tmp_path / "metrics.json"
    write_metrics(path, {"psnr": 1.5})
    assert json.loads(path.read_text()) == {"psnr": 1.5}
    with pytest.raises(ValueError, match="JSON"):
        write_metrics(path, {"psnr": math.nan})
    assert json.loads(path.read_text()) == {"psnr": 1.5}
    assert list(tmp_path.iterdir()) == [path]


def test_drawings_themselves_are_measured_where_views_are_drawn(figure_dataset, outcome):
    def blank(character):
        nothing = replace(character.sources, images=torch.zeros_like(character.sources.images))
        return replace(character, sources=nothing if character.name == "doll" else replace(character.sources))

    found = evaluate(
        HullModel(), HullRenderer(), figure_dataset, "test", views=1, baselines=False, redrawn=blank
    )
    assert "drawings" not in outcome[0]
    doll = load_character(figure_dataset, "doll").sources.images[0].permute(0, 2, 3, 1)
    squared = ((on_white(doll) - 1.0) ** 2).mean(dim=(1, 2, 3))
    assert found["drawings"]["psnr"] == pytest.approx(
        (100.0 - 10.0 * squared.log10().mean().item()) / 2.0, abs=0.01
    )
    assert found["drawings"]["silhouette_iou"] == pytest.approx(0.5)
    assert found["drawings"]["chamfer_mm_reason"] == "drawings have no surface"
