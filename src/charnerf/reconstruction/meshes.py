"""One character's mesh, or its levels of detail, as files with a contact sheet and a table."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from charnerf.files import write_text
from charnerf.inference.hero import Hero
from charnerf.meshing.build import BuiltMesh
from charnerf.meshing.convergence import convergence_lines, measure_convergence
from charnerf.meshing.export import TEXTURED_SUFFIXES, save_mesh
from charnerf.meshing.lod import Lod, lod_report, named
from charnerf.meshing.options import MeshOptions
from charnerf.meshing.sheet import contact_sheet
from charnerf.progress import Progress
from charnerf.reconstruction.progress import mesh_seconds, meter
from charnerf.reconstruction.report import mesh_sentences, mesh_words


@dataclass(frozen=True)
class MeshFiles:
    """What was written.

    Attributes:
        meshes: Mesh files; levels of detail from the finest on.
        built: The mesh, the finest of several.
        sheet: The contact sheet.
        notes: What was assumed and made, sentences.
        lods: The levels by file name; empty for a single mesh.
    """

    meshes: tuple[Path, ...]
    built: BuiltMesh
    sheet: Path
    notes: tuple[str, ...]
    lods: dict[str, Lod] = field(default_factory=dict)


def write_mesh(
    hero: Hero, name: str, output: Path, options: MeshOptions, *, suffix: str = "glb"
) -> MeshFiles:
    """Write a character's mesh, OUTPUT/NAME.glb, and a contact sheet.

    Args:
        hero: The character.
        name: Its name.
        output: Folder; made if missing.
        options: How the mesh is made.
        suffix: File format.

    Raises:
        DataError: If the hull is empty, or there are too many faces for a texture.
        DependencyError: If the format needs a library that is missing.
        NumericalError: If the field is empty or not finite.
    """
    with Progress(name, {name: mesh_seconds(options)}, in_seconds=True) as progress:
        built = hero.build_mesh(options, on_points=meter(progress, (options.resolution,)))
    return _write(hero, name, output, {name: built}, suffix)


def write_lods(
    hero: Hero,
    name: str,
    output: Path,
    options: MeshOptions,
    *,
    resolutions: Sequence[int],
    faces: Sequence[int] = (),
    suffix: str = "glb",
) -> MeshFiles:
    """Write a character's levels of detail, OUTPUT/NAME_LOD0.glb and so on, with lods.md, lods.json and a contact sheet.

    Args:
        hero: The character.
        name: Its name.
        output: Folder; made if missing.
        options: How each mesh is made, grid and faces aside.
        resolutions: Grids, points along the longest side.
        faces: Faces to decimate the finest grid's surface to.
        suffix: File format.

    Raises:
        ConfigError: If a grid or a number of faces is out of range.
        DataError: As of `write_mesh`, and NumericalError and DependencyError.
    """
    seconds = sum(mesh_seconds(replace(options, resolution=one, faces=None)) for one in resolutions)
    with Progress(name, {name: seconds}, in_seconds=True) as progress:
        levels = hero.lods(
            options, resolutions=resolutions, faces=faces, on_points=meter(progress, resolutions)
        )
    lods = named(levels, name)
    files = _write(hero, name, output, {file: lod.built for file, lod in lods.items()}, suffix)
    write_text(output / "lods.md", lod_report(lods))
    rows = [{"file": file, **lod.row()} for file, lod in lods.items()]
    write_text(output / "lods.json", json.dumps(rows, indent=2) + "\n")
    return replace(files, lods=lods)


def _write(hero: Hero, name: str, output: Path, meshes: dict[str, BuiltMesh], suffix: str) -> MeshFiles:
    """Write meshes by file name and the sheet of the first."""
    output.mkdir(parents=True, exist_ok=True)
    paths = [save_mesh(built.mesh, output / f"{file}.{suffix}") for file, built in meshes.items()]
    first = next(iter(meshes.values()))
    sheet = output / f"{name}_sheet.png"
    contact_sheet(first.mesh, hero.views).save(sheet)
    notes = [f"{path}: {mesh_words(built)}." for path, built in zip(paths, meshes.values(), strict=True)]
    notes += mesh_sentences(first)
    if first.textured is not None and f".{suffix}" not in TEXTURED_SUFFIXES:
        notes.append(f"{suffix.upper()} carries no texture: the vertices got its colours.")
    return MeshFiles(tuple(paths), first, sheet, tuple(notes))


def write_convergence(hero: Hero, name: str, output: Path) -> tuple[str, ...]:
    """Measure how many cameras a mesh needs: OUTPUT/NAME_cameras.md; its lines."""
    lines = [f"# {name}: cameras", "", *convergence_lines(measure_convergence(hero.scene))]
    write_text(output / f"{name}_cameras.md", "\n".join(lines))
    return tuple(line for line in lines if line)
