"""A clean data set to plant faults into."""

from pathlib import Path

import pytest

from support import helpers


@pytest.fixture(scope="session")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set of one figure that is not its own mirror image, 32 px, twelve views, depth, mesh; read only."""
    root = tmp_path_factory.mktemp("clean") / "data"
    helpers.write_figure(root, "lefty", "test", helpers.person(symmetric=False), views=12)
    return root
