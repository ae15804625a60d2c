"""Data sets in shards: the same characters, a bounded cache, nothing of strangers beside it."""

import functools
import http.server
import io
import json
import shutil
import tarfile
import threading
from pathlib import Path

import pytest
import torch

from charnerf.cli import run
from charnerf.data.characters import load_character
from charnerf.data.digest import training_digest
from charnerf.data.layout import read_dataset
from charnerf.data.packing import pack
from charnerf.data.shards import CACHE_FILE, INDEX_FILE, read_index, read_index_once
from charnerf.data.shards_data import ShardsData
from charnerf.data.store import CharacterStore
from charnerf.errors import ConfigError, DataError
from support import helpers

pytest.importorskip("webdataset")
NAMES = ("ann", "bob", "cat", "dan")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set of four small characters; read only."""
    root = tmp_path_factory.mktemp("set") / "data"
    for name in NAMES:
        helpers.write_figure(root, name, "train", helpers.person(), views=1)
    helpers.write_figure(root, "eve", "val", helpers.ball(), views=1)
    return root


@pytest.fixture(scope="module")
def shards(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same in shards of one character each; read only."""
    output = tmp_path_factory.mktemp("packed") / "shards"
    pack(folder, output, shard_mib=1e-6, packed=lambda _: None)
    return output


def data(root: object, cache: Path, *, mib: float = 100.0) -> ShardsData:
    return ShardsData(root=str(root), cache=str(cache), cache_mib=mib)


def test_characters_are_the_same(folder: Path, shards: Path, tmp_path: Path) -> None:
    source = data(shards, tmp_path)
    source.check_image_size(helpers.SIZE)
    source.check_splits(train=["train"], val="val", test="val")
    root = source.prepare()
    assert read_dataset(root).splits == read_dataset(folder).splits
    assert training_digest(root, "train") == training_digest(folder, "train")
    for name in (*NAMES, "eve"):
        there, here = load_character(folder, name), load_character(root, name)
        assert torch.equal(there.images([0]), here.images([0])) and torch.equal(
            there.depths([0]), here.depths([0])
        )
        assert torch.equal(there.sources.images, here.sources.images)
        assert here.mesh_file is not None and there.mesh_file is not None
        assert here.mesh_file.read_bytes() == there.mesh_file.read_bytes()


def test_what_was_unused_the_longest_goes(shards: Path, tmp_path: Path) -> None:
    index = read_index(shards / INDEX_FILE)
    largest = max(shard.size for shard in index.shards)
    root = data(shards, tmp_path, mib=2.5 * largest / 2**20).prepare()
    store = CharacterStore(root=root, names=NAMES, carve=lambda _: None, memory_mib=100.0)
    assert store.has_mesh("dan")  # without fetching it
    for name in ("ann", "bob", "ann", "cat"):
        load_character(root, name)
    assert sorted(one for one in NAMES if (root / one).is_dir()) == ["ann", "cat"]
    load_character(root, "bob")
    assert sum((root / one).is_dir() for one in NAMES) <= 2


def test_packing_twice_gives_the_same_bytes(folder: Path, shards: Path, tmp_path: Path) -> None:
    pack(folder, tmp_path / "again", shard_mib=1e-6, packed=lambda _: None)
    for file in shards.iterdir():
        assert file.read_bytes() == (tmp_path / "again" / file.name).read_bytes()
    with pytest.raises(DataError, match="is not empty"):
        pack(folder, tmp_path / "again", shard_mib=1.0, packed=lambda _: None)
    assert run(["pack", "--data", str(folder), "-o", str(tmp_path / "one"), "--shard-mib", "64"]) == 0
    assert [file.name for file in sorted((tmp_path / "one").iterdir())] == [
        "000000.tar",
        "000001.tar",
        "index.json",
    ]


def test_over_http(shards: Path, tmp_path: Path) -> None:
    pytest.importorskip("aiohttp")
    handler = functools.partial(_Quiet, directory=str(shards))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}"
        root = data(address, tmp_path).prepare()
        assert load_character(root, "cat").source_names == ("front", "side", "back")
        with pytest.raises(DataError, match=r"elsewhere/index\.json: can not be fetched"):
            data(f"{address}/elsewhere", tmp_path).prepare()
        server.shutdown()


