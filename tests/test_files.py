"""A reader of a file sees all of the old one or all of the new one."""

import os
import sys
from pathlib import Path

import pytest

from charnerf.errors import DataError
from charnerf.files import (
    cache_folder,
    check_folder,
    error_words,
    locked,
    write_aside,
    write_bytes,
    write_folder_aside,
    write_text,
)


def test_the_old_file_stands_until_the_new_one_is_whole(tmp_path: Path) -> None:
    file = tmp_path / "new" / "a.txt"
    write_text(file, "old ä")
    with write_aside(file) as aside:
        aside.write_text("new")
        assert aside.parent == file.parent
        assert file.read_text(encoding="utf-8") == "old ä"
    assert file.read_text() == "new"
    assert list(file.parent.iterdir()) == [file]


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    file = tmp_path / "a.bin"
    write_bytes(file, b"old")
    with pytest.raises(RuntimeError), write_aside(file) as aside:
        aside.write_bytes(b"half of the n")
        raise RuntimeError
    assert file.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [file]


def test_no_search_by_suffix_finds_what_is_being_written(tmp_path: Path) -> None:
    with write_aside(tmp_path / "a.png") as aside:
        aside.write_bytes(b"")
        assert not list(tmp_path.glob("*.png"))


def test_permissions_are_those_of_any_new_file(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("")
    write_text(tmp_path / "aside", "")
    assert (tmp_path / "aside").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_folder_appears_at_once_and_later_its_pieces_are_replaced(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "out"
    for content, names in (("old", {"own.txt", "same", "old"}), ("new", {"own.txt", "same", "old", "new"})):
        with write_folder_aside(folder) as aside:
            assert folder.exists() == (content == "new")
            (aside / "same").mkdir()
            (aside / "same" / content).write_text("")
            (aside / content).write_text(content)
        (folder / "own.txt").write_text("the user's")
        assert {path.name for path in folder.iterdir()} == names
        assert [path.name for path in (folder / "same").iterdir()] == [content]
    assert list(folder.parent.iterdir()) == [folder]


def test_a_failure_leaves_the_old_folder_and_nothing_else(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "a").write_text("old")
    with pytest.raises(RuntimeError), write_folder_aside(folder) as aside:
        (aside / "a").write_text("half")
        raise RuntimeError
    assert (folder / "a").read_text() == "old"
    assert list(tmp_path.iterdir()) == [folder]


@pytest.mark.skipif(sys.platform == "win32", reason="no locks between processes there")
@pytest.mark.parametrize("name", ["folder", "file"])
def test_a_lock_keeps_another_process_out_until_it_is_given_up(tmp_path: Path, name: str) -> None:
    import fcntl

    path = tmp_path / name
    if name == "folder":
        path.mkdir()

    def is_free() -> bool:  # as another process sees it: locks belong to the opened file
        handle = os.open(path, os.O_RDONLY)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        finally:
            os.close(handle)
        return True

    with locked(path):
        assert not is_free()
    assert is_free()


def test_a_cache_lies_where_it_is_given_else_in_the_users(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", "/home/me")
    assert cache_folder("~/big") == Path("/home/me/big") and cache_folder("there") == Path("there")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    assert cache_folder() == Path("/home/me/.cache/charnerf")
    monkeypatch.setenv("XDG_CACHE_HOME", "/fast")
    assert cache_folder(None) == Path("/fast/charnerf")


@pytest.mark.parametrize("below", ["", "sub", "sub/sub"])
def test_a_folder_below_a_file_or_a_dead_link_is_refused_before_the_work(tmp_path: Path, below: str) -> None:
    (tmp_path / "file").write_text("mine")
    (tmp_path / "link").symlink_to(tmp_path / "gone")
    for name, found in (("file", "a file"), ("link", "a link to nothing")):
        with pytest.raises(DataError, match=f"{name}: found {found}, expected a folder to write to"):
            check_folder(tmp_path / name / below)
    check_folder(tmp_path / "new" / below)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["file", "link"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no disk that is always full")
@pytest.mark.parametrize("folder", ["", "out"])
def test_a_full_disk_is_named_by_what_is_written(tmp_path: Path, folder: str) -> None:
    """Libraries name no file then; what is beside its place is named by its place."""
    writing = write_folder_aside(tmp_path / folder) if folder else write_aside(tmp_path / "a.bin")
    with pytest.raises(OSError, match="No space") as caught, writing as aside:
        piece = aside / "a.bin" if folder else aside
        piece.symlink_to("/dev/full")
        piece.write_bytes(bytes(10))
    place = tmp_path / folder if folder else tmp_path / "a.bin"
    words = error_words(caught.value)
    assert words.startswith(f"{place}: can not be written to (No space left on device), expected room;")
    assert "the same command again" in words and not list(tmp_path.iterdir())


def test_errors_of_the_system_are_sentences(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="Permission") as caught, write_folder_aside(tmp_path / "out") as aside:
        raise PermissionError(13, "Permission denied", str(aside / "a/b"))
    assert error_words(caught.value).startswith(
        f"{tmp_path}/out/a/b: can not be opened (Permission denied), "
    )
    with pytest.raises(FileNotFoundError) as missing, write_aside(tmp_path / "a"):
        (tmp_path / "b").read_bytes()
    assert error_words(missing.value) == str(missing.value) and str(tmp_path / "b") in str(missing.value)


def test_a_place_that_can_not_be_written_to_is_named_and_not_the_one_aside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a read-only disk the removal of what is not there fails too."""

    def refuse(path: object, *_: object, **__: object) -> None:
        raise OSError(30, "Read-only file system", str(path))

    monkeypatch.setattr(os, "unlink", refuse)
    with pytest.raises(OSError, match="Read-only") as caught, write_aside(tmp_path / "a.txt") as aside:
        refuse(aside)
    assert caught.value.filename == str(tmp_path / "a.txt")
