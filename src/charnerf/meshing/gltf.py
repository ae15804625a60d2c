"""glTF 2.0 with float positions, normals and linear vertex colours of 16 bits.

Written here because trimesh stores COLOR_0 in 8 bits, whose dark tones do not survive the linear scale, and
names no material, so that viewers show bare metal.

Source: Khronos glTF 2.0 specification, sections 3.7.2 (meshes: COLOR_0 is linear), 3.9 (materials), 4.4
    (GLB).
"""

import base64
import json
import struct

import numpy as np

_FLOAT, _USHORT, _UINT = 5126, 5123, 5125
_ARRAY_BUFFER, _ELEMENT_BUFFER = 34962, 34963


def linear_from_srgb(srgb: np.ndarray) -> np.ndarray:
    """Linear light of sRGB-encoded values, any shape, both in [0, 1]. Source: IEC 61966-2-1."""
    srgb = np.asarray(srgb, np.float64)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def encode_glb(
    vertices: np.ndarray, normals: np.ndarray, faces: np.ndarray, rgba: np.ndarray | None, name: str
) -> bytes:
    """One mesh as binary glTF.

    Args:
        vertices: (P, 3), m, in glTF's axes.
        normals: (P, 3), unit, in glTF's axes.
        faces: (T, 3), indices.
        rgba: (P, 4), sRGB-encoded colours in [0, 1], or None.
        name: Name of the node and the mesh.

    Returns:
        The file's bytes.
    """
    document, binary = _document(vertices, normals, faces, rgba, name)
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = (
        struct.pack("<II", len(text), 0x4E4F534A)
        + text
        + struct.pack("<II", len(binary), 0x004E4942)
        + binary
    )
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def encode_gltf(
    vertices: np.ndarray, normals: np.ndarray, faces: np.ndarray, rgba: np.ndarray | None, name: str
) -> bytes:
    """One mesh as a self-contained glTF text, the buffer inside; arguments as `encode_glb`."""
    document, binary = _document(vertices, normals, faces, rgba, name)
    document["buffers"][0]["uri"] = (
        "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    )
    return json.dumps(document, indent=1).encode()


def _document(
    vertices: np.ndarray, normals: np.ndarray, faces: np.ndarray, rgba: np.ndarray | None, name: str
) -> tuple[dict, bytes]:
    """The JSON part and the buffer."""
    positions = np.ascontiguousarray(vertices, "<f4")
    bounds = {"min": positions.min(0).tolist(), "max": positions.max(0).tolist()}
    parts: list[tuple[np.ndarray, int, str, int, dict]] = [
        (positions, _FLOAT, "VEC3", _ARRAY_BUFFER, bounds),
        (_unit(normals), _FLOAT, "VEC3", _ARRAY_BUFFER, {}),
        (np.ascontiguousarray(faces, "<u4").reshape(-1), _UINT, "SCALAR", _ELEMENT_BUFFER, {}),
    ]
    attributes = {"POSITION": 0, "NORMAL": 1}
    if rgba is not None:
        linear = np.concatenate((linear_from_srgb(rgba[:, :3]), rgba[:, 3:]), axis=1)
        parts.append(
            (np.round(65535 * linear).astype("<u2"), _USHORT, "VEC4", _ARRAY_BUFFER, {"normalized": True})
        )
        attributes["COLOR_0"] = 3
    views, accessors, blob = [], [], b""
    for index, (data, component, kind, target, more) in enumerate(parts):
        raw = data.tobytes()
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(raw), "target": target})
        accessors.append(
            {"bufferView": index, "componentType": component, "count": len(data), "type": kind, **more}
        )
        blob += raw + b"\0" * (-len(raw) % 4)
    document = {
        "asset": {"version": "2.0", "generator": "charnerf"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": name}],
        "meshes": [
            {"name": name, "primitives": [{"attributes": attributes, "indices": 2, "material": 0, "mode": 4}]}
        ],
        "materials": [
            {"name": name, "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0}}
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(blob)}],
    }
    return document, blob


def _unit(normals: np.ndarray) -> np.ndarray:
    """Normals as exact unit vectors; a vertex without one looks up."""
    normals = np.asarray(normals, np.float64)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    up = np.broadcast_to((0.0, 1.0, 0.0), normals.shape)
    return np.ascontiguousarray(np.where(length > 0, normals / np.where(length > 0, length, 1.0), up), "<f4")
