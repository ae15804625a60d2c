"""A data set of two simple figures on disk, and an evaluation of it."""

from pathlib import Path

import pytest

from charnerf.evaluation.evaluate import evaluate
from charnerf.evaluation.metrics_file import write_metrics
from support.figures import HullModel, HullRenderer, write_figure


@pytest.fixture(scope="session")
def figure_dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two figures in the split "test", seven views each."""
    root = tmp_path_factory.mktemp("figures") / "dataset"
    write_figure(root, "ball", "ball", num_views=7)
    write_figure(root, "doll", "doll", num_views=7)
    return root


@pytest.fixture(scope="session")
def evaluated(figure_dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What an evaluation leaves: metrics.json, views.csv and images/; read only."""
    folder = tmp_path_factory.mktemp("evaluated") / "run"
    found = evaluate(
        HullModel(),
        HullRenderer(),
        figure_dataset,
        "test",
        views=2,
        output=folder,
        train_seconds=21.0,
    )
    write_metrics(folder / "metrics.json", found)
    return folder
