"""One character made of its drawings, with all files that are taken away, then looked at. Runs in a process of its own."""

import io
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import final

import numpy as np
import torch
from PIL import Image

from charnerf.app.answers import Level, Product
from charnerf.app.figures import Figure, in_order
from charnerf.app.recognizer import given_drawings, reading_options
from charnerf.app.settings import FORMATS, Plan
from charnerf.errors import DependencyError
from charnerf.inference.hero import Hero
from charnerf.inference.model import Model
from charnerf.meshing.build import finish_mesh
from charnerf.meshing.export import save_mesh
from charnerf.progress import Progress
from charnerf.reconstruction.folder import Reconstruction, reconstruct
from charnerf.reconstruction.quality import quality_words
from charnerf.reconstruction.report import mesh_words


@final
class Builder:
    """Makes a character and then answers how it looks.

    Args:
        load: Gives the model.
    """

    def __init__(self, load: Callable[[], Model]) -> None:
        self.load = load
        self.baked: Hero | None = None
        self.turning: Hero | None = None

    def build(self, figures: Sequence[Figure], plan: Plan, folder: Path) -> Product:
        """Make the character's files.

        Raises:
            DataError: If the drawings can not be used.
            NumericalError: If the field is empty or not finite.
        """
        given = given_drawings(in_order(figures))
        done = reconstruct(self.load(), folder, plan.options, given, reading=reading_options(plan.reading))
        self.baked, self.turning = done.baked, done.baked.turning()
        levels, notes = _other_files(done, plan, folder)
        files = {
            "mesh.glb": "GLB: Blender, engines",
            "mesh_obj.zip": "OBJ, MTL and texture",
            "mesh.usdz": "USDZ: Apple, Omniverse",
            "levels.zip": "Levels of detail, GLB",
            done.turntable.name: "Turntable",
            "sheet.png": "Model sheet",
            "report.html": "Report",
        }
        return Product(
            files={name: what for name, what in files.items() if (folder / name).is_file()},
            levels=levels,
            film=done.turntable.name,
            quality=quality_words(done.quality),
            mesh=mesh_words(done.built),
            suggestions=done.suggestions,
            notes=notes,
            seconds=done.seconds,
        )

    def look(self, *, azimuth_deg: float, elevation_deg: float, size: int, moving: bool) -> bytes:
        """A picture of the field as PNG, RGBA; one of many while it moves is less exact."""
        assert self.baked is not None and self.turning is not None  # nobody looks before it is built
        hero = self.turning if moving else self.baked
        picture = hero.render(azimuth_deg=azimuth_deg, elevation_deg=elevation_deg, size=size)
        content = io.BytesIO()
        pixels = np.rint(255.0 * picture).astype(np.uint8)
        Image.fromarray(pixels).save(content, format="PNG", compress_level=1)
        return content.getvalue()


def _other_files(done: Reconstruction, plan: Plan, folder: Path) -> tuple[tuple[Level, ...], tuple[str, ...]]:
    """Write the mesh for other programs, and its levels of detail; what could not be written is said."""
    notes = []
    costs = {"formats": FORMATS, "levels": plan.seconds[1] - FORMATS}
    with Progress("files", costs, in_seconds=True) as progress:
        obj = folder / "obj"
        obj.mkdir()
        save_mesh(done.built.mesh, obj / "mesh.obj")
        _zip(folder / "mesh_obj.zip", {piece.name: piece for piece in sorted(obj.iterdir())})
        try:
            save_mesh(done.built.mesh, folder / "mesh.usdz")
        except DependencyError as error:
            notes.append(f"There is no USDZ file: {error}")
        levels = [Level("mesh.glb", len(done.built.surface.faces))]
        if plan.levels:
            progress.stage("levels")
            levels += _levels(done, plan, folder, progress.counter(len(plan.levels)))
            lods = {f"mesh_LOD{number}.glb": folder / level.file for number, level in enumerate(levels)}
            _zip(folder / "levels.zip", lods)
    return tuple(levels), tuple(notes)


@torch.no_grad()
def _levels(done: Reconstruction, plan: Plan, folder: Path, on_step: Callable[[], object]) -> list[Level]:
    """Write levels of detail: the mesh's own surface, decimated further and painted each for itself."""
    hero, options = done.hero, plan.options.mesh
    levels = []
    for number, faces in enumerate(plan.levels, start=1):
        built = finish_mesh(
            hero.scene,
            done.built.found,
            hero.views if hero.detailed is None else hero.detailed,
            replace(options, faces=faces),
        )
        save_mesh(built.mesh, folder / f"mesh_LOD{number}.glb")
        levels.append(Level(f"mesh_LOD{number}.glb", len(built.surface.faces)))
        on_step()
    return levels


def _zip(file: Path, pieces: Mapping[str, Path]) -> None:
    """Write files into one archive, by the names that they get there."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, piece in pieces.items():
            archive.write(piece, name)
