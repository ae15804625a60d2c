"""Files of every reader, changed at random: each is read, or refused by an error of ours. CHARNERF_FUZZ says how many of each.

CHARNERF_FUZZ_TABLE names a CSV file, which gets the longest time and the most memory that one of them took.
"""

import base64
import csv
import gzip
import json
import os
import shutil
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors.torch import save

import charnerf
from charnerf.capture.meshes import load_scene
from charnerf.config.foreign import read_yaml
from charnerf.config.search_space import Choice, SearchSpace
from charnerf.data.characters import load_character
from charnerf.data.shards import INDEX_FILE, read_index, read_index_once
from charnerf.data.shards_data import ShardsData
from charnerf.errors import CharNeRFError
from charnerf.foreign.convert import converted
from charnerf.foreign.kept import recognised
from charnerf.foreign.reading import Reading
from charnerf.inference.baked_file import load_baked
from charnerf.inference.checkpoint_file import read_checkpoint, write_checkpoint
from charnerf.reporting.run_files import read_curve, read_metrics
from charnerf.training.search import JOURNAL, Search
from support import foreign_sets as sets
from support import helpers

MOST_MIB = 2048.0  # that a file of some kB may make a reader take
STATUS = Path("/proc/self/status")
TIMES = int(os.environ.get("CHARNERF_FUZZ", "3"))
WORDS = [
    *(
        b"NaN",
        b"Infinity",
        b"-1",
        b"1e400",
        b"null",
        b"[]",
        b"{}",
        b"true",
        b"../../etc",
        b"/etc/passwd",
        b"\\ud800",
        b"\0",
    ),
    *(
        b"9" * 30,
        b"9" * 5000,
        b"[" * 3000,
        b'{"a":' * 3000,
        b"\xff\xfe",
        b",",
        b'"',
        b"1000000000000",
        b"<script>",
        b"${oc.env:HOME}",
    ),
]
Change = tuple[str, float, int, bytes]
CHANGES = st.lists(
    st.tuples(
        st.sampled_from(["flip", "cut", "put", "over", "again"]),
        st.floats(0.0, 1.0, exclude_max=True),
        st.integers(1, 255),
        st.sampled_from(WORDS),
    ),
    min_size=1,
    max_size=4,
)


def changed(content: bytes, changes: list[Change]) -> bytes:
    """Bits flipped, an end cut off, words put in or over others, a stretch repeated."""
    for kind, share, number, word in changes:
        at = int(share * len(content))
        if kind == "flip" and content:
            content = content[:at] + bytes([content[at] ^ number]) + content[at + 1 :]
        elif kind == "cut":
            content = content[:at]
        elif kind == "put":
            content = content[:at] + word + content[at:]
        elif kind == "over":
            content = content[:at] + word + content[at + len(word) :]
        elif kind == "again":
            content = content[:at] + content[at : at + number] * number + content[at:]
    return content


def foreign(folder: Path) -> None:
    form, found = recognised(folder)
    for one in found:
        converted(form.shots(one), form.up, Reading(size=sets.SIZE))


def shards(folder: Path) -> None:
    root = ShardsData(root=str(folder), cache=str(folder / "cache"), cache_mib=10.0).prepare()
    for shard in read_index_once(root).shards:
        load_character(root, shard.names[0])


def search(folder: Path) -> None:
    pytest.importorskip("optuna")
    one = Search(folder, SearchSpace((), {"width": Choice(("1", "2"))}), seconds="encode", seed=0)
    one.front()


READERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "transforms.json": ("nerfstudio/transforms.json", foreign),
    "npz": ("nmr/cameras.npz", foreign),
    "srn": ("srn/intrinsics.txt", foreign),
    "pose": ("srn/pose/000003.txt", foreign),
    "co3d": ("co3d/frame_annotations.json", foreign),
    "picture": ("nerfstudio/images/frame_00002.png", foreign),
    "mask": ("nerfstudio/masks/frame_00002.png", foreign),
    "ours": ("ours/twin/transforms.json", lambda folder: load_character(folder, "twin")),
    "index": (f"shards/{INDEX_FILE}", lambda folder: read_index(folder / INDEX_FILE)),
    "shard": ("shards/000000.tar", shards),
    "search": (f"search/{JOURNAL}", search),
    "baked": (
        "baked/x.safetensors",
        lambda folder: load_baked(folder / "x.safetensors").render(azimuth_deg=30.0, size=8),
    ),
    "weights": ("weights/x.safetensors", lambda folder: charnerf.load(folder / "x.safetensors")),
    "checkpoint": ("ckpt/x.ckpt", lambda folder: read_checkpoint(folder / "x.ckpt", sealed=False)),
    "config": ("run/config.yaml", lambda folder: read_yaml(folder / "config.yaml")),
    "metrics": ("run/metrics.json", lambda folder: read_metrics(folder / "metrics.json")),
    "curve": ("run/curve.csv", lambda folder: read_curve(folder / "curve.csv")),
    "gltf": ("mesh/x.gltf", lambda folder: load_scene(folder / "x.gltf")),
    "obj": ("mesh/x.obj", lambda folder: load_scene(folder / "x.obj")),
    "ply": ("mesh/x.ply", lambda folder: load_scene(folder / "x.ply")),
}


def memory_mib(key: str) -> float:
    """Resident memory of this process now (VmRSS), or its peak since `forget_peak` (VmHWM); 0 where no system says."""
    if not STATUS.is_file():
        return 0.0
    return next(float(line.split()[1]) / 1024 for line in STATUS.read_text().splitlines() if key in line)


def forget_peak() -> None:
    if STATUS.is_file():
        (STATUS.parent / "clear_refs").write_text("5")


