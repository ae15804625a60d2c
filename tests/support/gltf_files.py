"""Small glTF files, written byte by byte: a figure of two squares with a picture, and what tests change of it."""

import copy
import io
import json
import struct

import numpy as np
from PIL import Image

POSITIONS = np.array(
    ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 0), (0.6, 1, 0), (0.6, 2, 0), (0, 2, 0)), np.float32
)
UVS = np.array(((1, 2), (2, 2), (2, 1), (1, 1), (3, 4), (4, 4), (4, 3), (3, 3)), np.float32) / 5
FACES = np.array((0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7), np.uint16)
PIXELS = np.random.default_rng(5).integers(0, 256, (5, 5, 3), np.uint8)
KINDS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}


def png(image: Image.Image | None = None) -> bytes:
    """A picture as PNG; the figure's by itself."""
    file = io.BytesIO()
    (image or Image.fromarray(PIXELS)).save(file, "PNG")
    return file.getvalue()


class Figure:
    """A glTF tree and its buffer; `primitive`, `node` and `texture` are those that tests change."""

    def __init__(self, picture: bytes | None = None):
        self.chunk = bytearray()
        self.tree = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": [], "scene": 0}
        attributes = {"POSITION": self.add(POSITIONS), "TEXCOORD_0": self.add(UVS)}
        self.primitive = {"attributes": attributes, "indices": self.add(FACES), "material": 0}
        self.node = {"mesh": 0}
        self.texture = {"index": 0}
        self.material = {"name": "skin", "pbrMetallicRoughness": {"baseColorTexture": self.texture}}
        self.image = {"bufferView": self.view(picture or png()), "mimeType": "image/png"}
        self.tree |= {
            "scenes": [{"nodes": [0]}],
            "nodes": [self.node],
            "meshes": [{"primitives": [self.primitive]}],
            "materials": [self.material],
            "textures": [{"source": 0}],
            "images": [self.image],
        }

    def view(self, content: bytes, **more) -> int:
        """Add a buffer view."""
        entry = {"buffer": 0, "byteOffset": len(self.chunk), "byteLength": len(content), **more}
        self.chunk += content + b"\0" * (-len(content) % 4)
        self.tree["bufferViews"].append(entry)
        return len(self.tree["bufferViews"]) - 1

    def add(self, values, **more) -> int:
        """Add an accessor of an array, of its own type."""
        values = np.asarray(values)
        kind = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}[values[0].size]
        entry = {
            "bufferView": self.view(values.tobytes()),
            "componentType": KINDS[values.dtype.str[1:]],
            **more,
        }
        self.tree["accessors"].append({"count": len(values), "type": kind, **entry})
        return len(self.tree["accessors"]) - 1

    def add_sparse(self, values, rows, *, base=None, **more) -> int:
        """Add an accessor of an array whose rows are stored sparsely over a base, or over zeros."""
        values, rows = np.asarray(values), np.array(rows, np.uint8)
        index = self.add(values if base is None else base, **more)
        entry = self.tree["accessors"][index]
        if base is None:
            del entry["bufferView"]
        indices = {"bufferView": self.view(rows.tobytes()), "componentType": KINDS["u1"]}
        entry["sparse"] = {
            "count": len(rows),
            "indices": indices,
            "values": {"bufferView": self.view(values[rows].tobytes())},
        }
        return index

    def write(self, file, *, buffer_uri=None):
        """Write it as GLB, or as glTF whose buffer is at a URI; returns the file."""
        tree = copy.deepcopy(self.tree)
        tree["buffers"] = [{"byteLength": len(self.chunk)}, *tree.get("buffers", [])]
        if buffer_uri is not None:
            tree["buffers"][0]["uri"] = buffer_uri
            file.write_text(json.dumps(tree))
            return file
        head = json.dumps(tree).encode()
        head += b" " * (-len(head) % 4)
        body = struct.pack("<I4s", len(head), b"JSON") + head
        body += struct.pack("<I4s", len(self.chunk), b"BIN\0") + bytes(self.chunk)
        file.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
        return file
