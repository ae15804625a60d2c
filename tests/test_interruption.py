"""SIGTERM, SIGINT and SIGHUP: the first asks, the second ends at once."""

import os
import signal
import subprocess
import sys
import textwrap
import time

import pytest

from charnerf.cli import run as charnerf
from charnerf.files import write_folder_aside
from charnerf.interruption import Stopped, held, listening, requested


def ask(number: int) -> None:
    os.kill(os.getpid(), number)
    time.sleep(0.01)  # handlers run between two instructions


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130), (signal.SIGHUP, 129)]
)
def test_a_signal_stops_what_runs_and_handlers_are_put_back(number, status):
    before = signal.getsignal(number)
    with pytest.raises(Stopped) as stop, listening():
        ask(number)
    assert stop.value.status == status and str(stop.value) == f"stopped by {signal.Signals(number).name}."
    assert signal.getsignal(number) is before and requested() is None


def test_held_signals_are_answered_when_the_block_ends():
    done = []
    with pytest.raises(Stopped), listening():
        with held():
            with held():
                ask(signal.SIGTERM)
                done.append(requested())
            done.append("inner")
        done.append("never")
    assert done == [signal.SIGTERM, "inner"]


def test_a_closed_terminal_lets_what_is_at_hand_become_whole(tmp_path):
    """What is printed meanwhile would be an error; the shell's own signal comes on top of the system's."""
    pty = pytest.importorskip("pty")
    code = """
        import os, signal, sys, time
        from charnerf.interruption import Stopped, held, listening, requested
        try:
            with listening(), held():
                print("ready", flush=True)
                while requested() is None:
                    time.sleep(0.01)
                os.kill(os.getpid(), signal.SIGHUP)
                time.sleep(0.05)
                print("a line", flush=True)
                open(sys.argv[1], "w").write("whole")
        except Stopped as stop:
            sys.exit(stop.status)
        """
    process, terminal = pty.fork()
    if process == 0:
        os.execv(sys.executable, [sys.executable, "-c", textwrap.dedent(code), str(tmp_path / "file")])
    assert os.read(terminal, 5) == b"ready"
    os.close(terminal)
    _, status = os.waitpid(process, 0)
    assert os.waitstatus_to_exitcode(status) == 129 and (tmp_path / "file").read_text() == "whole"


def test_an_error_of_the_block_comes_first():
    with pytest.raises(ValueError), listening(), held():
        ask(signal.SIGTERM)
        raise ValueError


def test_handlers_of_others_stay():
    mine = signal.signal(signal.SIGTERM, lambda *_: None)
    try:
        with listening():
            ask(signal.SIGTERM)
        assert requested() is None
    finally:
        signal.signal(signal.SIGTERM, mine)


def test_a_folder_is_replaced_whole_or_not_at_all(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out/a").mkdir()
    with pytest.raises(Stopped), listening(), write_folder_aside(tmp_path / "out") as aside:
        (aside / "a").mkdir()
        ask(signal.SIGINT)
    assert [path.name for path in tmp_path.iterdir()] == ["out"] and (tmp_path / "out/a").is_dir()


def test_commands_end_with_the_signals_status(monkeypatch, capsys, tmp_path):
    from charnerf.capture import dataset

    monkeypatch.setattr(dataset, "expand_mesh_paths", lambda *_: ask(signal.SIGTERM))
    (tmp_path / "a.obj").touch()
    assert charnerf(["capture", str(tmp_path / "a.obj"), "-o", str(tmp_path / "set")]) == 143
    assert "stopped by SIGTERM." in capsys.readouterr().err


def test_a_second_signal_ends_at_once():
    code = """
    import time
    from charnerf.interruption import held, listening
    with listening(), held():
        print("ready", flush=True)
        time.sleep(60)
        time.sleep(60)
    """
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code)], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None and process.stderr is not None
    process.stdout.readline()
    process.send_signal(signal.SIGTERM)
    process.stderr.readline()
    assert b"a second signal ends at once" in process.stderr.readline()
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=10) == 130


def test_a_process_of_a_library_ends_with_its_parent():
    """joblib gives its processes a parent without the pipe that tells of its end."""
    child = """
    import os, time
    from multiprocessing import process
    from charnerf.interruption import end_with_parent
    process._parent_process = process._ParentProcess("main", os.getppid(), None)
    end_with_parent()
    print("ready", flush=True)
    time.sleep(60)
    """
    parent = """
    import subprocess, sys
    subprocess.Popen([sys.executable, "-c", sys.argv[1]], stdout=subprocess.PIPE).stdout.readline()
    """
    command = [sys.executable, "-c", textwrap.dedent(parent), textwrap.dedent(child)]
    process = subprocess.run(
        command, check=True, stderr=subprocess.PIPE, timeout=20
    )  # until nobody has it open
    assert b"Traceback" not in process.stderr
