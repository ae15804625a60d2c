"""Assets of people, of the tests' own making: a body of boxes around the bones of a skeleton, one garment, two traits."""

import gzip
import json
from pathlib import Path

import numpy as np
from PIL import Image

from charnerf.people.assets import BASE, PICTURES, RIG, TARGETS, WEIGHTS, WORN

# heads of bones, decimetres, +Y up, facing +Z; the left is +X
_MIDDLE = {
    "pelvis": (None, (0.0, 9.0, 0.0)),
    "spine_01": ("pelvis", (0.0, 10.0, 0.0)),
    "spine_02": ("spine_01", (0.0, 11.0, 0.0)),
    "spine_03": ("spine_02", (0.0, 12.0, 0.0)),
    "neck_01": ("spine_03", (0.0, 14.0, 0.0)),
    "head": ("neck_01", (0.0, 15.0, 0.0)),
}
_SIDE = {
    "clavicle": ("spine_03", (0.5, 13.5, 0.0)),
    "upperarm": ("clavicle", (2.0, 13.5, 0.0)),
    "lowerarm": ("upperarm", (3.5, 11.5, 0.2)),
    "hand": ("lowerarm", (5.0, 9.5, 0.5)),
    "thigh": ("pelvis", (1.0, 9.0, 0.0)),
    "calf": ("thigh", (1.1, 5.0, 0.1)),
    "foot": ("calf", (1.2, 1.0, 0.0)),
}
BOX = np.array([(x, y, z) for x in (-0.4, 0.4) for y in (-0.4, 0.4) for z in (-0.4, 0.4)])
QUADS = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))
HAT = 8 * 5  # first vertex of the head's box


def bones():
    """Parents and heads by name; parents first."""
    both = {
        f"{name}_{side}": (
            parent if parent in _MIDDLE else f"{parent}_{side}", (sign * head[0], head[1], head[2])
        )
        for side, sign in (("l", 1.0), ("r", -1.0))
        for name, (parent, head) in _SIDE.items()
    }  # fmt: skip
    return {**_MIDDLE, **both}


def write_assets(root: Path) -> Path:
    """Write them; the folder."""
    skeleton = bones()
    blocks, groups = [], []
    for head in (head for _, head in skeleton.values()):
        blocks.append(np.array(head) + BOX)
        groups.append("body")
    for name, (_, head) in skeleton.items():  # joints as cubes, as most are in the real rig
        blocks.append(np.array(head) + 0.1 * BOX)
        groups.append(f"joint-{name}")
    for name, place in (
        ("helper-l-eye", (0.2, 15.2, 0.3)),
        ("helper-r-eye", (-0.2, 15.2, 0.3)),
        ("helper-skirt", (0.0, 6.0, 0.0)),
    ):
        blocks.append(np.array(place) + BOX * (4.0 if name == "helper-skirt" else 0.2))
        groups.append(name)
    _write(root / BASE, _obj(blocks, groups))
    head = {name: {"strategy": "CUBE", "cube_name": f"joint-{name}"} for name in skeleton}
    head["head"] = {"strategy": "VERTEX", "vertex_index": HAT}
    head["pelvis"] = {"strategy": "MEAN", "vertex_indices": [0, 1, 2, 3, 4, 5, 6, 7]}
    _write(
        root / RIG,
        json.dumps({name: {"parent": parent, "head": head[name]} for name, (parent, _) in skeleton.items()}),
    )
    weights = {
        name: [
            [vertex, 1.0]
            for start in (8 * index, 8 * (index + len(skeleton)))
            for vertex in range(start, start + 8)
        ]
        for index, name in enumerate(skeleton)
    }
    weights["pelvis"] += [[vertex, 1.0] for vertex in range(16 * len(skeleton), 16 * len(skeleton) + 24)]
    _write(root / WEIGHTS, json.dumps({"weights": weights}))
    for name in ("macrodetails/caucasian-male-young", "macrodetails/african-male-young", "head/head-round"):
        write_target(root, name, [(HAT + 1, 0.0, 0.5, 0.0)])
    write_garment(root)
    return root


def write_target(root, name, rows):
    file = root / TARGETS / f"{name}.target.gz"
    file.parent.mkdir(parents=True, exist_ok=True)
    text = "# a comment\n" + "".join("{} {} {} {}\n".format(*row) for row in rows)
    file.write_bytes(gzip.compress(text.encode()))


def write_garment(root):
    """Shoes: a triangle on the left foot, which they hide, with a red picture beside a pointer of Git LFS."""
    foot = 8 * list(bones()).index("foot_l")
    folder = root / WORN / "clothes" / "shoes01"
    lines = [
        "# shoes", "name shoes", "obj_file shoes.obj", "material shoes.mhmat", f"x_scale {foot} {foot + 4} 0.4",
        "verts 0", f"{foot} {foot + 4} {foot + 1} 0.5 0.5 0.0 0.1 0.0 0.0", f"{foot + 1}", f"{foot + 4}",
        "delete_verts", f"{foot} - {foot + 6} {foot + 7}",
    ]  # fmt: skip
    _write(folder / "shoes.mhclo", "\n".join(lines))
    _write(folder / "shoes.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n")
    _write(folder / "shoes.mhmat", "name shoes\ndiffuseTexture red.png\n")
    _write(folder / "red.png", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
    picture = root / PICTURES / "proxies" / "clothes" / "shoes01" / "textures" / "red.png"
    picture.parent.mkdir(parents=True)
    Image.new("RGB", (8, 4), (200, 0, 0)).save(picture)


def _obj(blocks, groups):
    lines = [f"v {x} {y} {z}" for block in blocks for x, y, z in block.tolist()] + ["vt 0.5 0.5"]
    for index, group in enumerate(groups):
        lines.append(f"g {group}")
        lines += ["f " + " ".join(f"{8 * index + corner}/1" for corner in quad) for quad in QUADS]
    return "\n".join(lines)


def _write(file, text):
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
