"""OBJ files of the MakeHuman project: triangles with their group, indices kept as clothes and targets name them."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class GroupedMesh:
    """Polygons cut into triangles.

    Attributes:
        vertices: (n, 3), MakeHuman's frame: decimetres, +Y up, facing +Z.
        uvs: Texture coordinates, (t, 2), v upwards; (1, 2) of zeros where there are none.
        faces: Vertices of triangles, (f, 3).
        uv_faces: Their texture coordinates, (f, 3).
        groups: Name of each triangle's group, (f,).
    """

    vertices: np.ndarray
    uvs: np.ndarray
    faces: np.ndarray
    uv_faces: np.ndarray
    groups: np.ndarray

    def group(self, *names: str) -> np.ndarray:
        """Which triangles are of groups, (f,) bool."""
        return np.isin(self.groups, names)


def parse_obj(content: bytes) -> GroupedMesh:
    """Read an OBJ file.

    Raises:
        ValueError: If a number is none, or a face names what is not there.
    """
    vertices: list[list[float]] = []
    uvs: list[list[float]] = []
    faces: list[list[int]] = []
    uv_faces: list[list[int]] = []
    groups: list[str] = []
    group = ""
    for line in content.decode(errors="replace").splitlines():
        key, *values = line.split() or ("",)
        if key == "v":
            vertices.append([float(value) for value in values[:3]])
        elif key == "vt":
            uvs.append([float(value) for value in values[:2]])
        elif key == "g":
            group = values[0] if values else ""
        elif key == "f":
            corners = [(*corner.split("/"), "")[:2] for corner in values]
            for second in range(1, len(corners) - 1):
                triangle = (corners[0], corners[second], corners[second + 1])
                faces.append([int(vertex) - 1 for vertex, _ in triangle])
                uv_faces.append([int(uv) - 1 if uv else 0 for _, uv in triangle])
                groups.append(group)
    mesh = GroupedMesh(
        np.array(vertices, dtype=np.float64).reshape(-1, 3),
        np.array(uvs or [[0.0, 0.0]], dtype=np.float64),
        np.array(faces, dtype=np.int64).reshape(-1, 3),
        np.array(uv_faces, dtype=np.int64).reshape(-1, 3),
        np.array(groups, dtype=str),
    )
    for named, there in ((mesh.faces, mesh.vertices), (mesh.uv_faces, mesh.uvs)):
        if not len(named) or named.min() < 0 or named.max() >= len(there):
            raise ValueError("no faces, or one that names a vertex that is not there")
    return mesh
