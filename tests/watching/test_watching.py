"""Runs that are watched: whatever state their files are in, and whoever asks."""

import http.client
import json
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
import torch
import yaml
from torch.utils.tensorboard import SummaryWriter

from charnerf.cli import run as charnerf
from charnerf.errors import DataError
from charnerf.evaluation.scores import METRIC_KEYS
from charnerf.training.run_lock import RunLock
from charnerf.watching.folder import WatchedFolder
from charnerf.watching.history import History, read_history
from charnerf.watching.server import WatchServer
from charnerf.watching.state import Stage, State, find_runs, read_state

PHASES = {
    "by_milliseconds/psnr_foreground/phase_0": (12.0, 14.0),
    "by_milliseconds/psnr_foreground/phase_1": (17.5,),
}


def begin(folder: Path, *, steps: int | None = 100, seconds: float | None = None) -> Path:
    """A run that has begun."""
    folder.mkdir(parents=True, exist_ok=True)
    config = {"name": "run", "seed": 0, "budget": {"steps": steps, "seconds": seconds}}
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    return folder


def train(folder: Path, *, until: int = 40) -> Path:
    """What a run has written after so many steps, twenty of them in ten seconds."""
    with SummaryWriter(str(folder / "tensorboard")) as writer:
        for step in range(20, until + 1, 20):
            for tag, value in {
                "train/loss/total": 1.0 / step,
                "train/seconds": step / 2.0,
                "val/psnr_foreground": 17.5,
            }.items():
                writer.add_scalar(tag, value, step)
        for tag, values in PHASES.items():
            for number, value in enumerate(values):
                writer.add_scalar(tag, value, 1000 * (number + 1) + (5000 if tag.endswith("1") else 0))
        writer.add_scalar("attention/front", 0.75, until)
        writer.add_image("val/target_prediction_error_depth_opacity/0", torch.rand(3, 8, 40), until)
    return folder


def state_of(run: Path) -> State:
    return read_state(run, "run", read_history(run))


def test_what_is_written_is_read(tmp_path):
    history = read_history(train(tmp_path))
    assert history.line("train/loss/total") == ([10.0, 20.0], pytest.approx([1 / 20, 1 / 40]))
    assert history.by_time("by_milliseconds/psnr_foreground/phase_0") == ([1.0, 2.0], [12.0, 14.0])
    assert history.last("val/psnr_foreground") == 17.5 and history.last("nothing") is None
    assert history.pictures["val/target_prediction_error_depth_opacity/0"].content[:4] == b"\x89PNG"
    assert read_history(tmp_path / "none") == History()


@pytest.mark.parametrize("cut", [1, 3, 9, 40])
def test_half_a_record_is_left_for_the_next_time(tmp_path, cut):
    train(tmp_path)
    (file,) = (tmp_path / "tensorboard").iterdir()
    whole = file.read_bytes()
    file.write_bytes(whole[:-cut])
    assert read_history(tmp_path).points["train/loss/total"].keys() == {20, 40}
    file.write_bytes(whole + b"\xff" * 30)
    assert read_history(tmp_path).pictures


def test_a_run_that_trains_is_told_from_one_that_was_killed(tmp_path):
    run = train(begin(tmp_path))
    with RunLock(run) as lock:
        lock.take()
        trains = state_of(run)
    assert (trains.stage, trains.share, trains.steps, trains.left_s) == (
        Stage.TRAINS,
        0.4,
        40,
        pytest.approx(30.0),
    )
    killed = state_of(run)
    assert (killed.stage, killed.left_s) == (Stage.STOPPED, None)


