"""A data set of two simple figures on disk."""

from pathlib import Path

import pytest

from support.figures import write_figure


@pytest.fixture(scope="session")
def figure_dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two figures in the split "test", seven views each."""
    root = tmp_path_factory.mktemp("figures") / "dataset"
    write_figure(root, "ball", "ball", num_views=7)
    write_figure(root, "doll", "doll", num_views=7)
    return root
