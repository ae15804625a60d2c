"""A capture that is interrupted leaves nothing half-written, and the same command goes on with it."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import trimesh

from charnerf.capture import dataset
from charnerf.capture.character import CaptureOptions
from charnerf.capture.dataset import capture_dataset
from charnerf.cli.commands import run
from charnerf.data.digest import split_digest, training_digest
from charnerf.data.layout import read_dataset
from charnerf.errors import DataError
from charnerf.interruption import Stopped, listening
from charnerf.wording import counted

TINY = CaptureOptions(views=2, size=16)


@pytest.fixture
def boxes(tmp_path: Path) -> list[Path]:
    (tmp_path / "in").mkdir()
    files = [tmp_path / f"in/{name}.obj" for name in "abcd"]
    for height, file in enumerate(files, start=2):
        trimesh.creation.box((1.0, height, 1.0)).export(file)
    return files


def interrupt_at(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """SIGTERM in the middle of a character."""
    real = dataset.write_character

    def write(root, character, pictures, **more):
        if character == name:
            os.kill(os.getpid(), signal.SIGTERM)
        return real(root, character, pictures, **more)

    monkeypatch.setattr(dataset, "write_character", write)


def test_the_same_capture_goes_on(boxes, tmp_path, monkeypatch):
    root = tmp_path / "set"
    with monkeypatch.context() as patch, pytest.raises(Stopped), listening():
        interrupt_at(patch, "c")
        capture_dataset(boxes, root, "train", options=TINY, processes=1)
    assert read_dataset(root).splits == {"train": ("a", "b")}
    assert [path.name for path in sorted(root.iterdir()) if not path.name.startswith(".capture-")] == [
        "a",
        "b",
        "dataset.json",
    ]
    for other in ({"options": CaptureOptions(views=3, size=16)}, {"split": "test"}, {"seed": 1}):
        call = {"split": "train", "options": TINY, **other}
        with pytest.raises(DataError, match=r"already holds a \(split train\), b \(split train\)"):
            capture_dataset(boxes, root, **call, processes=1)

    before = (root / "a/transforms.json").stat().st_mtime_ns
    report = capture_dataset(boxes, root, "train", options=TINY, processes=1)
    assert (report.skipped, report.captured, report.failed) == (("a", "b"), ("c", "d"), ())
    assert (root / "a/transforms.json").stat().st_mtime_ns == before
    assert sorted(path.name for path in root.iterdir()) == ["a", "b", "c", "d", "dataset.json"]

    capture_dataset(boxes, tmp_path / "straight", "train", options=TINY, processes=1)
    for digest in (split_digest, training_digest):
        assert digest(root, "train") == digest(tmp_path / "straight", "train")
    with pytest.raises(DataError, match="already holds a"):  # it has come to its end
        capture_dataset(boxes, root, "train", options=TINY, processes=1)


def test_what_a_killed_capture_had_not_listed_yet_is_listed(boxes, tmp_path, monkeypatch):
    root = tmp_path / "set"
    with monkeypatch.context() as patch, pytest.raises(SystemExit):
        patch.setattr(
            dataset, "_capture_items", lambda *_, **__: sys.exit(9)
        )  # as kill -9, with the note written
        capture_dataset(boxes, root, "train", options=TINY, processes=1)
    capture_dataset(boxes[:1], tmp_path / "other", "train", options=TINY, processes=1)
    shutil.copytree(tmp_path / "other/a", root / "a")
    report = capture_dataset(boxes, root, "train", options=TINY, processes=1)
    assert report.skipped == ("a",) and read_dataset(root).splits == {"train": ("a", "b", "c", "d")}


def test_a_mesh_that_has_changed_is_another_capture(boxes, tmp_path, monkeypatch):
    root = tmp_path / "set"
    with monkeypatch.context() as patch, pytest.raises(Stopped), listening():
        interrupt_at(patch, "b")
        capture_dataset(boxes, root, "train", options=TINY, processes=1)
    trimesh.creation.box((2.0, 5.0, 1.0)).export(boxes[0])
    with pytest.raises(DataError, match=r"already holds a \(split train\)"):
        capture_dataset(boxes, root, "train", options=TINY, processes=1)


@pytest.mark.parametrize(
    ("number", "status"),
    [
        (signal.SIGTERM, 143),
        pytest.param(signal.SIGINT, 130, marks=pytest.mark.slow),
        pytest.param(signal.SIGKILL, -9, marks=pytest.mark.slow),
    ],
)
def test_the_command_stops_with_its_workers_and_goes_on(boxes, tmp_path, capsys, number, status):
    root = tmp_path / "set"
    for copy in range(20):
        shutil.copy(boxes[0], tmp_path / f"in/box{copy:02d}.obj")
    command = ["capture", str(tmp_path / "in"), "-o", str(root), "--size", "32", "--views", "12"]
    process = subprocess.Popen(
        [sys.executable, "-m", "charnerf", *command, "--jobs", "2"],
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    end = time.monotonic() + 300
    while not (root / "dataset.json").is_file():
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.01)
    if number == signal.SIGKILL:
        process.kill()  # its workers notice
    else:
        os.killpg(process.pid, number)
    _, err = process.communicate(timeout=120)  # until no process has its output open
    assert process.returncode == status, err.decode()
    assert b"Traceback" not in err
    there = {path.name for path in root.iterdir() if path.is_dir()}
    if number != signal.SIGKILL:
        assert there == set(read_dataset(root).splits["train"])
    there = {name for name in there if not name.startswith(".")}
    assert 1 <= len(there) < 24
    assert run([*command, "--jobs", "1"]) == 0  # no process is needed to go on, nor as many
    said = capsys.readouterr().err
    assert f"{counted(len(there), 'character')} skipped: there from the same capture" in said
    assert len(read_dataset(root).splits["train"]) == 24
    assert not [path for path in root.iterdir() if path.name.startswith(".")]
