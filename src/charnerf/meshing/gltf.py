"""glTF 2.0 with float positions and normals, and linear vertex colours of 16 bits or a base-colour texture.

Written here because trimesh stores COLOR_0 in 8 bits, whose dark tones do not survive the linear scale, and
names no material, so that viewers show bare metal.

Source: Khronos glTF 2.0 specification, sections 3.7.2 (meshes: COLOR_0 is linear), 3.9 (materials:
    baseColorTexture is sRGB), 4.4 (GLB).
"""

import base64
import json
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from charnerf.meshing.exported import ExportedMesh
from charnerf.surfaces.color import linear_from_srgb

_FLOAT, _USHORT, _UINT = 5126, 5123, 5125
_ARRAY_BUFFER, _ELEMENT_BUFFER = 34962, 34963
_LINEAR, _MIPMAPPED, _CLAMP = 9729, 9987, 33071


def encode_glb(mesh: ExportedMesh) -> bytes:
    """One mesh as binary glTF."""
    document, binary = _document(mesh)
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = (
        struct.pack("<II", len(text), 0x4E4F534A)
        + text
        + struct.pack("<II", len(binary), 0x004E4942)
        + binary
    )
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def encode_gltf(mesh: ExportedMesh) -> bytes:
    """One mesh as a self-contained glTF text, buffer and picture inside."""
    document, binary = _document(mesh)
    document["buffers"][0]["uri"] = (
        "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    )
    return json.dumps(document, indent=1).encode()


@dataclass
class _Buffer:
    """Pieces of the binary part and what describes them."""

    blob: bytearray = field(default_factory=bytearray)
    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)

    def add_raw(self, raw: bytes, **more: Any) -> int:
        """Append bytes; returns the index of their view."""
        self.views.append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(raw), **more})
        self.blob += raw + b"\0" * (-len(raw) % 4)
        return len(self.views) - 1

    def add(self, data: np.ndarray, component: int, kind: str, target: int, **more: Any) -> int:
        """Append an array; returns the index of its accessor."""
        view = self.add_raw(data.tobytes(), target=target)
        entry = {"bufferView": view, "componentType": component, "count": len(data), "type": kind, **more}
        self.accessors.append(entry)
        return len(self.accessors) - 1


def _document(mesh: ExportedMesh) -> tuple[dict[str, Any], bytes]:
    """The JSON part and the buffer."""
    buffer = _Buffer()
    positions = np.ascontiguousarray(mesh.vertices, "<f4")
    bounds = {"min": positions.min(0).tolist(), "max": positions.max(0).tolist()}
    attributes = {
        "POSITION": buffer.add(positions, _FLOAT, "VEC3", _ARRAY_BUFFER, **bounds),
        "NORMAL": buffer.add(_unit(mesh.normals), _FLOAT, "VEC3", _ARRAY_BUFFER),
    }
    surface: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": 1.0}
    more: dict[str, Any] = {}
    if mesh.uv is not None:
        downward = np.stack((mesh.uv[:, 0], 1.0 - mesh.uv[:, 1]), axis=1)
        uv = np.ascontiguousarray(downward, "<f4")
        attributes["TEXCOORD_0"] = buffer.add(uv, _FLOAT, "VEC2", _ARRAY_BUFFER)
        surface["baseColorTexture"] = {"index": 0}
        picture = {"name": mesh.name, "mimeType": "image/png", "bufferView": buffer.add_raw(mesh.png())}
        filters = {"magFilter": _LINEAR, "minFilter": _MIPMAPPED, "wrapS": _CLAMP, "wrapT": _CLAMP}
        more = {"textures": [{"sampler": 0, "source": 0}], "samplers": [filters], "images": [picture]}
    elif mesh.rgba is not None:
        linear = np.concatenate((linear_from_srgb(mesh.rgba[:, :3]), mesh.rgba[:, 3:]), axis=1)
        data = np.round(65535 * linear).astype("<u2")
        attributes["COLOR_0"] = buffer.add(data, _USHORT, "VEC4", _ARRAY_BUFFER, normalized=True)
    indices = np.ascontiguousarray(mesh.faces, "<u4").reshape(-1)
    primitive = {
        "attributes": attributes,
        "indices": buffer.add(indices, _UINT, "SCALAR", _ELEMENT_BUFFER),
        "material": 0,
        "mode": 4,
    }
    document = {
        "asset": {"version": "2.0", "generator": "charnerf"},
        "scene": 0,
        "scenes": [{"name": mesh.name, "nodes": [0]}],
        "nodes": [{"mesh": 0, "name": mesh.name}],
        "meshes": [{"name": mesh.name, "primitives": [primitive]}],
        "materials": [{"name": mesh.name, "pbrMetallicRoughness": surface}],
        **more,
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.blob)}],
    }
    return document, bytes(buffer.blob)


def _unit(normals: np.ndarray) -> np.ndarray:
    """Normals as exact unit vectors; a vertex without one looks up."""
    normals = np.asarray(normals, np.float64)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    up = np.broadcast_to((0.0, 1.0, 0.0), normals.shape)
    return np.ascontiguousarray(np.where(length > 0, normals / np.where(length > 0, length, 1.0), up), "<f4")
