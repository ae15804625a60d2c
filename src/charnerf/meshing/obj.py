"""Wavefront OBJ: positions, texture coordinates and normals indexed apart, so that seams split nothing."""

import numpy as np

from charnerf.meshing.exported import ExportedMesh, welded


def encode_obj(mesh: ExportedMesh) -> dict[str, bytes]:
    """The files of a mesh by suffix: .obj, and with a texture .mtl and .png beside it.

    Vertex colours follow the positions, sRGB-encoded as they are; that is how programs write them.
    """
    body = welded(mesh)
    lines = ["# charnerf: metres, Y up, facing +Z", f"o {mesh.name}"]
    textured = mesh.uv is not None
    if textured:
        lines.insert(1, f"mtllib {mesh.name}.mtl")
    rows = body.vertices if textured or body.rgba is None else np.hstack((body.vertices, body.rgba[:, :3]))
    lines += _rows("v", rows)
    if textured:
        lines += _rows("vt", mesh.uv)
    lines += _rows("vn", body.normals)
    corners = [body.faces + 1, mesh.faces + 1, body.faces + 1] if textured else [body.faces + 1] * 2
    if textured:
        lines.append("usemtl character")
    lines += _face_lines(corners, "/" if textured else "//")
    files = {".obj": ("\n".join(lines) + "\n").encode()}
    if textured:
        material = [
            "newmtl character",
            "Ka 0 0 0",
            "Kd 1 1 1",
            "Ks 0 0 0",
            "illum 1",
            f"map_Kd {mesh.name}.png",
        ]
        files[".mtl"] = ("\n".join(material) + "\n").encode()
        files[".png"] = mesh.png()
    return files


def _rows(word: str, values: np.ndarray | None) -> list[str]:
    assert values is not None
    form = word + " %.7g" * values.shape[1]
    return [form % tuple(row) for row in values.tolist()]


def _face_lines(corners: list[np.ndarray], between: str) -> list[str]:
    joined = between.join(["%d"] * len(corners))
    form = f"f {joined} {joined} {joined}"
    table = np.stack(corners, axis=2).reshape(len(corners[0]), -1)
    return [form % tuple(row) for row in table.tolist()]
