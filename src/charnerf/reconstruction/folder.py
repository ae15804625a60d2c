"""Three drawings to a folder: mesh.glb, turntable.mp4, views and report.md."""

import shutil
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image
from tqdm import tqdm

from charnerf.errors import DataError
from charnerf.finetuning.command import refine
from charnerf.finetuning.report import plot_curve, summary_lines
from charnerf.geometry.framing import HEIGHT
from charnerf.inference.hero import TEXTURE_SIZE, TextureKind
from charnerf.inference.model import Model
from charnerf.meshing.build import BuiltMesh
from charnerf.meshing.export import save_mesh
from charnerf.meshing.sheet import contact_sheet
from charnerf.pictures import bytes_on_white
from charnerf.reconstruction.progress import BAR, meter
from charnerf.reconstruction.report import mesh_sentences, mesh_words, report_text
from charnerf.reconstruction.turntable import render_around, write_film

MOST_VIEWS = 12
MESH_STEPS = 12  # of the progress bar, beside one a frame: what a mesh takes, about


@dataclass(frozen=True)
class Reconstruction:
    """Files of one reconstructed character, and what looked wrong in its drawings.

    Attributes:
        mesh: mesh.glb.
        turntable: turntable.mp4 or turntable.gif.
        views: PNG files with alpha, by azimuth.
        report: report.md.
        built: The mesh and how it came about.
        warnings: Sentences.
        seconds: By stage.
    """

    mesh: Path
    turntable: Path
    views: tuple[Path, ...]
    report: Path
    built: BuiltMesh
    warnings: tuple[str, ...]
    seconds: dict[str, float]


def reconstruct(
    model: Model,
    *,
    front: Path,
    side: Path,
    back: Path,
    output: Path,
    side_is: Literal["left", "right"] = "left",
    resolution: int = 128,
    faces: int = 8000,
    frames: int = 36,
    size: int = 160,
    num_cameras: int = 8,
    smooth: int = 0,
    symmetric: bool = False,
    refine_seconds: float | None = None,
    height: float = HEIGHT,
    texture: TextureKind = "drawings",
    texture_size: int = TEXTURE_SIZE,
) -> Reconstruction:
    """Reconstruct a character from three drawings into a folder.

    Everything is written aside and then moved into the folder: a piece is there whole or not at all. Pieces
    of an earlier reconstruction are replaced, other files of the folder stay.

    Args:
        model: Loaded, on its device.
        front: Front drawing.
        side: Side drawing.
        back: Back drawing.
        output: Folder; made if missing.
        side_is: Which side of the character the side drawing shows.
        resolution: Grid points along the mesh's longest side.
        faces: Faces of the mesh.
        frames: Frames of the turntable.
        size: Side of pictures, pixels; 36 of 160 take half a minute on two cores.
        num_cameras: Cameras whose directions the density is averaged over.
        smooth: Rounds of smoothing of the mesh.
        symmetric: Average densities over left and right, for mesh and views.
        refine_seconds: Time in which the multi-view blocks are adapted to the drawings first; None leaves it.
        height: Of the mesh, m.
        texture: Where the mesh's colours come from: drawings, field or vertex.
        texture_size: Texels a side.

    Raises:
        DataError: If a drawing can not be used, or the folder can not be written.
        NumericalError: If the field is empty or not finite.
    """
    if output.exists() and not output.is_dir():
        raise DataError(f"{output}: found a file, expected a folder to write to. Choose another.")
    start = time.perf_counter()
    hero = model.encode(front=front, side=side, back=back, side_is=side_is)
    drawings = hero.turnaround
    assert drawings is not None  # encode made it
    for line in (*drawings.assumptions, *(f"warning: {one}" for one in drawings.warnings)):
        sys.stderr.write(f"{line}\n")
    encoded = time.perf_counter()
    refined = None if refine_seconds is None else refine(model, hero, refine_seconds)
    if refined is not None:
        hero = refined.hero
        sys.stderr.write("".join(f"{line}\n" for line in summary_lines(refined)))
    hero = hero.symmetric() if symmetric else hero
    ready = time.perf_counter()
    with tqdm(total=float(frames + MESH_STEPS), desc="reconstruct", bar_format=BAR) as bar:
        pictures = render_around(hero, frames, size, on_frame=bar.update)
        rendered = time.perf_counter()
        built = hero.build_mesh(
            resolution=resolution,
            num_cameras=num_cameras,
            faces=faces,
            smooth=smooth,
            height=height,
            texture=texture,
            texture_size=texture_size,
            on_points=meter(bar, (resolution,), MESH_STEPS),
        )
        bar.update((bar.total or 0) - bar.n)
    for line in (f"{mesh_words(built)}.", *mesh_sentences(built)):
        sys.stderr.write(f"{line}\n")
    seconds = {
        "encode": encoded - start,
        **({} if refined is None else {"refine": ready - encoded}),
        f"{frames} frames of {size} pixels": rendered - ready,
        "mesh": time.perf_counter() - rendered,
    }
    output.parent.mkdir(parents=True, exist_ok=True)
    aside = Path(tempfile.mkdtemp(dir=output.parent, prefix=f".{output.name}."))
    try:
        save_mesh(built.mesh, aside / "mesh.glb")
        (aside / "meshes").mkdir()
        contact_sheet(built.mesh, drawings.detailed).save(aside / "meshes" / "mesh_sheet.png")
        film, film_note = write_film([bytes_on_white(picture) for picture in pictures], aside)
        views = _write_views(pictures, aside / "views")
        Image.fromarray(drawings.picture).save(aside / "drawings.png")
        if refined is not None:
            plot_curve(refined, aside / "refinement.png")
        text = report_text(
            drawings=drawings,
            built=built,
            film=film,
            film_note=film_note,
            views=views[:: max(1, len(views) // 4)],
            seconds=seconds,
            weights=model.source.name,
            refined=refined,
        )
        (aside / "report.md").write_text(text, encoding="utf-8")
        _move_into(aside, output)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
    return Reconstruction(
        mesh=output / "mesh.glb",
        turntable=output / film.name,
        views=tuple(output / "views" / view.name for view in views),
        report=output / "report.md",
        built=built,
        warnings=drawings.warnings,
        seconds=seconds,
    )


def _write_views(pictures: list[np.ndarray], folder: Path) -> list[Path]:
    """Write up to MOST_VIEWS of the frames, evenly chosen, as PNG files named by azimuth."""
    folder.mkdir()
    paths = []
    for index in range(0, len(pictures), -(-len(pictures) // MOST_VIEWS)):
        path = folder / f"{360.0 * index / len(pictures):03.0f}.png"
        Image.fromarray(pictures[index]).save(path)
        paths.append(path)
    return paths


def _move_into(aside: Path, folder: Path) -> None:
    """Move what was written aside into its place: at once where the folder is new, else piece by piece."""
    if not folder.exists():
        aside.chmod(0o755)
        aside.rename(folder)
        return
    for film in ("turntable.mp4", "turntable.gif"):
        if not (aside / film).exists():
            (folder / film).unlink(missing_ok=True)
    for piece in sorted(aside.iterdir()):
        target = folder / piece.name
        if target.is_dir() and not target.is_symlink():
            target.rename(aside.with_name(f"{aside.name}.old"))
            piece.replace(target)
            shutil.rmtree(aside.with_name(f"{aside.name}.old"))
        else:
            piece.replace(target)
