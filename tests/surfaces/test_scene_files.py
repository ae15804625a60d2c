"""What mesh files of other programs hold, and how it is said that something of it is missing."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

from charnerf.errors import DataError
from charnerf.surfaces.scene_files import read_scene
from charnerf.surfaces.scene_mesh import surface_of_scene
from charnerf.surfaces.surface_mesh import shade
from support.gltf_files import PIXELS, POSITIONS, UVS, Figure, png

GLOSS, TRANSFORM = "KHR_materials_pbrSpecularGlossiness", "KHR_texture_transform"


def seen(file):
    """Corners and middle's colour of every triangle, (M, 13), in an order of their own."""
    surface = surface_of_scene(read_scene(file))
    thirds = np.full(len(surface.triangles), 1 / 3)
    colors = shade(surface, np.arange(len(surface.triangles)), thirds, thirds)
    rows = np.concatenate((surface.triangles.reshape(-1, 9), colors), axis=1)
    return rows[np.lexsort(np.round(rows[:, ::-1], 3).T)]


def _normalized(figure, kind):
    whole = np.rint(UVS.astype(np.float64) * np.iinfo(kind).max).astype(kind)
    figure.primitive["attributes"]["TEXCOORD_0"] = figure.add(whole, normalized=True)


def _quantized_positions(figure):
    figure.primitive["attributes"]["POSITION"] = figure.add((POSITIONS * 10).astype(np.int8))
    figure.node["scale"] = [0.1, 0.1, 0.1]
    figure.tree["extensionsRequired"] = ["KHR_mesh_quantization"]


def _quantized_and_normalized(figure):
    whole = np.rint(POSITIONS / 2.0 * 32767).astype(np.int16)
    figure.primitive["attributes"]["POSITION"] = figure.add(whole, normalized=True)
    figure.node["scale"] = [2.0, 2.0, 2.0]


def _whole_numbered_uvs(figure):
    """Not normalized: scaled by the texture's transform, as gltfpack writes them."""
    figure.primitive["attributes"]["TEXCOORD_0"] = figure.add(np.rint(UVS * 1000).astype(np.uint16))
    figure.texture["extensions"] = {TRANSFORM: {"scale": [0.001, 0.001]}}


def _sparse(figure):
    attributes = figure.primitive["attributes"]
    wrong = POSITIONS.copy()
    wrong[4:] = 9.0
    attributes["POSITION"] = figure.add_sparse(POSITIONS, range(4, 8), base=wrong)
    attributes["TEXCOORD_0"] = figure.add_sparse(UVS, range(8))


def _transformed(figure):
    """Stored so that a quarter turn, by which (u, v) becomes (v, -u), and an offset give the plain ones."""
    stored = np.stack((0.1 - UVS[:, 1], UVS[:, 0] - 0.3), axis=1) / (2.0, 4.0)
    figure.primitive["attributes"]["TEXCOORD_0"] = figure.add(stored.astype(np.float32))
    transform = {"offset": [0.3, 0.1], "rotation": np.pi / 2, "scale": [2.0, 4.0]}
    figure.texture["extensions"] = {TRANSFORM: transform}
    figure.tree["extensionsRequired"] = [TRANSFORM]


def _second_uvs(figure, *, override=False):
    attributes = figure.primitive["attributes"]
    attributes["TEXCOORD_1"] = attributes["TEXCOORD_0"]
    attributes["TEXCOORD_0"] = figure.add(np.zeros_like(UVS))
    figure.texture["texCoord"] = 0 if override else 1
    if override:
        figure.texture["extensions"] = {TRANSFORM: {"texCoord": 1}}


def _gloss(figure):
    base = figure.material["pbrMetallicRoughness"] | {"baseColorFactor": [0.2, 0.2, 0.2, 1.0]}
    figure.material["pbrMetallicRoughness"] = base
    gloss = {"diffuseTexture": figure.texture, "specularFactor": [0.5, 0.5, 0.5], "glossinessFactor": 1.0}
    figure.material["extensions"] = {GLOSS: gloss, "KHR_materials_unlit": {}}
    figure.tree["extensionsRequired"] = [GLOSS, "KHR_materials_unlit"]


def _palette(figure):
    _gloss(figure)
    image = Image.fromarray(PIXELS).quantize(25)
    figure.image["bufferView"] = figure.view(png(image))


