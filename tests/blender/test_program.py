"""What becomes of a Blender that is not there, refuses, crashes, hangs, or whose caller is killed; no Blender is needed."""

import os
import signal
import subprocess
import sys
import time

import pytest

from charnerf.blender import program
from charnerf.blender.program import find_blender, run_job
from charnerf.errors import DataError, DependencyError


def job_of(monkeypatch, code):
    """A program in Blender's place."""
    monkeypatch.setattr(program, "find_blender", lambda suffix: [sys.executable, "-c", code])


def test_without_blender_the_next_step_is_told(monkeypatch):
    monkeypatch.setattr(program, "find_spec", lambda name: None)
    monkeypatch.setattr(program.shutil, "which", lambda name: None)
    with pytest.raises(DependencyError, match=r"pip install 'charnerf\[blender\]'"):
        find_blender()


def test_the_wheel_is_taken_before_the_program_but_for_collada(monkeypatch):
    monkeypatch.setattr(program, "find_spec", lambda name: object())
    monkeypatch.setattr(program.shutil, "which", lambda name: "/bin/blender")
    assert find_blender(".fbx")[0] == sys.executable
    assert find_blender(".dae")[0] == "/bin/blender"
    monkeypatch.setattr(program.shutil, "which", lambda name: None)
    assert find_blender(".dae")[0] == sys.executable


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("import os; os.kill(os.getpid(), 11)", "crashed .signal 11"),
        ("print('no such node'); raise SystemExit(3)", "(?s)failed .status 3.*no such node"),
        ("import time; time.sleep(60)", "was not done after 1 s"),
        (
            "import sys, pathlib; pathlib.Path(sys.argv[1]).with_name('answer.json').write_text('{\"error\": \"is a tree\"}')",
            "^hero.fbx: is a tree[.]$",
        ),
    ],
)
def test_a_job_that_fails_is_one_error_with_its_file(tmp_path, monkeypatch, code, message):
    job_of(monkeypatch, code)
    with pytest.raises(DataError, match=message) as caught:
        run_job(tmp_path, {"do": "read"}, where="hero.fbx", limit_s=1.0 if "sleep" in code else 60.0)
    assert str(caught.value).startswith("hero.fbx: ")


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's death signal is Linux's")
def test_blender_ends_with_its_caller(tmp_path):
    """Even if that is killed."""
    child = (
        "import os, time; from charnerf.blender.inside.ending import end_with_parent;"
        "end_with_parent(os.getppid()); print(os.getpid(), flush=True); time.sleep(60)"
    )
    parent = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}])"
    with subprocess.Popen([sys.executable, "-c", parent], stdout=subprocess.PIPE, text=True) as caller:
        blender = int(caller.stdout.readline())
        caller.send_signal(signal.SIGKILL)
        for _ in range(200):
            try:
                os.kill(blender, 0)
            except ProcessLookupError:
                return
            if f"{blender} (python" in _state(blender) and ") Z" in _state(blender):
                return  # ended; nobody has asked for its status
            time.sleep(0.05)
    pytest.fail("it goes on")


def _state(process):
    try:
        with open(f"/proc/{process}/stat") as file:
            return file.read()
    except OSError:
        return ""
