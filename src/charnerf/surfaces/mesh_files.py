"""mesh/ of a character: OBJ, MTL and PNG files in the world frame, written and read.

Own dialect of OBJ, which other programs read too: every `v` carries x y z and an sRGB colour, every `usemtl` begins a
part; Kd is sRGB; a factor on a texture is multiplied into its picture; a picture with alpha cuts out below one half. Mind
that the axes are the world's (Z up, facing -Y), where most programs take OBJ as Y up.
"""

from pathlib import Path

import numpy as np
from PIL import Image

from charnerf.errors import DataError
from charnerf.files import inside, open_regular
from charnerf.pictures import open_picture
from charnerf.surfaces.color import linear_from_srgb, srgb_from_linear
from charnerf.surfaces.scene_files import read_scene
from charnerf.surfaces.scene_mesh import placed_meshes, surface_of_scene
from charnerf.surfaces.surface_mesh import CUTOFF, SurfaceMaterial, SurfaceMesh, Texture, make_texture

_HEADER = "# charnerf mesh 1: metres, +Z up, facing -Y; v x y z r g b with sRGB colours\n"


def write_surface_mesh(mesh_file: Path, mesh: SurfaceMesh) -> None:
    """Write a surface as OBJ, with its MTL and PNG files beside it.

    Args:
        mesh_file: The OBJ to write, in a folder of its own.
        mesh: The surface.
    """
    materials = [_file_material(material) for material in mesh.materials]
    _write_materials(mesh_file, materials)
    colors = np.concatenate((srgb_from_linear(mesh.colors[..., :3]), mesh.colors[..., 3:]), axis=-1)
    corners = np.concatenate((mesh.triangles, colors[..., :3]), axis=-1).reshape(-1, 6)
    vertices, vertex_of = np.unique(np.round(corners, 6), axis=0, return_inverse=True)
    uvs, uv_of = np.unique(np.round(mesh.uvs.reshape(-1, 2), 6), axis=0, return_inverse=True)
    indices = np.stack((vertex_of.reshape(-1), uv_of.reshape(-1)), axis=-1).reshape(-1, 6) + 1
    lines = [_HEADER, f"mtllib {mesh_file.with_suffix('.mtl').name}\n"]
    lines += [("v" + " {:.6f}" * 6 + "\n").format(*row) for row in vertices.tolist()]
    lines += ["vt {:.6f} {:.6f}\n".format(*row) for row in uvs.tolist()]
    for index in range(len(materials)):
        lines.append(f"o part_{index}\nusemtl material_{index}\n")
        rows = indices[mesh.material_ids == index].tolist()
        lines += ["f {}/{} {}/{} {}/{}\n".format(*row) for row in rows]
    mesh_file.write_text("".join(lines), encoding="ascii")


def load_surface_mesh(mesh_file: str | Path) -> SurfaceMesh:
    """Read the mesh of a data set's character, which stands in the world frame.

    Args:
        mesh_file: As `Character.mesh_file` names it; ours, or any that trimesh reads, in world axes.

    Raises:
        DataError: If it is missing, unreadable, without faces or not finite.
    """
    mesh_file = Path(mesh_file)
    if not mesh_file.is_file():
        raise DataError(
            f"{mesh_file}: no such file; capture the character again, or train without its surface."
        )
    try:
        with open_regular(mesh_file) as file:
            ours = file.readline(len(_HEADER) + 1) == _HEADER.encode()
        mesh = _read_ours(mesh_file) if ours else _read_foreign(mesh_file)
    except DataError:
        raise
    except Exception as err:  # trimesh's readers and number parsing raise every kind
        raise DataError(
            f"{mesh_file}: can not be read as a mesh ({type(err).__name__}: {err}); capture it again."
        ) from err
    if not np.isfinite(mesh.triangles).all():
        raise DataError(
            f"{mesh_file}: holds vertices that are not finite, expected numbers; capture it again."
        )
    return mesh


def _file_material(material: SurfaceMaterial) -> SurfaceMaterial:
    """The material as the file can say it: no factor beside a texture, cut-outs at one half."""
    texture, factor = material.texture, material.factor
    if texture is None:
        alpha = 1.0 if material.cutoff is None or factor[3] >= material.cutoff else 0.0
        return SurfaceMaterial(factor=np.array((*factor[:3], alpha), np.float32))
    linear = texture.levels[0] * factor
    rgb = np.rint(255.0 * srgb_from_linear(linear[..., :3])).astype(np.uint8)
    pixels = texture.pixels.copy()
    if np.any(factor[:3] != 1.0):
        pixels[..., :3] = rgb
    if material.cutoff is None:
        pixels[..., 3] = 255
    else:
        alpha = np.clip(linear[..., 3] * (CUTOFF / max(material.cutoff, 1e-3)), 0.0, 1.0)
        pixels[..., 3] = np.rint(255.0 * alpha)
    return SurfaceMaterial(
        factor=np.ones(4, np.float32), texture=Texture(levels=(), pixels=pixels), cutoff=material.cutoff
    )


