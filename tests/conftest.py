"""What all tests share: one seed, opt-in markers, the config folder."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

# One thread a process, here and in those that tests start: on busy cores threads wait long for one another. Read when torch loads.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest
import torch

from charnerf.interruption import SIGNALS
from charnerf.process import use_fastest_products
from charnerf.thread_count import restored_threads
from charnerf.types import SourceViews
from support import helpers

ROOT = Path(__file__).resolve().parents[1]
OPT_IN = {marker: f"CHARNERF_TEST_{marker.upper()}" for marker in ("gpu", "blender", "browser", "slow")}


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Skip marked tests unless `-m` names their marker or its variable is 1."""
    asked = str(config.getoption("markexpr"))
    for item in items:
        for marker, variable in OPT_IN.items():
            if marker in item.keywords and marker not in asked and os.environ.get(variable) != "1":
                item.add_marker(pytest.mark.skip(reason=f"opt in by -m {marker} or {variable}=1"))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Under `-n` each file runs in one process, so that what its tests have in common is made once."""
    from xdist.scheduler import LoadFileScheduling

    return LoadFileScheduling(config, log)


@pytest.fixture(autouse=True, scope="session")
def _products_of_doors() -> None:
    """As doors set them: the numbers must not depend on whether a test that runs a command came before."""
    use_fastest_products()


@pytest.fixture(autouse=True, scope="session")
def _signals_of_a_terminal() -> None:
    """Heard, here and in what tests start: shells let background jobs, and nohup what it starts, ignore some."""
    for number in SIGNALS:
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)


@pytest.fixture(autouse=True)
def _one_seed() -> None:
    torch.manual_seed(0)


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    """A test leaves torch one thread: with more those after it wait for one another, and a forked process waits for ever."""
    with restored_threads():
        yield
        assert torch.get_num_threads() == 1


@pytest.fixture(scope="session")
def conf() -> Path:
    """Folder of the config files."""
    return ROOT / "conf"


@pytest.fixture(scope="session")
def person_views() -> SourceViews:
    """Front, side and back drawing of a person with a raised left arm, 32 px, B = 1."""
    return helpers.source_views(helpers.person(symmetric=False))


@pytest.fixture(scope="session")
def figure_dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set of analytic figures, 32 px, 8 views each with depth and mesh; read only."""
    root = tmp_path_factory.mktemp("figures") / "dataset"
    helpers.write_figure(root, "lefty", "train", helpers.person(symmetric=False))
    helpers.write_figure(root, "mirror", "train", helpers.person())
    helpers.write_figure(root, "rods", "val", helpers.dumbbell(), views=3)
    helpers.write_figure(root, "twin", "test", helpers.person(), views=3)
    return root
