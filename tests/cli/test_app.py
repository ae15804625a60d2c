"""`charnerf app`: what is said where the page can not be served."""

import multiprocessing
import socket
import sys

from charnerf.cli import run


def test_a_port_that_is_taken_is_said_before_anything_is_loaded(capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert run(["app", "--port", str(port)]) == 2
    said = capsys.readouterr().err
    assert f"--port {port}: can not be served there" in said and "--port 0" in said and "Loading" not in said
    assert multiprocessing.active_children() == []


def test_without_its_library_it_is_said_what_to_install(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "aiohttp", None)
    assert run(["app"]) == 1
    assert "pip install 'charnerf[app]'" in capsys.readouterr().err


def test_weights_that_can_not_be_read_end_it_with_their_sentence(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr("charnerf.app.studio.process_context", lambda: multiprocessing.get_context("fork"))
    (tmp_path / "broken.safetensors").write_bytes(b"no weights")
    assert run(["app", "--port", "0", "--weights", str(tmp_path / "broken.safetensors")]) == 2
    assert "broken.safetensors" in capsys.readouterr().err
