"""OBJ files with other indices, polygons and materials than the plainest."""

import numpy as np
import pytest
from PIL import Image

from charnerf.errors import DataError
from charnerf.surfaces.scene_files import read_scene
from charnerf.surfaces.scene_mesh import surface_of_scene
from support.gltf_files import png
from support.polygon_files import LETTER_C

SQUARES = ((0, 0), (2, 0), (5, 1))  # lower left corners, one unit a side


def square_lines(index, form, *, relative):
    """A square with vertices, coordinates and normals of its own, and a face that names them in one of OBJ's forms."""
    x, y = SQUARES[index]
    corners = ((0, 0), (1, 0), (1, 1), (0, 1))
    lines = [f"v {x + a} {y + b} {0.1 * index}\nvt {a} {b}\nvn 0 0 1" for a, b in corners]
    numbers = [-4 + place if relative else 4 * index + place + 1 for place in range(4)]
    return [*lines, "f " + " ".join(form.format(number) for number in numbers)]


def seen(file):
    """Corners and texture coordinates of every triangle, sorted."""
    surface = surface_of_scene(read_scene(file))
    rows = np.concatenate((surface.triangles.reshape(-1, 9), surface.uvs.reshape(-1, 6)), axis=1)
    return rows[np.lexsort(np.round(rows[:, ::-1], 3).T)]


@pytest.mark.parametrize("form", ["{0}", "{0}/{0}", "{0}//{0}", "{0}/{0}/{0}"])
def test_relative_indices_count_back_from_where_they_stand(tmp_path, form):
    files = []
    for relative in (False, True):
        files.append(tmp_path / f"{relative}.obj")
        lines = [line for index in range(3) for line in square_lines(index, form, relative=relative)]
        files[-1].write_text("\n".join(lines))
    plain, relative = map(seen, files)
    np.testing.assert_array_equal(relative, plain)
    assert len(plain) == 6 and plain[:, :9].max() == 6.0


def test_relative_and_absolute_indices_mix(tmp_path):
    file = tmp_path / "a.obj"
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -1\nv 0 0 1\nf -4 \\\n 2 -1 # the end\n")
    np.testing.assert_array_equal(
        seen(file)[:, :9], ((0, 0, 0, 1, 0, 0, 0, 0, 1), (0, 0, 0, 1, 0, 0, 0, 1, 0))
    )


def test_indices_beyond_the_first_vertex_are_named(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 -2 -1\n")
    with pytest.raises(DataError, match=r"a\.obj: line 4: -4 counts back beyond the first v"):
        read_scene(tmp_path / "a.obj")
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 9\n")
    with pytest.raises(DataError, match=r"a\.obj: a face names a vertex that is not one of 3"):
        read_scene(tmp_path / "a.obj")


@pytest.mark.parametrize("others", ["", "f 1/1 2/2 3/3\n", "f 1/1 2/2 3/3 4/4\n"])
def test_concave_polygons_keep_their_openings_and_coordinates(tmp_path, others):
    """Alone, and beside triangles and squares."""
    corners = "".join(f"v {x} {y} 0\nvt {x / 10} {y / 10}\n" for x, y in LETTER_C)
    letter = "f " + " ".join(f"{index}/{index}" for index in range(1, 9)) + "\n"
    (tmp_path / "a.obj").write_text(corners + letter + others)
    surface = surface_of_scene(read_scene(tmp_path / "a.obj"))
    np.testing.assert_allclose(surface.uvs, surface.triangles[..., :2] / 10, atol=1e-6)
    first, second, third = np.moveaxis(surface.triangles, 1, 0)
    area = 0.5 * np.linalg.norm(np.cross(second - first, third - first), axis=-1).sum()
    assert area == pytest.approx(5.0 + {0: 0.0, 3: 1.0, 4: 1.5}[len(others.split()[1:])], abs=1e-5)


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl skin\nf 1/1 2/2 3/3\n"


@pytest.mark.parametrize(
    "libraries, mtl, picture",
    [
        ("mtllib a.mtl", "map_Kd skin.png", "skin.png"),
        ("mtllib other.mtl a.mtl", "map_Kd my skin.png", "my skin.png"),
        ("mtllib other.mtl\nmtllib a.mtl", "\tmap_Kd -clamp on -s 1 1 1 -o 0 0 0 skin.png", "skin.png"),
        ("mtllib a.mtl", "map_Kd C:\\art\\hero\\skin.png", "skin.png"),
        ("mtllib a.mtl", "map_Kd hero%20skin.png", "hero skin.png"),
        ("mtllib sub\\a.mtl", "map_Kd textures\\skin.png", "textures/skin.png"),
    ],
)
def test_materials_are_found_as_exporters_name_them(tmp_path, libraries, mtl, picture):
    (tmp_path / "sub").mkdir()
    (tmp_path / "textures").mkdir()
    (tmp_path / "other.mtl").write_text("newmtl unused\nmap_Kd gone.png\n")
    (tmp_path / ("sub" if "sub" in libraries else ".") / "a.mtl").write_text(
        f"newmtl skin\nKd 1 1 1\n{mtl}\n"
    )
    (tmp_path / picture).write_bytes(png())
    (tmp_path / "a.obj").write_text(f"{libraries}\n{TRIANGLE}")
    texture = surface_of_scene(read_scene(tmp_path / "a.obj")).materials[0].texture
    assert texture is not None and texture.pixels.shape == (5, 5, 4)


@pytest.mark.parametrize(
    "mtl, message",
    [
        (None, r"a\.mtl, which is not in its folder"),
        ("newmtl skin\nmap_Kd gone.png", r"gone\.png, which is not in its folder"),
        ("newmtl skin\nmap_Kd broken.png", r"picture broken\.png: can not be read"),
        ("newmtl hair\nKd 1 1 1", "material skin, which a.mtl does not hold"),
        ("newmtl skin\nmap_Kd -s 2 2 1 skin.png", "material skin: the option -s of map_Kd"),
    ],
)
def test_what_is_missing_is_named(tmp_path, mtl, message):
    if mtl:
        (tmp_path / "a.mtl").write_text(mtl)
    (tmp_path / "broken.png").write_bytes(b"none")
    Image.new("RGB", (2, 2)).save(tmp_path / "skin.png")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{TRIANGLE}")
    with pytest.raises(DataError, match=message) as caught:
        read_scene(tmp_path / "a.obj")
    assert str(caught.value).startswith(str(tmp_path / "a.obj"))


def test_materials_that_no_file_is_named_for_stay_plain(tmp_path):
    (tmp_path / "a.obj").write_text(TRIANGLE)
    assert len(seen(tmp_path / "a.obj")) == 1