def _skin(figure):
    """The upper square is bound lying aside; its joint, under a turned and moved one, brings it back."""
    upper = np.arange(8) >= 4
    bind = POSITIONS.copy()
    bind[upper] = np.array((5.0, 0.0, 0.0)) + POSITIONS[upper] @ ((0, -1, 0), (1, 0, 0), (0, 0, 1))
    joints = np.zeros((8, 4), np.uint8)
    joints[upper, 0] = 1
    weights = np.zeros((8, 4), np.uint8)
    weights[:, 0] = 255
    attributes = figure.primitive["attributes"] | {"POSITION": figure.add(bind)}
    attributes |= {"JOINTS_0": figure.add(joints), "WEIGHTS_0": figure.add(weights, normalized=True)}
    figure.primitive["attributes"] = attributes
    inverse_binds = np.stack((np.eye(4), np.eye(4))).astype(np.float32)
    inverse_binds[1, 3, :3] = (-5, 0, 0)  # columns first: the translation is in the last four numbers
    figure.tree["skins"] = [
        {"joints": [2, 3], "inverseBindMatrices": figure.add(inverse_binds.reshape(2, 16))}
    ]
    figure.node |= {"skin": 0, "translation": [7.0, 7.0, 7.0]}
    half = np.sqrt(0.5)
    figure.tree["nodes"] += [
        {"children": [2], "translation": [0, 1, 0]},
        {"children": [3], "translation": [0, -1, 0]},
        {"rotation": [0, 0, half, half]},
    ]
    figure.tree["scenes"][0]["nodes"] = [0, 1]


def _morph(figure):
    low = POSITIONS * (1.0, 0.5, 1.0)
    figure.primitive["attributes"]["POSITION"] = figure.add(low.astype(np.float32))
    rise = (POSITIONS - low).astype(np.float32) / 0.25
    figure.primitive["targets"] = [{"POSITION": figure.add_sparse(rise, range(2, 8))}, {}]
    figure.tree["meshes"][0]["weights"] = [0.25, 0.0]


def _fans(figure):
    more = {"mode": 6, "indices": figure.add(np.array((4, 5, 6, 7), np.uint16))}
    figure.tree["meshes"][0]["primitives"].append(figure.primitive | more)
    figure.primitive |= {"mode": 6, "indices": figure.add(np.arange(4, dtype=np.uint16))}


def _interleaved(figure):
    rows = np.concatenate((POSITIONS, UVS), axis=1).tobytes()
    view = figure.view(rows, byteStride=20)
    for name, offset in (("POSITION", 0), ("TEXCOORD_0", 12)):
        entry = figure.tree["accessors"][figure.primitive["attributes"][name]]
        entry |= {"bufferView": view, "byteOffset": offset}
    figure.primitive["attributes"]["POSITION"] = figure.add_sparse(POSITIONS, [])
    entry = figure.tree["accessors"][figure.primitive["attributes"]["POSITION"]]
    entry |= {"bufferView": view, "byteOffset": 0}


def _no_scene(figure):
    del figure.tree["scenes"], figure.tree["scene"]
    figure.tree["nodes"] = [{"children": [1]}, figure.node]


def _webp(figure):
    file = io.BytesIO()
    Image.fromarray(PIXELS).save(file, "WEBP", lossless=True)
    figure.tree["images"].append({"bufferView": figure.view(file.getvalue()), "mimeType": "image/webp"})
    figure.tree["textures"] = [{"extensions": {"EXT_texture_webp": {"source": 1}}}]
    figure.tree["extensionsRequired"] = ["EXT_texture_webp"]


@pytest.mark.parametrize(
    "change",
    [
        lambda figure: _normalized(figure, np.uint8),
        lambda figure: _normalized(figure, np.uint16),
        _quantized_positions,
        _quantized_and_normalized,
        _whole_numbered_uvs,
        _sparse,
        _transformed,
        _second_uvs,
        lambda figure: _second_uvs(figure, override=True),
        _gloss,
        _palette,
        _skin,
        _morph,
        _fans,
        _interleaved,
        _no_scene,
        _webp,
    ],
)
def test_gltf_says_the_same_in_other_ways(tmp_path, change):
    figure = Figure()
    change(figure)
    plain = seen(Figure().write(tmp_path / "plain.glb"))
    np.testing.assert_allclose(seen(figure.write(tmp_path / "other.glb")), plain, atol=2e-4)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
def test_gltf_sparse_colors(tmp_path, kind):
    """Every kind of number, stored sparsely and not; with the texture and its material, and without."""
    scale = 1.0 if kind == np.float32 else np.iinfo(kind).max
    colors = np.tile(np.array((1.0, 0.2, 0.6, 1.0)) * scale, (8, 1)).astype(kind)
    more = {} if kind == np.float32 else {"normalized": True}
    for index, textured in enumerate((True, False)):
        figures = Figure(), Figure()
        for figure in figures:
            if not textured:
                del figure.primitive["material"]
        figures[0].primitive["attributes"]["COLOR_0"] = figures[0].add(colors, **more)
        figures[1].primitive["attributes"]["COLOR_0"] = figures[1].add_sparse(colors, range(8), **more)
        plain, sparse = (seen(figure.write(tmp_path / f"{index}.glb")) for figure in figures)
        np.testing.assert_allclose(sparse, plain, atol=1e-5)
        if not textured:
            np.testing.assert_allclose(plain[:, 9:], np.tile((1.0, 0.2, 0.6, 1.0), (4, 1)), atol=3e-3)


