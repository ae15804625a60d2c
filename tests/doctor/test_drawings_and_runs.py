"""Drawings, foreign data sets and runs are examined too."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image, ImageOps
from safetensors import safe_open
from safetensors.torch import save_file

from charnerf.config.composition import compose_config
from charnerf.doctor.characters import dataset_findings
from charnerf.doctor.drawings import drawing_findings, drawings_in
from charnerf.doctor.finding import Finding
from charnerf.doctor.run import is_run, run_findings
from charnerf.drawings.viewpoints import viewpoint
from charnerf.inference.build import build_model
from charnerf.inference.weights import save_config, save_weights
from support import foreign_sets as sets
from support.painted import paint


def faults(findings: list[Finding]) -> list[str]:
    return [one.fault for one in findings if one.is_broken]


@pytest.fixture
def drawn(tmp_path: Path) -> Path:
    """Front, side and back of the painted character."""
    for view in ("front", "side", "back"):
        paint(view).save(tmp_path / f"{view}.png")
    return tmp_path


def examined(folder: Path) -> list[Finding]:
    named = {
        viewpoint("left" if name == "side" else name): file for name, file in drawings_in(folder).items()
    }
    return list(drawing_findings(named))


def test_a_picture_too_small_is_not_blamed_on_its_background(tmp_path: Path) -> None:
    Image.new("RGB", (10, 24), "white").save(tmp_path / "back.png")
    (finding,) = examined(tmp_path)
    assert finding.fault == "unusable picture" and "Use a larger picture" in finding.found


@pytest.mark.parametrize(
    ("mode", "name"), [("CMYK", "front.jpg"), ("I;16", "front.png"), ("LA", "front.webp")]
)
def test_every_kind_of_picture_that_is_read_is_left_alone(mode: str, name: str, tmp_path: Path) -> None:
    picture = Image.new("L", (64, 96), 255)
    picture.paste(60, (16, 16, 48, 80))
    if mode == "I;16":
        Image.fromarray(np.asarray(picture).astype(np.uint16) * 257).save(tmp_path / name)
    else:
        picture.convert(mode).save(tmp_path / name)
    assert examined(tmp_path) == []


@pytest.mark.slow
def test_clean_drawings(drawn: Path) -> None:
    assert examined(drawn) == []


@pytest.mark.slow
def test_faults_of_drawings(drawn: Path) -> None:
    with Image.open(drawn / "side.png") as side:
        ImageOps.mirror(side).save(drawn / "side.png")
    with Image.open(drawn / "back.png") as back:
        width, height = back.size
        back.crop((0, height // 3, width, height - height // 6)).save(drawn / "back.png")
    (drawn / "front.png").write_bytes((drawn / "front.png").read_bytes()[:300])
    assert {"mirrored picture", "unusable picture", "cropped figure"} <= set(faults(examined(drawn)))


def test_foreign_sets(tmp_path: Path) -> None:
    cameras, images = sets.around(), sets.pictures(sets.around())
    sets.write_srn(tmp_path / "srn", cameras, images)
    sets.write_nerf_blender(tmp_path / "blender", sets.looking_along_z(cameras), images)
    find = lambda folder: list(dataset_findings(folder, processes=1, counter=lambda total: lambda: None))  # noqa: E731
    assert find(tmp_path / "srn") == []
    assert faults(find(tmp_path / "blender")) == ["OpenCV for OpenGL cameras"]
    (tmp_path / "srn/pose/000003.txt").write_text("1 2 3")
    assert faults(find(tmp_path / "srn")) == ["unreadable character"]


def test_the_depth_of_foreign_sets_is_left_alone(tmp_path: Path) -> None:
    """Nothing reads it, and a sensor's is of the whole room."""
    cameras, images = sets.around(), sets.pictures(sets.around())
    sets.write_nerfstudio(tmp_path / "set", cameras, images)
    file = tmp_path / "set/transforms.json"
    content = json.loads(file.read_text())
    content["frames"][0]["depth_file_path"] = "room.png"
    content["frames"][1]["depth_file_path"] = "broken.png"
    file.write_text(json.dumps(content))
    Image.new("I;16", images[0].shape[1::-1], 900).save(tmp_path / "set/room.png")
    (tmp_path / "set/broken.png").write_bytes(b"no picture")
    assert list(dataset_findings(tmp_path / "set", processes=1, counter=lambda total: lambda: None)) == []


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run with weights, a curve and metrics; read only."""
    folder = tmp_path_factory.mktemp("run")
    cfg = compose_config(["scale=smoke"])
    save_config(folder, cfg)
    save_weights(folder / "weights.safetensors", build_model(cfg), cfg)
    (folder / "curve.csv").write_text("step,seconds\n1,0.5\n")
    return folder


def test_faults_of_runs(finished: Path, tmp_path: Path) -> None:
    assert is_run(finished)
    assert faults(list(run_findings(finished))) == ["unfinished run"]  # it has no metrics.json
    broken = Path(shutil.copytree(finished, tmp_path / "run"))
    with safe_open(str(broken / "weights.safetensors"), framework="pt") as file:
        note, state = file.metadata(), {name: file.get_tensor(name) for name in file.keys()}
    name = next(one for one, value in state.items() if value.is_floating_point())
    state[name] = torch.full_like(state[name], np.nan)
    save_file(state, broken / "weights.safetensors", note)
    (broken / "checkpoints").mkdir()
    (broken / "checkpoints/last.ckpt").write_bytes(b"PK cut off")
    (broken / "curve.csv").write_bytes(b"\xff\x00")
    (broken / "nonfinite_batch_0000007.pt").touch()
    (broken / "metrics.json").write_text(json.dumps({"psnr": 1.0}))
    findings = list(run_findings(broken))
    told = faults(findings)
    assert told.count("numbers that are not finite") == 1 and told.count("truncated file") == 3
    (weights,) = (one for one in findings if one.fault == "broken weights")
    assert "NaN" in weights.found


def test_many_alike_are_told_once_and_masks_may_be_of_one_bit(tmp_path: Path) -> None:
    cameras, images = sets.around(), sets.pictures(sets.around())
    sets.write_nerfstudio(tmp_path / "set", cameras, images)
    for file in (tmp_path / "set/masks").iterdir():
        with Image.open(file) as mask:
            mask.convert("1").save(file)
    find = lambda: list(dataset_findings(tmp_path / "set", processes=1, counter=lambda total: lambda: None))  # noqa: E731
    assert find() == []
    for file in (tmp_path / "set/masks").iterdir():
        file.write_bytes(b"")
    told = [one for one in find() if one.fault == "broken mask"]
    assert len(told) == 3 and "5 more views" in told[-1].found
