"""One character's mesh, or its levels of detail, as files with a contact sheet and a table."""

import json
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from charnerf.files import write_text
from charnerf.geometry.framing import HEIGHT
from charnerf.inference.hero import TEXTURE_SIZE, Hero, TextureKind
from charnerf.meshing.convergence import convergence_lines, measure_convergence
from charnerf.meshing.export import TEXTURED_SUFFIXES, save_mesh
from charnerf.meshing.lod import Lod, lod_report, named
from charnerf.meshing.sheet import contact_sheet
from charnerf.reconstruction.progress import BAR, meter
from charnerf.reconstruction.report import level_lines, mesh_sentences, mesh_words

STEPS = 20.0  # of the progress bar


@dataclass(frozen=True)
class MeshRequest:
    """What meshes are wanted.

    Attributes:
        resolutions: Grid points along the longest side, of each grid.
        faces: Faces of decimated meshes; with one grid and one number, the only mesh has so many.
        are_levels: Whether they are levels of detail even if there is but one grid.
        num_cameras: Cameras whose directions the density is averaged over.
        smooth: Rounds of smoothing.
        symmetric: Whether densities are averaged over left and right.
        convergence: Whether it is measured how many cameras are needed: NAME_cameras.md.
        height: Of each, m.
        texture: vertex, drawings or field.
        texture_size: Texels a side.
        suffix: File format, such as "glb".
    """

    resolutions: tuple[int, ...]
    faces: tuple[int, ...] = ()
    are_levels: bool = False
    num_cameras: int = 8
    smooth: int = 0
    symmetric: bool = False
    convergence: bool = False
    height: float = HEIGHT
    texture: TextureKind = "vertex"
    texture_size: int = TEXTURE_SIZE
    suffix: str = "glb"

    @property
    def is_single(self) -> bool:
        """Whether one mesh is wanted, not levels of detail."""
        return not self.are_levels and len(self.resolutions) == 1 and len(self.faces) <= 1


@dataclass(frozen=True)
class MeshFiles:
    """What was written.

    Attributes:
        meshes: Mesh files; levels of detail from the finest on.
        sheet: The contact sheet.
        lods: The levels by file name; empty for a single mesh.
        said: What was assumed and made, sentences.
    """

    meshes: tuple[Path, ...]
    sheet: Path
    lods: dict[str, Lod]
    said: tuple[str, ...]


def write_meshes(hero: Hero, name: str, output: Path, request: MeshRequest) -> MeshFiles:
    """Write a character's mesh: OUTPUT/NAME.glb, or NAME_LOD0.glb and so on with lods.md and lods.json.

    Args:
        hero: The character.
        name: Its name.
        output: Folder; made if missing.
        request: What is wanted.

    Raises:
        DataError: If an argument is out of range or the hull empty.
        DependencyError: If the format needs a library that is missing.
        NumericalError: If the field is empty or not finite.
    """
    hero = hero.symmetric() if request.symmetric else hero
    found = _made(hero, name, request)
    output.mkdir(parents=True, exist_ok=True)
    paths = tuple(
        save_mesh(lod.built.mesh, output / f"{file}.{request.suffix}") for file, lod in found.items()
    )
    first = next(iter(found.values())).built
    sheet = output / f"{name}_sheet.png"
    contact_sheet(first.mesh, hero.views).save(sheet)
    said = [f"{path}: {mesh_words(lod.built)}." for path, lod in zip(paths, found.values(), strict=True)]
    said += mesh_sentences(first)
    if request.texture != "vertex" and f".{request.suffix}" not in TEXTURED_SUFFIXES:
        said.append(f"{request.suffix.upper()} carries no texture: the vertices got its colours.")
    if request.convergence:
        lines = [f"# {name}: level and cameras", "", *level_lines(first), ""]
        lines += convergence_lines(measure_convergence(hero.scene, hero.views, level=first.level))
        write_text(output / f"{name}_cameras.md", "\n".join(lines))
        said += [line for line in lines if line]
    if request.is_single:
        return MeshFiles(paths, sheet, {}, tuple(said))
    write_text(output / "lods.md", lod_report(found))
    rows = [{"file": file, **lod.row()} for file, lod in found.items()]
    write_text(output / "lods.json", json.dumps(rows, indent=2) + "\n")
    return MeshFiles(paths, sheet, found, tuple(said))


def _made(hero: Hero, name: str, request: MeshRequest) -> dict[str, Lod]:
    """The meshes by file name, with a progress bar."""
    with tqdm(total=STEPS, desc=name, bar_format=BAR) as bar:
        lods = hero.lods(
            resolutions=request.resolutions,
            faces=request.faces,
            num_cameras=request.num_cameras,
            smooth=request.smooth,
            height=request.height,
            texture=request.texture,
            texture_size=request.texture_size,
            decimated_only=request.is_single and bool(request.faces),
            on_points=meter(bar, request.resolutions, 0.8 * STEPS),
        )
        bar.update((bar.total or 0) - bar.n)
    return {name: lods[0]} if request.is_single else named(lods, name)
