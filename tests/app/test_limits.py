"""What the server refuses, cleans up and survives."""

import asyncio
import json
import os
import signal
import struct
import zlib

import pytest

from charnerf.app.folder import PREFIX, temporary_folder
from charnerf.app.limits import Limits
from charnerf.app.worker import Refused
from charnerf.errors import DataError
from support.app_server import QUICK, app_server
from support.egg_model import draw_eggs


@pytest.fixture
def work(tmp_path):
    folder = tmp_path / "work"
    folder.mkdir()
    return folder


def bomb(side: int) -> bytes:
    """A small PNG file that says it has side x side pixels, and nothing else."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return (
            struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        )

    header = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(1000)))


def test_what_can_not_be_used_is_a_sentence_and_leaves_nothing(work, tmp_path):
    async def story():
        async with app_server(work, limits=Limits(upload=2000, pixels=10**6, pictures=2)) as (
            studio,
            open_page,
        ):
            page = await open_page()
            session = studio.sessions[page.session]

            async def give(name, content):
                return await page.ask("POST", "pictures", params={"name": name}, data=content)

            async def pieces():
                for _ in range(100):
                    yield bytes(1000)

            for name, content, sentence in (
                ("big.png", bytes(3000), "big.png: found more than"),
                ("endless.png", pieces(), "endless.png: found more than"),
                ("bomb.png", bomb(30_000), "bomb.png: found 30000 x 30000 pixels"),
                ("large.png", bomb(1001), "large.png: found 1001 x 1001 pixels, expected at most 1 million"),
                ("empty.png", b"", "empty.png: found"),
                ("text.png", b"hello", "text.png: found a file that is no picture"),
                ("../../../etc/cron.d/x", b"hello", "x: found a file that is no picture"),
                ("..", b"hello", "drawing: found a file that is no picture"),
                ("\x00\n" + "ü" * 300 + ".png", b"hello", "üü"),
            ):
                status, answer = await give(name, content)
                assert status == 400 and answer["error"].startswith(sentence), (name, answer)
                assert str(tmp_path) not in answer["error"]
            assert (
                session.pictures == [] and [one for one in session.folder.rglob("*") if one.is_file()] == []
            )

    asyncio.run(story())


def test_what_is_broken_is_a_sentence_and_no_fault_of_the_server(work, caplog):
    """Bodies that stop, that are no text, that say other settings; requests that are none of HTTP; a full disk."""

    async def story():
        async with app_server(work, limits=Limits(silence_s=0.3)) as (studio, open_page):
            page = await open_page()
            session, port = studio.sessions[page.session], page.client._base_url.port

            async def raw(line, *headers):
                reader, writer = await asyncio.open_connection("127.0.0.1", port)
                writer.write("\r\n".join([f"{line} HTTP/1.1", *headers, "", "{}"]).encode())
                answer = await asyncio.wait_for(reader.read(2000), 5)
                writer.close()
                return answer.decode()

            own = f"Host: localhost:{port}", f"Origin: http://localhost:{port}"
            for path in ("pictures?name=half.png", "build"):
                post = f"POST /sessions/{page.session}/{path}"
                assert "nothing more for 0.3 seconds" in await raw(post, *own, "Content-Length: 100")
                zipped = await raw(post, *own, "Content-Length: 2", "Content-Encoding: gzip")
                assert zipped.startswith("HTTP/1.1 400") and "found a body that can not be read" in zipped
            for kind in ("utf-99", "rot13"):
                text = f"Content-Type: application/json; charset={kind}"
                assert (await raw(post, *own, "Content-Length: 2", text)).startswith("HTTP/1.1 400")
            assert (await raw("GET /")).startswith("HTTP/1.0 400")
            assert (await raw("GET http://[/", *own)).startswith("HTTP/1.0 400")
            for reading in ([1], 1, "x"):
                status, answer = await page.ask("POST", "figures", json={"reading": reading})
                assert status == 400 and answer["error"].startswith("settings: found")

            def on_a_full_disk(*_):
                (session.folder / "9").mkdir()
                (session.folder / "9/a.png").symlink_to("/dev/full")
                return session.folder / "9/a.png"

            studio.reader.new_picture = on_a_full_disk
            status, answer = await page.ask("POST", "pictures", data=bytes(10**5))
            assert status == 507 and answer["error"].startswith("This machine can not keep it (No space left")
            assert session.pictures == [] and not list(session.folder.rglob("*"))

    asyncio.run(story())
    assert not caplog.records


def test_nobody_reaches_what_he_was_not_told_of(work, tmp_path):
    (tmp_path / "secret").write_text("secret")

    async def story():
        async with app_server(work) as (studio, open_page):
            page, other = await open_page(), await open_page()
            assert len(page.session) >= 32 and page.session != other.session
            for path in (
                "pictures/1",
                "figures/1",
                "made/made1/mesh.glb",
                "made/..%2f../secret",
                "read/../../secret",
                "pictures/%D9%A1",
            ):
                assert (await page.ask("GET", path))[0] == 404, path
            assert (await page.ask("GET", "look?azimuth=nan&elevation=0&size=64"))[0] == 400
            assert (await page.ask("GET", "look?azimuth=0&elevation=0&size=99999"))[0] == 400
            assert (await page.ask("POST", "figures", data=b"[" * 60_000))[0] == 400
            assert (
                await page.ask(
                    "POST", "figures", json={"figures": {"1": {"view": "sideways", "mirrored": True}}}
                )
            )[0] == 400
            assert (await page.ask("POST", "figures", data=json.dumps({"x": "y" * 10**5})))[0] == 413
            assert (await page.ask("POST", "build", json={"faces": 10**9}))[0] == 400
            page.session = "nobody's"
            status, answer = await page.ask("POST", "cancel")
            assert status == 404 and "Load the page again" in answer["error"]
            async with page.client.get("/", headers={"Host": "evil.example"}) as answer:
                assert answer.status == 403
            async with page.client.post("/sessions", headers={"Origin": "http://evil.example"}) as answer:
                assert answer.status == 403
            assert len(studio.sessions) == 2

    asyncio.run(story())


def test_a_session_without_its_page_is_forgotten_and_the_next_has_room(work):
    async def story():
        async with app_server(work, limits=Limits(sessions=1, grace_s=0.05, keep_s=0.1)) as (
            studio,
            open_page,
        ):
            page = await open_page()
            with pytest.raises(DataError, match="as many as there may be"):
                studio.open()
            page.close()
            while studio.sessions:
                await asyncio.sleep(0.02)
            assert list(work.iterdir()) == []
            await open_page()

    asyncio.run(story())


def test_a_process_that_the_system_kills_is_a_sentence_and_the_next_job_is_made(work, tmp_path):
    async def story():
        async with app_server(work) as (studio, open_page):
            page = await open_page()
            studio.reader.worker = None
            await page.give(*draw_eggs(tmp_path).values())
            await page.read()
            os.kill(studio.reader.worker.process.pid, signal.SIGKILL)
            with pytest.raises(Refused, match="ended before it was done"):
                await studio.reader._ask("ready")
            assert await studio.reader._ask("ready") == 64
            await page.ask("POST", "build", json={**QUICK, "frames": 120, "size": 512})
            await page.wait(lambda state: state["job"]["state"] == "running" and "share" in state["job"])
            os.kill(studio.queue.running.worker.process.pid, signal.SIGKILL)
            assert "the memory was full" in (await page.finished())["job"]["problem"]
            assert not list(studio.sessions[page.session].folder.glob("*made*"))

    asyncio.run(story())


def test_the_folder_of_a_server_that_was_killed_goes_with_the_next(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / f"{PREFIX}dead").mkdir()
    (tmp_path / f"{PREFIX}dead" / "lock").touch()
    with temporary_folder() as mine:
        with temporary_folder() as other:
            assert sorted(tmp_path.iterdir()) == sorted((mine, other))
            assert mine.stat().st_mode & 0o077 == 0
    assert list(tmp_path.iterdir()) == []