@pytest.fixture(scope="module")
def table() -> Iterator[list[dict[str, object]]]:
    """Rows of what each kind took; written where a file is named."""
    rows: list[dict[str, object]] = []
    yield rows
    if "CHARNERF_FUZZ_TABLE" in os.environ and rows:
        rows.append(
            {
                "file": "all",
                "inputs": sum(row["inputs"] for row in rows),
                **{key: max(row[key] for row in rows) for key in ("longest seconds", "most MiB")},
            }
        )
        with open(os.environ["CHARNERF_FUZZ_TABLE"], "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a file of each kind; read only."""
    root = tmp_path_factory.mktemp("whole")
    cameras = sets.around()
    pictures = sets.pictures(cameras)
    for name, write in (
        ("nerfstudio", sets.write_nerfstudio),
        ("srn", sets.write_srn),
        ("nmr", sets.write_nmr),
        ("co3d", sets.write_co3d),
    ):
        write(root / name, cameras, pictures)
    packed = root / "co3d/frame_annotations.jgz"
    (root / "co3d/frame_annotations.json").write_bytes(gzip.decompress(packed.read_bytes()))
    packed.unlink()
    helpers.write_figure(root / "ours", "twin", "train", helpers.person(), views=1)
    _write_shards(root)
    _write_tensors(root)
    _write_texts(root)
    return root


def _write_shards(root: Path) -> None:
    pytest.importorskip("webdataset")
    from charnerf.data.packing import pack

    pack(root / "ours", root / "shards", shard_mib=1.0, packed=lambda _: None)


def _write_tensors(root: Path) -> None:
    for name in ("baked", "weights", "ckpt"):
        (root / name).mkdir()
    metadata = {
        "format": "charnerf-baked-2",
        "baked": json.dumps({"pitch": 1.0, "factor": 2, "tolerance": 0.0, "radius": 1.0, "head": "blend"}),
    }
    views = {
        "poses": torch.eye(4).expand(1, 3, 4, 4),
        "focal": torch.ones(1, 3, 2),
        "principal_point": torch.ones(1, 3, 2),
        "orthographic": torch.ones(1, 3, dtype=torch.bool),
    }
    tensors = {f"views.{key}": one for key, one in views.items()} | {
        f"drawn.{key}": one[0] for key, one in views.items()
    }
    tensors |= {
        "views.images": torch.zeros(1, 3, 4, 8, 8),
        "views.present": torch.ones(1, 3, dtype=torch.bool),
        "views.mirrored": torch.zeros(1, 3, dtype=torch.bool),
    }
    tensors |= {
        "drawn.encoded": torch.zeros(3, 3, 8, 8),
        "grid.low": -torch.ones(3),
        "grid.high": torch.ones(3),
        "grid.origin": -torch.ones(3),
    }
    tensors |= {
        "grid.u": torch.zeros(5, 5, 5),
        "grid.kept": torch.ones(5, 5, 5, dtype=torch.float16),
        "grid.errors": torch.zeros(2, 2, 2),
        "grid.color_index": torch.zeros(3, 3, 3, dtype=torch.int32),
    }
    tensors |= {
        "grid.color_rows": torch.zeros(2, 9 * 7 + 1),
        "grid.gaps": torch.zeros(2, 2, 2, dtype=torch.uint8),
    }
    (root / "baked/x.safetensors").write_bytes(
        save({key: one.clone().contiguous() for key, one in tensors.items()}, metadata=metadata)
    )
    load_baked(root / "baked/x.safetensors")
    shutil.copy(
        Path(charnerf.__file__).parent / "weights/released.safetensors", root / "weights/x.safetensors"
    )
    write_checkpoint(root / "ckpt/x.ckpt", {"state_dict": {"a": torch.zeros(8)}, "global_step": 3})


def _write_texts(root: Path) -> None:
    search_folder = root / "search"
    search_folder.mkdir()
    search(search_folder)
    (root / "run").mkdir()
    (root / "run/config.yaml").write_text("name: x\nscale: &one {width: 32}\nother: *one\nlist: [1, 2]\n")
    docs = Path(__file__).parents[1] / "docs/weights"
    shutil.copy(docs / "metrics_real_characters.json", root / "run/metrics.json")
    (root / "run/curve.csv").write_text(
        "step,seconds,phase,rays,val_psnr\n1,2.0,0,64,10.0\n2,3.0,0,64,11.0\n"
    )
    mesh = root / "mesh"
    mesh.mkdir()
    points, faces = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n".splitlines(), ((0, 1, 2), (0, 1, 3), (1, 2, 3))
    (mesh / "x.obj").write_text(
        "".join(f"v {one}\n" for one in points)
        + "".join("f " + " ".join(str(i + 1) for i in face) + "\n" for face in faces)
    )
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    head = f"ply\nformat ascii 1.0\nelement vertex 4\n{axes}element face 3\nproperty list uchar int vertex_indices\nend_header\n"
    (mesh / "x.ply").write_text(
        head + "\n".join(points) + "\n" + "".join(f"3 {a} {b} {c}\n" for a, b, c in faces)
    )
    raw = (
        np.array([[float(n) for n in one.split()] for one in points], np.float32).tobytes()
        + np.array(faces, np.uint16).tobytes()
    )
    accessors = [
        {
            "bufferView": 0,
            "componentType": 5126,
            "count": 4,
            "type": "VEC3",
            "min": [0, 0, 0],
            "max": [1, 1, 1],
        },
        {"bufferView": 1, "componentType": 5123, "count": 9, "type": "SCALAR"},
    ]
    content = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [0, 0, 1], "children": [1]}, {}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}], "accessors": accessors,
        "buffers": [{"byteLength": len(raw), "uri": "data:application/octet-stream;base64," + base64.b64encode(raw).decode()}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 18}],
    }  # fmt: skip
    (mesh / "x.gltf").write_text(json.dumps(content))


@pytest.mark.parametrize("name", READERS)
def test_a_changed_file_is_read_or_refused(
    name: str, whole: Path, table: list[dict[str, object]], tmp_path: Path
) -> None:
    file, reader = READERS[name]
    folder = tmp_path / file.split("/")[0]
    shutil.copytree(whole / folder.name, folder)
    whole_content = (tmp_path / file).read_bytes()
    took: list[tuple[float, float]] = []

    @settings(
        max_examples=TIMES,
        deadline=None,
        database=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
    )
    @given(changes=CHANGES)
    def read(changes: list[Change]) -> None:
        (tmp_path / file).write_bytes(changed(whole_content, changes))
        forget_peak()
        before, began = memory_mib("VmRSS"), time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                reader(folder)
            except (CharNeRFError, OSError):
                pass
        took.append((time.perf_counter() - began, memory_mib("VmHWM") - before))
        assert took[-1][1] < MOST_MIB
        assert not (tmp_path / "etc").exists()

    read()
    seconds, mib = (max(column) for column in zip(*took, strict=True))
    table.append(
        {
            "file": name,
            "inputs": len(took),
            "longest seconds": round(seconds, 2),
            "most MiB": round(mib, 1),
        }
    )