@pytest.mark.slow
def test_over_s3(shards: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A server of its own that speaks S3: pip install 'moto[server]' s3fs."""
    server_module = pytest.importorskip("moto.server")
    s3fs = pytest.importorskip("s3fs")
    server = server_module.ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    server.start()
    try:
        host, port = server.get_host_and_port()
        for name, value in {
            "AWS_ENDPOINT_URL": f"http://{host}:{port}",
            "AWS_ACCESS_KEY_ID": "anybody",
            "AWS_SECRET_ACCESS_KEY": "anything",
            "AWS_DEFAULT_REGION": "us-east-1",
        }.items():
            monkeypatch.setenv(name, value)
        bucket = s3fs.S3FileSystem(skip_instance_cache=True)
        bucket.mkdir("characters")
        bucket.put(str(shards), "characters/packed", recursive=True)
        root = data("s3://characters/packed", tmp_path).prepare()
        assert load_character(root, "cat").source_names == ("front", "side", "back")
        with pytest.raises(DataError, match=r"s3://characters/elsewhere/index\.json: can not be fetched"):
            data("s3://characters/elsewhere", tmp_path).prepare()
    finally:
        server.stop()


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        """Say nothing."""


def changed(shards: Path, tmp_path: Path, content: bytes) -> Path:
    """Shards whose first one has another content, which the index is in keeping with."""
    import hashlib

    copy = Path(shutil.copytree(shards, tmp_path / "changed"))
    index = json.loads((copy / INDEX_FILE).read_text())
    first = index["shards"][0]
    (copy / first["file"]).write_bytes(content)
    first.update(size=len(content), sha256=hashlib.sha256(content).hexdigest())
    (copy / INDEX_FILE).write_text(json.dumps(index))
    return copy


def archive(*names: str) -> bytes:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=tarfile.USTAR_FORMAT) as tar:
        for name in names:
            member = tarfile.TarInfo(name)
            member.size = 3
            tar.addfile(member, io.BytesIO(b"abc"))
    return buffer.getvalue()


def sparse_archive() -> bytes:
    """A file of a terabyte of nothing, in some bytes."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=tarfile.PAX_FORMAT) as tar:
        member = tarfile.TarInfo("000000.a")
        gaps = {"major": "1", "minor": "0", "name": "000000.a", "realsize": str(10**12)}
        member.pax_headers = {f"GNU.sparse.{key}": value for key, value in gaps.items()}
        body = b"1\n999999999990\n3\n".ljust(512, b"\0") + b"abc"
        member.size = len(body)
        tar.addfile(member, io.BytesIO(body))
    return buffer.getvalue()


def linked_archive() -> bytes:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=tarfile.USTAR_FORMAT) as tar:
        member = tarfile.TarInfo("000000.a")
        member.type, member.linkname = tarfile.SYMTYPE, "/etc/passwd"
        tar.addfile(member)
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (archive("000000.%2Fetc%2Fx"), "leads out"),
        (archive("000000.a", "000000.a%2Fb"), "as a file and as a folder"),
        (archive("000000.a%2Fb", "000000.a"), "as a file and as a folder"),
        (sparse_archive(), "which is no plain file"),
        (linked_archive(), "which is no plain file"),
        (archive("000000...%2F..%2F..%2Fx"), "leads out"),
        (b"no tar file", "found no plain tar file"),
        (archive("000000.a")[:700], "can not be read"),
    ],
)
def test_shards_of_strangers_write_nothing_beside(
    content: bytes, message: str, shards: Path, tmp_path: Path
) -> None:
    root = data(changed(shards, tmp_path, content), tmp_path / "cache").prepare()
    first = read_index_once(root).shards[0].names[0]
    before = {file for file in tmp_path.rglob("*") if root not in file.parents}
    with pytest.raises(DataError, match=message):
        load_character(root, first)
    assert {file for file in tmp_path.rglob("*") if root not in file.parents} == before
    assert not list(root.glob(".partial-*")) and not (root / first).exists()


def test_what_does_not_fit_is_named(shards: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(shards, tmp_path / "copy"))
    index = json.loads((copy / INDEX_FILE).read_text())
    (copy / index["shards"][0]["file"]).write_bytes(b"x" * 10)
    root = data(copy, tmp_path / "cache").prepare()
    with pytest.raises(DataError, match=r"other bytes than index\.json says"):
        load_character(root, index["shards"][0]["names"][0])
    index["shards"][0]["file"] = "../x.tar"
    (copy / INDEX_FILE).write_text(json.dumps(index))
    with pytest.raises(DataError, match="expected letters, digits"):
        data(copy, tmp_path / "cache").prepare()
    with pytest.raises(DataError, match="can not be fetched"):
        data(tmp_path / "nothing", tmp_path / "cache").prepare()
    with pytest.raises(DataError, match="depth is read at every step"):
        data(shards, tmp_path / "cache").prepare(depth=True)
    with pytest.raises(ConfigError, match=r"scale\.image_size: found 64"):
        data(shards, tmp_path / "cache").check_image_size(64)
    assert (root / CACHE_FILE).is_file()
