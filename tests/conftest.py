"""What all tests share: one seed, opt-in markers, the config folder."""

import os
from pathlib import Path

import pytest
import torch

ROOT = Path(__file__).resolve().parents[1]
OPT_IN = {"gpu": "CHARNERF_TEST_GPU", "blender": "CHARNERF_TEST_BLENDER", "slow": "CHARNERF_TEST_SLOW"}


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Skip marked tests unless `-m` names their marker or its variable is 1."""
    asked = str(config.getoption("markexpr"))
    for item in items:
        for marker, variable in OPT_IN.items():
            if marker in item.keywords and marker not in asked and os.environ.get(variable) != "1":
                item.add_marker(pytest.mark.skip(reason=f"opt in by -m {marker} or {variable}=1"))


@pytest.fixture(autouse=True)
def _one_seed() -> None:
    torch.manual_seed(0)


@pytest.fixture(scope="session")
def conf() -> Path:
    """Folder of the config files."""
    return ROOT / "conf"