def _write_materials(mesh_file: Path, materials: list[SurfaceMaterial]) -> None:
    names: dict[bytes, str] = {}
    lines = []
    for index, material in enumerate(materials):
        kd = srgb_from_linear(material.factor[:3].astype(np.float64))
        lines.append(f"newmtl material_{index}\nKd {kd[0]:.6f} {kd[1]:.6f} {kd[2]:.6f}\nillum 0\n")
        if material.factor[3] < CUTOFF:
            lines.append("d 0\n")
        if material.texture is None:
            continue
        pixels = material.texture.pixels
        key = repr(pixels.shape).encode() + pixels.tobytes()
        if key not in names:
            names[key] = f"texture_{len(names)}.png"
            channels = 3 if material.cutoff is None else 4
            Image.fromarray(np.ascontiguousarray(pixels[..., :channels])).save(
                mesh_file.with_name(names[key])
            )
        lines.append(f"map_Kd {names[key]}\n")
        if material.cutoff is not None:
            lines.append(f"map_d {names[key]}\n")
    mesh_file.with_suffix(".mtl").write_text("".join(lines), encoding="ascii")


def _read_ours(mesh_file: Path) -> SurfaceMesh:
    lines = mesh_file.read_text(encoding="ascii").splitlines()
    vertices = _numbers([line[2:] for line in lines if line.startswith("v ")], 6)
    uvs = _numbers([line[3:] for line in lines if line.startswith("vt ")], 2)
    by_name = _read_materials(inside(mesh_file.parent, mesh_file.with_suffix(".mtl").name, str(mesh_file)))
    faces, names, counts = [], [], []
    for line in lines:
        if line.startswith("usemtl "):
            names.append(line[7:])
            counts.append(0)
        elif line.startswith("f "):
            faces.append(line[2:].replace("/", " "))
            counts[-1] += 1
    if not faces:
        raise DataError(f"{mesh_file}: found no faces, expected triangles; capture the character again.")
    missing = sorted(set(names) - set(by_name))
    if missing:
        raise DataError(
            f"{mesh_file.with_suffix('.mtl')}: has no material {', '.join(missing)}; capture again."
        )
    corners = _numbers(faces, 6).astype(np.int64).reshape(-1, 3, 2) - 1
    points = vertices[corners[..., 0]]
    colors = np.ones((len(points), 3, 4), np.float32)
    colors[..., :3] = linear_from_srgb(points[..., 3:])
    return SurfaceMesh(
        triangles=points[..., :3].astype(np.float32),
        uvs=uvs[corners[..., 1]].astype(np.float32),
        colors=colors,
        material_ids=np.repeat(np.arange(len(names), dtype=np.int32), counts),
        materials=tuple(by_name[name] for name in names),
    )


def _numbers(rows: list[str], width: int) -> np.ndarray:
    return np.array(" ".join(rows).split(), dtype=np.float64).reshape(-1, width)


def _read_materials(file: Path) -> dict[str, SurfaceMaterial]:
    if not file.is_file():
        raise DataError(f"{file}: no such file, named by the OBJ beside it; capture the character again.")
    entries: dict[str, dict[str, str]] = {}
    current: dict[str, str] = {}
    for line in file.read_text(encoding="ascii").splitlines():
        key, _, value = line.partition(" ")
        if key == "newmtl":
            current = entries.setdefault(value, {})
        else:
            current[key] = value
    textures: dict[str, Texture] = {}
    return {name: _read_material(file, entry, textures) for name, entry in entries.items()}


def _read_material(file: Path, entry: dict[str, str], textures: dict[str, Texture]) -> SurfaceMaterial:
    kd = np.array(entry.get("Kd", "1 1 1").split(), dtype=np.float64)
    hidden = entry.get("d") == "0"
    factor = np.array((*linear_from_srgb(kd), 0.0 if hidden else 1.0), np.float32)
    picture = entry.get("map_Kd")
    if picture is None:
        return SurfaceMaterial(factor=factor, cutoff=CUTOFF if hidden else None)
    if picture not in textures:
        with open_picture(inside(file.parent, picture, str(file))) as image:
            textures[picture] = make_texture(np.array(image.convert("RGBA")))
    return SurfaceMaterial(
        factor=factor, texture=textures[picture], cutoff=CUTOFF if "map_d" in entry else None
    )


def _read_foreign(mesh_file: Path) -> SurfaceMesh:
    scene = read_scene(mesh_file)
    if not placed_meshes(scene):
        raise DataError(f"{mesh_file}: found no faces, expected triangles; capture the character again.")
    return surface_of_scene(scene)