def test_the_lock_of_a_killed_process_is_free(tmp_path):
    """SIGKILL, as the system's out-of-memory killer sends it."""
    run = train(begin(tmp_path))
    code = (
        "import sys; from pathlib import Path; from charnerf.training.run_lock import RunLock\n"
        "lock = RunLock(Path(sys.argv[1])); lock.take(); print('held', flush=True); sys.stdin.read()"
    )
    command = [sys.executable, "-c", code, str(run)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stdout.readline() == b"held\n"
        assert state_of(run).stage is Stage.TRAINS
        process.kill()
    assert state_of(run).stage is Stage.STOPPED


def test_the_stages_of_a_run(tmp_path):
    run = begin(tmp_path, steps=None, seconds=20.0)
    with RunLock(run) as lock:
        lock.take()
        assert state_of(run).stage is Stage.BEGUN
        train(run)
        assert state_of(run).stage is Stage.MEASURES, "the budget is used up"
        (run / "metrics.json").write_text("{}")
    assert state_of(run).stage is Stage.DONE
    (run / "cell.json").write_text(json.dumps({"state": "failed", "error": "NumericalError: <b>inf</b>"}))
    assert (state_of(run).stage, state_of(run).error) == (Stage.FAILED, "NumericalError: <b>inf</b>")
    (run / "cell.json").write_text(json.dumps({"state": "running"}))
    assert state_of(run).stage is Stage.STOPPED, "metrics are those of before"


def test_a_run_that_is_done_tells_all_its_steps_and_seconds(tmp_path):
    """Its metrics know them; what TensorBoard got last is older."""
    run = train(begin(tmp_path, steps=50))
    figures = {**dict.fromkeys(METRIC_KEYS, 0.5), "num_characters": 1, "num_views": 1}
    rest = {"split": "test", "by_azimuth": [], "per_character": {}, "seconds": {"train": 26.5}, "steps": 50}
    (run / "metrics.json").write_text(json.dumps(figures | rest))
    done = state_of(run)
    assert (done.stage, done.steps, done.seconds, done.share) == (Stage.DONE, 50, 26.5, 1.0)
    (run / "cell.json").write_text(json.dumps({"state": "running"}))
    assert (state_of(run).steps, state_of(run).seconds) == (40, 20.0), "metrics are those of before"


@pytest.mark.parametrize(
    "content", ["", "{", "[]", "budget: 3", "budget: {steps: many}", "budget: {steps: .inf}", "\x00"]
)
def test_a_config_that_is_half_written_tells_nothing(tmp_path, content):
    run = train(begin(tmp_path))
    (run / "config.yaml").write_text(content)
    (run / "cell.json").write_text('{"state": "run')
    assert (state_of(run).share, state_of(run).steps) == (None, 40)


def test_runs_are_found(tmp_path):
    with pytest.raises(DataError, match="found no run in it or below it"):
        find_runs(tmp_path)
    for name in ("b", "a", "deep/er"):
        begin(tmp_path / "grid" / name)
    begin(tmp_path / "grid/.jobs/0/.hydra")
    assert [one.relative_to(tmp_path / "grid").as_posix() for one in find_runs(tmp_path / "grid")] == [
        "a",
        "b",
        "deep/er",
    ]
    assert find_runs(tmp_path / "grid/a") == [tmp_path / "grid/a"]


def test_a_page_is_made_anew_where_files_changed_alone(tmp_path):
    run = train(begin(tmp_path / "run"))
    watched = WatchedFolder(run)
    before, page = watched.tag(), watched.page(None, whole=True)
    assert watched.tag() == before
    assert "Stopped before its end" in page and "nobody works on it" in page and "40 steps in 20 s" in page
    (run / "metrics.json").write_text("{}")
    assert watched.tag() != before and "Done: 40 steps" in watched.page(None, whole=False)
    (run / "config.yaml").unlink()
    assert "Can not be read now" in watched.page(None, whole=False)


def test_names_are_no_markup(tmp_path):
    train(begin(tmp_path / "grid" / "<img src=x>ü"))
    train(begin(tmp_path / "grid" / "b"))
    page = WatchedFolder(tmp_path / "grid").page(None, whole=False)
    assert "<img src=x>" not in page and "&lt;img src=x&gt;ü" in page


@pytest.fixture
def server(tmp_path) -> Iterator[WatchServer]:
    train(begin(tmp_path / "grid" / "a ü"))
    train(begin(tmp_path / "grid" / "b"))
    (tmp_path / "grid" / "b" / "report.html").write_text("<p>the report of b</p>")
    (tmp_path / "secret.html").write_text("secret")
    with WatchServer(WatchedFolder(tmp_path / "grid"), 0) as serving:
        thread = threading.Thread(target=serving.serve_forever, args=(0.02,), daemon=True)
        thread.start()
        yield serving
        serving.shutdown()
        thread.join()


def ask(server: WatchServer, path: str, **headers: str) -> tuple[int, str, http.client.HTTPMessage]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_address[1], timeout=20)
    connection.request(
        "GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()}
    )
    answer = connection.getresponse()
    return answer.status, answer.read().decode(), answer.headers


