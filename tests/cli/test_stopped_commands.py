"""`evaluate` and `reconstruct` that are asked to end: their status, and nothing half-written."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from charnerf.capture.generated import generate_dataset

pytestmark = pytest.mark.slow


def stop(command: list[str], *, once: str, number: int) -> tuple[int, str]:
    """Status and standard error of a command that gets a signal after some text has come."""
    process = subprocess.Popen(
        [sys.executable, "-m", "charnerf", *command],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        start_new_session=True,
    )
    assert process.stderr is not None
    os.set_blocking(process.stderr.fileno(), False)
    text, end = "", time.monotonic() + 300
    while once not in text:
        assert process.poll() is None and time.monotonic() < end, text
        text += (process.stderr.read() or b"").decode()
        time.sleep(0.05)
    os.killpg(process.pid, number)
    os.set_blocking(process.stderr.fileno(), True)
    _, rest = process.communicate(timeout=120)
    return process.returncode, text + rest.decode()


def files_of(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_evaluate(tmp_path, number, status):
    generate_dataset(tmp_path / "set", 0, 0, 2, 0, views=40, size=128, processes=1)
    command = ["evaluate", "--data", str(tmp_path / "set"), "--views", "all", "-o", str(tmp_path / "out")]
    code, err = stop(command, once="evaluate test, 0 %", number=number)
    assert code == status, err
    assert f"stopped by {signal.Signals(number).name}." in err and "Traceback" not in err
    assert not (tmp_path / "out/metrics.json").exists()
    for picture in files_of(tmp_path / "out"):
        Image.open(picture).load()


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_reconstruct(tmp_path, number, status):
    figure = np.zeros((128, 128, 4), dtype=np.uint8)
    figure[8:120, 44:84] = (200, 120, 40, 255)
    for view in ("front", "side", "back"):
        Image.fromarray(figure).save(tmp_path / f"{view}.png")
    command = ["reconstruct", *(str(tmp_path / f"{view}.png") for view in ("front", "side", "back"))]
    code, err = stop([*command, "-o", str(tmp_path / "out")], once="reconstruct:", number=number)
    assert code == status, err
    assert f"stopped by {signal.Signals(number).name}." in err and "Traceback" not in err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["back.png", "front.png", "side.png"]