def test_gltf_names_of_files_are_uris(tmp_path):
    figure = Figure()
    figure.tree["images"] = [{"uri": "a%20skin.png"}]
    (tmp_path / "a skin.png").write_bytes(png())
    (tmp_path / "the bytes.bin").write_bytes(bytes(figure.chunk))
    inline = "data:application/octet-stream;base64," + base64.b64encode(figure.chunk).decode()
    plain = seen(Figure().write(tmp_path / "plain.glb"))
    for uri in ("the%20bytes.bin", inline):
        np.testing.assert_array_equal(seen(figure.write(tmp_path / "figure.gltf", buffer_uri=uri)), plain)


def _required(figure):
    figure.tree["extensionsRequired"] = ["EXT_something_new"]


def _draco(figure):
    """Without a word in extensionsRequired, but with no other positions."""
    for index in figure.primitive["attributes"].values():
        del figure.tree["accessors"][index]["bufferView"]
    figure.primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}}


def _meshopt(figure):
    """As gltfpack writes it: the plain bytes are nowhere."""
    figure.tree["buffers"] = [
        {"byteLength": 96, "extensions": {"EXT_meshopt_compression": {"fallback": True}}}
    ]
    figure.tree["bufferViews"][0] |= {"buffer": 1, "extensions": {"EXT_meshopt_compression": {"buffer": 0}}}


def _no_uvs(figure):
    del figure.primitive["attributes"]["TEXCOORD_0"]


def _basisu(figure):
    figure.tree["textures"] = [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]


def _instances(figure):
    figure.node["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {}}}


def _no_picture(figure):
    figure.tree["images"] = [{"uri": "gone.png"}]


def _broken_picture(figure):
    figure.image |= {"bufferView": figure.view(b"no picture"), "name": "face"}


def _half_picture(figure):
    noise = np.random.default_rng(1).integers(0, 256, (64, 64, 3), np.uint8)
    figure.image["bufferView"] = figure.view(png(Image.fromarray(noise))[:6000])


def _climbing(figure):
    figure.tree["images"] = [{"uri": "../secret.png"}]


def _cycle(figure):
    figure.node["children"] = [0]


def _outside(figure):
    index = figure.add_sparse(POSITIONS, range(8))
    figure.primitive["attributes"]["POSITION"] = index
    figure.tree["accessors"][index]["sparse"]["count"] = 4000


def _far_joint(figure):
    _skin(figure)
    figure.tree["skins"][0]["joints"] = [2]


@pytest.mark.parametrize(
    "change, message",
    [
        (_required, "EXT_something_new"),
        (_draco, "KHR_draco_mesh_compression"),
        (_meshopt, "EXT_meshopt_compression"),
        (_basisu, "KHR_texture_basisu"),
        (_no_uvs, "reads its picture at TEXCOORD_0"),
        (_instances, "EXT_mesh_gpu_instancing"),
        (_no_picture, "gone.png"),
        (_broken_picture, "picture face: can not be read"),
        (_half_picture, "picture of material 'skin' can not be read"),
        (_climbing, "secret.png"),
        (_cycle, "their own children"),
        (_outside, "4000 rows"),
        (_far_joint, "joint 1 of 1"),
    ],
)
def test_gltf_that_is_not_read_is_refused_by_name(tmp_path, change, message):
    folder = tmp_path / "meshes"
    folder.mkdir()
    (tmp_path / "secret.png").write_bytes(png())
    figure = Figure()
    change(figure)
    with pytest.raises(DataError, match=message) as caught:
        read_scene(figure.write(folder / "figure.glb"))
    assert str(caught.value).startswith(str(folder / "figure.glb"))


def test_optional_compression_with_plain_data_beside_it_is_read(tmp_path):
    figure = Figure()
    figure.primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}}
    figure.tree["textures"][0]["extensions"] = {"KHR_texture_basisu": {"source": 7}}
    figure.tree["images"].append({"uri": "unused.png"})
    figure.tree["bufferViews"][0]["extensions"] = {"EXT_meshopt_compression": {"buffer": 0}}
    plain = seen(Figure().write(tmp_path / "plain.glb"))
    np.testing.assert_array_equal(seen(figure.write(tmp_path / "other.glb")), plain)
