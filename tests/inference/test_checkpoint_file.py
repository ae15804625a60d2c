"""A checkpoint is there whole or not at all, and a changed byte is noticed."""

import os
import tempfile
from pathlib import Path

import pytest
import torch

from charnerf import files
from charnerf.errors import DataError
from charnerf.inference.checkpoint_file import read_checkpoint, write_checkpoint

CONTENT = {"state_dict": {"weight": torch.arange(100.0)}, "global_step": 3}


@pytest.fixture
def checkpoint(tmp_path: Path) -> Path:
    file = tmp_path / "run/checkpoints/last.ckpt"
    write_checkpoint(file, CONTENT)
    return file


def test_what_was_written_is_read_by_us_and_by_torch(checkpoint: Path) -> None:
    for content in (read_checkpoint(checkpoint), torch.load(checkpoint, weights_only=True)):
        assert content["global_step"] == 3
        assert torch.equal(content["state_dict"]["weight"], torch.arange(100.0))


def test_every_flipped_bit_and_every_cut_is_noticed(checkpoint: Path) -> None:
    raw = checkpoint.read_bytes()
    for place in range(0, len(raw), 7):
        checkpoint.write_bytes(raw[:place] + bytes([raw[place] ^ 1]) + raw[place + 1 :])
        with pytest.raises(DataError, match=r"last\.ckpt: can not be read as a checkpoint"):
            read_checkpoint(checkpoint)
    for size in (0, 1, len(raw) // 2, len(raw) - 1):
        checkpoint.write_bytes(raw[:size])
        with pytest.raises(DataError, match=r"last\.ckpt: can not be read as a checkpoint"):
            read_checkpoint(checkpoint)


def test_one_without_a_checksum_is_read_only_where_that_is_allowed(tmp_path: Path) -> None:
    torch.save(CONTENT, tmp_path / "bare.ckpt")
    with pytest.raises(DataError, match="it has no checksum"):
        read_checkpoint(tmp_path / "bare.ckpt")
    assert read_checkpoint(tmp_path / "bare.ckpt", sealed=False)["global_step"] == 3


@pytest.mark.parametrize(
    "error", [OSError(28, "No space left on device"), PermissionError(13, "Permission denied")]
)
def test_a_disk_that_takes_nothing_is_one_message_and_loses_nothing(
    checkpoint: Path, monkeypatch: pytest.MonkeyPatch, error: OSError
) -> None:
    before = checkpoint.read_bytes()

    def refuse(handle: int) -> None:
        raise error

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(
        DataError, match=rf"last\.ckpt: the checkpoint can not be written \({error.strerror}\)"
    ):
        write_checkpoint(checkpoint, CONTENT)
    assert checkpoint.read_bytes() == before
    assert [file.name for file in checkpoint.parent.iterdir()] == ["last.ckpt"]


@pytest.mark.skipif(not Path("/sys/kernel").is_dir(), reason="needs a folder that refuses everybody")
def test_a_folder_that_refuses_even_the_superuser(tmp_path: Path) -> None:
    (tmp_path / "checkpoints").symlink_to("/sys/kernel")
    with pytest.raises(DataError, match=r"last\.ckpt: the checkpoint can not be written"):
        write_checkpoint(tmp_path / "checkpoints/last.ckpt", CONTENT)


def test_it_is_synced_before_it_is_renamed_and_never_leaves_its_file_system(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []
    monkeypatch.setattr(tempfile, "tempdir", "/nonexistent")  # $TMPDIR
    fsync, replace = os.fsync, os.replace
    monkeypatch.setattr(os, "fsync", lambda handle: (done.append("sync"), fsync(handle)))
    monkeypatch.setattr(
        files.os,
        "replace",
        lambda source, target: (
            done.append(f"rename in {Path(source).parent == Path(target).parent}"),
            replace(source, target),
        ),
    )
    write_checkpoint(tmp_path / "last.ckpt", CONTENT)
    assert done == ["sync", "rename in True", "sync"]


def test_the_one_before_is_kept(checkpoint: Path) -> None:
    write_checkpoint(checkpoint, {"global_step": 4}, keep=checkpoint.with_name("previous.ckpt"))
    assert read_checkpoint(checkpoint)["global_step"] == 4
    assert read_checkpoint(checkpoint.with_name("previous.ckpt"))["global_step"] == 3
