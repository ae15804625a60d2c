"""What is worn: the project's clothes, which follow the body's vertices, and shells and skirts of the base mesh's own."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from charnerf.files import inside
from charnerf.people.assets import Assets
from charnerf.people.polygons import GroupedMesh, parse_obj

# bones that a plate of armour covers, and how far out it stands at most, decimetres
PLATES: dict[str, tuple[tuple[str, ...], float]] = {
    "helmet": (("head",), 0.35),
    "breastplate": (("spine_02", "spine_03", "clavicle"), 0.4),
    "belt": (("spine_01", "pelvis"), 0.35),
    "pauldrons": (("clavicle", "upperarm"), 0.6),
    "bracers": (("lowerarm",), 0.4),
    "gauntlets": (("hand", "thumb", "index", "middle", "ring", "pinky"), 0.2),
    "cuisses": (("thigh",), 0.4),
    "greaves": (("calf",), 0.45),
    "boots": (("foot", "ball"), 0.25),
}


@dataclass(frozen=True)
class Fitting:
    """How something hangs on a body: every vertex on three of the base mesh's.

    Attributes:
        indices: Vertices of the base mesh, (n, 3).
        shares: Of those, (n, 3).
        offsets: From there, in the units of scales, (n, 3).
        scales: For each axis two vertices of the base mesh and their distance as modelled, or None.
        hidden: Vertices of the body that it covers.
        mesh_file: Name of its mesh.
        material_file: Name of its material, "" if it has none.
    """

    indices: np.ndarray
    shares: np.ndarray
    offsets: np.ndarray
    scales: tuple[tuple[int, int, float] | None, ...]
    hidden: np.ndarray
    mesh_file: str
    material_file: str

    def fitted(self, body: np.ndarray) -> np.ndarray:
        """Its vertices (n, 3) on a body's (m, 3)."""
        sizes = [
            1.0 if scale is None else abs(body[scale[0], axis] - body[scale[1], axis]) / scale[2]
            for axis, scale in enumerate(self.scales)
        ]
        return np.einsum("nk,nkd->nd", self.shares, body[self.indices]) + self.offsets * sizes

    def weights(self, body: np.ndarray) -> np.ndarray:
        """Its weights (n, bones) by those of the body's vertices (m, bones)."""
        mixed = np.einsum("nk,nkb->nb", np.maximum(self.shares, 0.0), body[self.indices])
        return mixed / np.maximum(mixed.sum(axis=1, keepdims=True), 1e-9)


@dataclass(frozen=True)
class Garment:
    """Clothes, hair or eyebrows: a mesh, whose vertices as modelled are not used, how it hangs, the name of its picture."""

    mesh: GroupedMesh
    fitting: Fitting
    picture: str


def read_garment(assets: Assets, folder: Path) -> Garment:
    """What a folder of clothes, hair or eyebrows holds.

    Raises:
        DataError: If a file is missing or broken.
    """
    file = next(iter(sorted(folder.glob("*.mhclo"))), folder / f"{folder.name}.mhclo")
    fitting = assets.read(file, _parse_fitting)
    material = inside(folder, fitting.material_file, str(file))
    picture = assets.read(material, _parse_picture) if material.is_file() else ""
    return Garment(assets.read(inside(folder, fitting.mesh_file, str(file)), parse_obj), fitting, picture)


def _parse_picture(content: bytes) -> str:
    found = re.search(r"^diffuseTexture\s+(\S+)", content.decode(errors="replace"), re.MULTILINE)
    return found.group(1).rpartition("/")[2] if found else ""


def _parse_fitting(content: bytes) -> Fitting:
    """What a .mhclo file says.

    Raises:
        ValueError: If no vertex hangs on the base mesh, or a number is none.
    """
    words: dict[str, list[str]] = {}
    rows, hidden, section = [], [], ""
    for line in content.decode(errors="replace").splitlines():
        values = line.split()
        if not values or values[0].startswith("#"):
            continue
        if values[0].lstrip("-").isdigit():
            if section == "verts":
                rows.append(_hanging(values))
            elif section == "delete_verts":
                hidden += list(_ranges(values))
        else:
            section = values[0] if values[0] in ("verts", "delete_verts", "weights") else section
            words[values[0]] = values[1:]
    if not rows:
        raise ValueError("no vertex hangs on the base mesh")
    table = np.array(rows)
    scales = [words.get(f"{axis}_scale") for axis in "xyz"]
    return Fitting(
        indices=table[:, :3].astype(np.int64),
        shares=table[:, 3:6],
        offsets=table[:, 6:9],
        scales=tuple((int(one[0]), int(one[1]), float(one[2])) if one else None for one in scales),
        hidden=np.array(hidden, dtype=np.int64),
        mesh_file=words["obj_file"][0],
        material_file=words.get("material", [""])[0],
    )


def _hanging(values: list[str]) -> list[float]:
    """Three vertices, their shares and an offset; a single number is a vertex that it is at."""
    numbers = [float(value) for value in values]
    if len(numbers) == 1:
        return [*numbers * 3, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    return [*numbers[:6], *(*numbers[6:9], 0.0, 0.0, 0.0)[:3]]


def _ranges(values: list[str]) -> Iterator[int]:
    for first, last in re.findall(r"(\d+)(?:\s*-\s*(\d+))?", " ".join(values)):
        yield from range(int(first), int(last or first) + 1)


def body_faces(base: GroupedMesh) -> np.ndarray:
    """Which triangles of the base mesh are skin, (f,) bool."""
    return base.group("body")


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals (n, 3) of vertices by the faces at them; zero where there are none."""
    across = np.cross(
        vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    )
    sums = np.stack(
        [np.bincount(faces.ravel(), np.repeat(across[:, axis], 3), len(vertices)) for axis in range(3)],
        axis=-1,
    )
    return sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-12)


def skirt(
    base: GroupedMesh, body: np.ndarray, *, length: float, flare: float
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) of a body with its skirt flared, and the skirt's triangles (f, 3).

    Args:
        base: The base mesh; its helper reaches from the waist to the floor.
        body: Its vertices as shaped.
        length: Share of that.
        flare: How much wider it is below.
    """
    faces = base.faces[base.group("helper-skirt")]
    used = np.unique(faces)
    low, high = body[used, 1].min(), body[used, 1].max()
    down = np.clip((high - body[:, 1]) / max(high - low, 1e-9), 0.0, 1.0)
    vertices = body + 0.06 * vertex_normals(body, faces)
    middle = vertices[used].mean(axis=0) * np.array((1.0, 0.0, 1.0))
    wide = (1.0 + flare * down)[:, None] * np.array((1.0, 0.0, 1.0)) + np.array((0.0, 1.0, 0.0))
    return middle + (vertices - middle) * wide, faces[(down[faces] <= length).all(axis=1)]