def test_pages_blocks_and_reports_are_served(server):
    status, page, headers = ask(server, "/")
    assert status == 200 and page.startswith("<!doctype html>") and "2 stopped before its end" in page
    assert headers["X-Frame-Options"] == "DENY" and headers["Cache-Control"] == "no-store"
    status, blocks, again = ask(server, "/?blocks")
    assert status == 200 and blocks.startswith("<h1>grid</h1>") and again["ETag"] == headers["ETag"]
    assert ask(server, "/?blocks", If_None_Match=again["ETag"])[:2] == (304, "")
    assert "<h1>a ü</h1>" in ask(server, "/a%20%C3%BC")[1]
    assert ask(server, "/b/report.html")[:2] == (200, "<p>the report of b</p>")


@pytest.mark.parametrize(
    "path",
    [
        "/c",
        "/report.html",
        "/c/report.html",
        "/../secret.html",
        "/%2e%2e/secret.html",
        "/b/../../secret.html",
        "/b/config.yaml",
        "/b%00/report.html",
        "/%ff",
    ],
)
def test_nothing_else_is_served(server, path):
    status, text, _ = ask(server, path)
    assert status == 404 and "secret" not in text


def test_an_address_that_is_none_is_answered(server):
    with socket.create_connection(server.server_address) as connection:
        connection.sendall(b"GET http://[/ HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert connection.makefile("rb").readline().endswith(b"404 Not Found\r\n")


def test_half_a_question_is_not_waited_for(server, monkeypatch):
    monkeypatch.setattr(server.RequestHandlerClass, "timeout", 0.1)
    with socket.create_connection(server.server_address) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\nHost: localh")
        connection.settimeout(5)
        assert connection.recv(1) == b""
    assert ask(server, "/")[0] == 200


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "", "[::1]x"])
def test_a_page_elsewhere_that_took_this_machines_address_gets_nothing(server, host):
    assert ask(server, "/", Host=host)[0] == 403


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1:8000", "LOCALHOST:6007", "[::1]:6007"])
def test_a_tunnel_may_have_another_port(server, host):
    assert ask(server, "/", Host=host)[0] == 200


def test_other_machines_can_not_ask(server):
    assert server.server_address[0] == "127.0.0.1"


def test_once_prints_states(tmp_path, capsys):
    train(begin(tmp_path / "run"))
    assert charnerf(["watch", str(tmp_path / "run"), "--once"]) == 0
    header, line = capsys.readouterr().out.splitlines()
    assert header.split()[:2] == ["run", "stage"] and line.split()[-1] == "17.50"
    assert charnerf(["watch", str(tmp_path / "run"), "--once", "--json", "-", "--quiet"]) == 0
    (one,) = json.loads(capsys.readouterr().out)["details"]["runs"]
    assert (one["stage"], one["steps"], one["share"]) == ("stopped before its end", 40, 0.4)
    assert charnerf(["watch", str(tmp_path / "run"), "--once", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_a_port_that_is_taken_is_told(server, capsys):
    port = str(server.server_address[1])
    assert charnerf(["watch", str(server.watched.folder), "--port", port]) == 1
    assert f"--port {port}: " in capsys.readouterr().err


def test_a_record_of_a_page_is_refused_before_it_is_served(tmp_path, capsys):
    assert charnerf(["watch", str(tmp_path), "--json", "-"]) == 2
    assert "--json: found without --once" in capsys.readouterr().err


@pytest.mark.parametrize(("error", "told"), [(BrokenPipeError(), False), (ZeroDivisionError(), True)])
def test_a_page_that_is_closed_while_it_is_answered_is_no_error(server, capsys, error, told):
    try:
        raise error
    except (OSError, ArithmeticError):
        server.handle_error(None, ("127.0.0.1", 1))
    assert ("Traceback" in capsys.readouterr().err) is told
