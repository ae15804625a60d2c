"""The baseline that remembers: which training character it takes, and what it shows."""

import shutil

import pytest
import torch
from PIL import Image

from charnerf.cli.evaluate import split_of
from charnerf.data.characters import load_character
from charnerf.evaluation import metrics
from charnerf.evaluation.baselines import VisualHullBaseline
from charnerf.evaluation.evaluate import evaluate
from charnerf.evaluation.nearest import NearestBaseline, TrainingCharacters, filled_drawings
from charnerf.evaluation.scores import METRIC_KEYS
from charnerf.pictures import on_white
from support.figures import BlindModel, WhiteRenderer, write_figure


@pytest.fixture(scope="module")
def training(tmp_path_factory):
    """The same ball and the same doll, the doll's pictures framed wider."""
    root = tmp_path_factory.mktemp("training") / "dataset"
    write_figure(root, "train-ball", "ball", num_views=1)
    write_figure(root, "train-doll", "doll", num_views=1, half_extent=1.5)
    return root


def test_it_takes_the_same_shape_whatever_its_pictures_frame(training, figure_dataset):
    known = TrainingCharacters([(training, "test")])
    assert len(known) == 2
    for kind in ("ball", "doll"):
        character = load_character(figure_dataset, kind)
        overlaps = {folder.name: iou for folder, iou in known.overlaps(character).items()}
        assert known.nearest(character).name == f"train-{kind}"
        assert overlaps[f"train-{kind}"] > 0.93
        assert max(iou for name, iou in overlaps.items() if name != f"train-{kind}") < 0.7


def test_overlap_is_the_intersection_over_the_union(figure_dataset):
    """Against the masks themselves: both characters are framed alike, so that pixels can be compared."""
    known = TrainingCharacters([(figure_dataset, "test")])
    ball, doll = (load_character(figure_dataset, name) for name in ("ball", "doll"))
    one, other = (each.sources.images[0, :, 3] > 0.5 for each in (ball, doll))
    expected = ((one & other).sum((1, 2)) / (one | other).sum((1, 2))).mean()
    found = known.overlaps(ball)
    assert list(found) == [doll.folder]  # never itself
    assert found[doll.folder] == pytest.approx(float(expected), abs=0.02)


def test_with_the_right_shape_every_picture_is_better_than_the_hulls(training, figure_dataset):
    """Also from where no drawing looks, and it is the truth but for the edges where a drawing looks."""
    doll = load_character(figure_dataset, "doll")
    drawn = NearestBaseline(TrainingCharacters([(training, "test")]).nearest(doll), doll.sources)
    hull = VisualHullBaseline(doll.sources)
    best = 0.0
    for index in range(7):
        rgba = doll.images([index])[0] / 255.0
        truth, alpha = on_white(rgba), rgba[..., 3]
        ours, carved = (one.render(doll.cameras[index]) for one in (drawn, hull))
        assert metrics.silhouette_iou(ours.opacity, alpha) > metrics.silhouette_iou(carved.opacity, alpha)
        found = metrics.psnr_foreground(ours.rgb, truth, alpha)
        assert found > metrics.psnr_foreground(carved.rgb, truth, alpha)
        best = max(best, found)
    assert best > 30.0


def test_a_shape_beside_the_drawing_takes_the_nearest_color_of_the_figure():
    image = torch.zeros(1, 4, 5, 6)
    image[0, :, 2, 1] = torch.tensor([0.9, 0.2, 0.1, 1.0])
    image[0, :, 2, 4] = torch.tensor([0.1, 0.2, 0.9, 1.0])
    filled = filled_drawings(image)[0]
    assert bool((filled[3] == 1.0).all())
    assert bool((filled[0, :, :2] == 0.9).all()) and bool((filled[2, :, 4:] == 0.9).all())
    assert bool((filled_drawings(torch.zeros(1, 4, 3, 3)) == 1.0).all())


def test_evaluation_fills_every_metric_and_says_why_where_it_can_not(training, figure_dataset, tmp_path):
    shutil.copytree(training, tmp_path / "bare")
    for folder in (tmp_path / "bare").glob("train-*"):
        shutil.rmtree(folder / "mesh")

    def measure(known):
        options = {"views": 1, "training": known}
        found = evaluate(BlindModel(), WhiteRenderer(), figure_dataset, "test", **options)
        return found["baselines"]["nearest"]

    found = measure(TrainingCharacters([(training, "test")]))
    assert all(found[key] is not None for key in METRIC_KEYS if key != "lpips_vgg")
    assert {name: one["character"] for name, one in found["found"].items()} == {
        "ball": "train-ball",
        "doll": "train-doll",
    }
    assert found["chamfer_mm"] < 5.0 and found["f_score"] > 0.99
    for known, reason in (
        (None, "--nearest-from"),
        (TrainingCharacters([(tmp_path / "bare", "test")]), "mesh"),
    ):
        found = measure(known)
        assert all(found[key] is None and reason in found[f"{key}_reason"] for key in METRIC_KEYS)
        assert found["found"] == {}


def test_a_sheet_shows_it(training, figure_dataset, tmp_path):
    known = TrainingCharacters([(training, "test")])
    arguments = (BlindModel(), WhiteRenderer(), figure_dataset, "test")
    evaluate(*arguments, views=1, output=tmp_path / "with", training=known)
    evaluate(*arguments, views=1, output=tmp_path / "without", baselines=False)
    with_both, without = (
        Image.open(tmp_path / name / "images/doll/sheet.png").height for name in ("with", "without")
    )
    assert with_both - without == 2 * 96, "a row of the hull's pictures and one of the nearest's"
    rows = (tmp_path / "with/views.csv").read_text().splitlines()
    assert sum(row.startswith("nearest,") for row in rows) == 2


def test_data_sets_and_splits_are_named_in_one_word(tmp_path):
    (tmp_path / "a:b").mkdir()
    assert split_of(f"{tmp_path}/x:extra") == (tmp_path / "x", "extra")
    assert split_of(f"{tmp_path}/x") == (tmp_path / "x", "train")
    assert split_of(f"{tmp_path}/a:b") == (tmp_path / "a:b", "train")
