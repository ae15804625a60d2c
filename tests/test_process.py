"""Settings of the process: what doors change, and that the library changes none."""

import multiprocessing
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
import torch

from charnerf import process
from charnerf.config.composition import compose_config
from charnerf.inference.build import build_model
from charnerf.inference.weights import save_weights
from charnerf.process import use_fastest_products


@pytest.fixture(autouse=True)
def _as_before() -> Iterator[None]:
    before = torch.get_float32_matmul_precision()
    torch.set_float32_matmul_precision("highest")
    use_fastest_products.cache_clear()
    yield
    torch.set_float32_matmul_precision(before)
    use_fastest_products.cache_clear()


def test_products_keep_their_digits() -> None:
    use_fastest_products()
    for rows, inner, columns in ((1000, 64, 64), (64, 3000, 64), (700, 42, 128), (17, 5, 3)):
        first, second = torch.randn(rows, inner), torch.randn(inner, columns)
        exact = first.double() @ second.double()
        size = first.double().abs() @ second.double().abs()
        assert float(((first @ second - exact).abs() / size).max()) < 1e-5


def test_the_switch_is_taken_back_where_digits_are_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process, "FLOAT32_ERROR", 0.0)
    assert not use_fastest_products()
    assert torch.get_float32_matmul_precision() == "highest"


def test_a_choice_of_the_user_is_left_alone() -> None:
    torch.set_float32_matmul_precision("high")
    assert not use_fastest_products()
    assert torch.get_float32_matmul_precision() == "high"


LIBRARY = """
import os
environment = dict(os.environ)
import charnerf
assert dict(os.environ) == environment
import torch

def settings():
    mkldnn = torch.backends.mkldnn
    return (
        dict(os.environ), torch.get_num_threads(), torch.get_num_interop_threads(), torch.get_default_dtype(),
        torch.get_float32_matmul_precision(), mkldnn.enabled, mkldnn.deterministic, mkldnn.allow_tf32, torch.is_grad_enabled(),
        torch.are_deterministic_algorithms_enabled(), torch.get_rng_state().tolist(),
    )

before = settings()
charnerf.load("weights.safetensors")
assert settings() == before
"""


def test_importing_and_loading_change_nothing_of_the_process(tmp_path: Path) -> None:
    cfg = compose_config(["scale=smoke"])
    save_weights(tmp_path / "weights.safetensors", build_model(cfg), cfg)
    subprocess.run([sys.executable, "-c", LIBRARY], check=True, cwd=tmp_path)


def test_threads_do_not_spin_for_long_unless_the_user_says_so() -> None:
    """Set before torch is loaded, which is when OpenMP reads it."""
    code = (
        "import os, sys; from charnerf.process import limit_spinning;"
        " limit_spinning(); print('torch' in sys.modules, os.environ['GOMP_SPINCOUNT'])"
    )
    for given, expected in (({}, "20000"), ({"GOMP_SPINCOUNT": "7"}, "7")):
        environment = {name: value for name, value in os.environ.items() if name != "GOMP_SPINCOUNT"} | given
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment
        )
        assert done.stdout.split() == ["False", expected]


def test_what_a_thread_can_not_write_is_left_to_its_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[type[BaseException]] = []
    monkeypatch.setattr(threading, "excepthook", lambda failure: seen.append(failure.exc_type))
    process.leave_disk_errors_to_callers()

    def fail(error: Exception) -> None:
        raise error

    for error in (OSError(28, "No space left on device"), ValueError()):
        thread = threading.Thread(target=fail, args=(error,))
        thread.start()
        thread.join()
    assert seen == [ValueError]


def test_processes_start_as_usual_whatever_a_launcher_has_set() -> None:
    usual = multiprocessing.get_start_method()
    multiprocessing.set_start_method("spawn", force=True)
    process.start_processes_as_usual()
    assert multiprocessing.get_start_method() == usual
