"""Drawings to a folder: mesh.glb, turntable.mp4, views and report.html."""

import json
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from charnerf.drawings.options import ReadingOptions
from charnerf.drawings.read_sheet import SheetViews
from charnerf.drawings.turnaround import Picture, Turnaround
from charnerf.drawings.viewpoints import Viewpoint
from charnerf.files import check_folder, write_folder_aside
from charnerf.finetuning.command import refine
from charnerf.finetuning.finetune import Finetuned
from charnerf.finetuning.report import plot_curve, summary_lines
from charnerf.inference.baked_file import save_baked
from charnerf.inference.hero import Hero
from charnerf.inference.model import Model
from charnerf.meshing.build import BuiltMesh
from charnerf.meshing.export import save_mesh
from charnerf.meshing.sheet import contact_sheet
from charnerf.pictures import bytes_on_white
from charnerf.progress import Progress
from charnerf.reconstruction.model_sheet import model_sheet
from charnerf.reconstruction.options import ReconstructionOptions
from charnerf.reconstruction.progress import meter, reconstruction_stages
from charnerf.reconstruction.quality import Quality, measure, suggestions
from charnerf.reconstruction.report import Made, mesh_sentences, mesh_words, report_blocks, report_facts
from charnerf.reconstruction.turntable import render_around, write_film
from charnerf.reporting.document import write_report

MOST_VIEWS = 12


@dataclass(frozen=True)
class Reconstruction:
    """Files of one reconstructed character, and what looked wrong in its drawings.

    Attributes:
        mesh: mesh.glb.
        turntable: turntable.mp4 or turntable.gif.
        views: PNG files with alpha, by azimuth.
        report: report.html; report.md and report.json lie beside it.
        hero: The character that the mesh was made of: refined and symmetric where that was asked for.
        baked: The same, to be looked at often.
        built: The mesh and how it came about.
        quality: What it is worth.
        suggestions: What may make it better.
        facts: The content of report.json.
        warnings: What looked wrong, sentences.
        seconds: By stage.
    """

    mesh: Path
    turntable: Path
    views: tuple[Path, ...]
    report: Path
    hero: Hero
    baked: Hero
    built: BuiltMesh
    quality: Quality
    suggestions: tuple[str, ...]
    facts: dict[str, Any]
    warnings: tuple[str, ...]
    seconds: dict[str, float]


def reconstruct(
    model: Model,
    output: Path,
    options: ReconstructionOptions,
    given: Mapping[Viewpoint, Picture],
    *,
    reading: ReadingOptions | None = None,
    sheet: SheetViews | None = None,
    say: Callable[[str], object] = lambda line: None,
) -> Reconstruction:
    """Reconstruct a character from drawings into a folder.

    Everything is written aside and then moved into the folder: a piece is there whole or not at all. Pieces
    of an earlier reconstruction are replaced, other files of the folder stay.

    Args:
        model: Loaded, on its device.
        output: Folder; made if missing.
        options: What is made.
        given: Drawings by where they are seen from; where they disagree, the first rules.
        reading: How the drawings are read.
        sheet: The sheet that they were found on, told in the report; None where there was none.
        say: Gets what was assumed and made, sentence by sentence.

    Raises:
        DataError: If a drawing can not be used, or the folder can not be written.
        NumericalError: If the field is empty or not finite.
    """
    check_folder(output)
    seconds: dict[str, float] = {}
    with Progress("reconstruct", reconstruction_stages(options), in_seconds=True) as progress:
        with _timed(seconds, "encode"):
            hero, drawings = _encoded(model, given, reading, say)
        hero, refined = _refined(model, hero, options.refine_seconds, seconds, say, progress)
        hero = hero.symmetric() if options.symmetric else hero
        baked, pictures, built = _pictures_and_mesh(hero, options, seconds, progress)
        progress.stage("files")
        with write_folder_aside(output) as folder:
            made = _write(
                folder, pictures, built, drawings, sheet, refined, seconds, model.source.name, options
            )
    for line in (f"{mesh_words(built)}.", *mesh_sentences(built)):
        say(line)
    for other in {"turntable.mp4", "turntable.gif"} - {made.film.name}:  # of a reconstruction before
        (output / other).unlink(missing_ok=True)
    return _moved(made, output, hero, baked)


def _moved(made: Made, output: Path, hero: Hero, baked: Hero) -> Reconstruction:
    """What was made, its files where they lie in the end."""
    return Reconstruction(
        mesh=output / "mesh.glb",
        turntable=output / made.film.name,
        views=tuple(output / "views" / view.name for view in made.views),
        report=output / "report.html",
        hero=hero,
        baked=baked,
        built=made.built,
        quality=made.quality,
        suggestions=tuple(made.suggestions),
        facts=report_facts(made),
        warnings=made.warnings,
        seconds=made.seconds,
    )


@contextmanager
def _timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Note how long a stage took."""
    start = time.perf_counter()
    yield
    seconds[stage] = time.perf_counter() - start


def _encoded(
    model: Model,
    given: Mapping[Viewpoint, Picture],
    reading: ReadingOptions | None,
    say: Callable[[str], object],
) -> tuple[Hero, Turnaround]:
    """The character, and its drawings as they were read."""
    hero = model.encode_drawings(given, reading)
    drawings = hero.turnaround
    assert drawings is not None  # encode made it
    for line in (*drawings.assumptions, *(f"warning: {one}" for one in drawings.warnings)):
        say(line)
    return hero, drawings


def _refined(
    model: Model,
    hero: Hero,
    time_limit: float | None,
    seconds: dict[str, float],
    say: Callable[[str], object],
    progress: Progress,
) -> tuple[Hero, Finetuned | None]:
    """The character by weights adapted to its drawings, where there is time for that, and how they were adapted."""
    if time_limit is None:
        return hero, None
    progress.stage("refine")
    with _timed(seconds, "refine"):
        refined = refine(model, hero, time_limit, progress=progress)
    for line in summary_lines(refined):
        say(line)
    return refined.hero, refined


def _pictures_and_mesh(
    hero: Hero, options: ReconstructionOptions, seconds: dict[str, float], progress: Progress
) -> tuple[Hero, list[np.ndarray], BuiltMesh]:
    """The character to be looked at often, pictures of it from around, RGBA uint8, and the mesh."""
    progress.stage("bake")
    with _timed(seconds, "bake"):
        baked = hero.baked(on_share=progress.update)
        if options.bake is not None:
            save_baked(options.bake, baked)
    progress.stage("pictures")
    with _timed(seconds, f"{options.frames} frames of {options.size} pixels"):
        on_frame = progress.counter(options.frames)
        pictures = render_around(baked, options.frames, options.size, on_frame=on_frame)
    progress.stage("mesh")
    with _timed(seconds, "mesh"):
        built = hero.build_mesh(options.mesh, on_points=meter(progress, (options.mesh.resolution,)))
    return baked, pictures, built


def _write(
    folder: Path,
    pictures: list[np.ndarray],
    built: BuiltMesh,
    drawings: Turnaround,
    sheet: SheetViews | None,
    refined: Finetuned | None,
    seconds: dict[str, float],
    weights: str,
    options: ReconstructionOptions,
) -> Made:
    """Write mesh, turntable, views and report."""
    save_mesh(built.mesh, folder / "mesh.glb")
    (folder / "meshes").mkdir()
    contact_sheet(built.mesh, drawings.detailed).save(folder / "meshes" / "mesh_sheet.png")
    film, film_note = write_film([bytes_on_white(picture) for picture in pictures], folder)
    views = _write_views(pictures, folder / "views")
    Image.fromarray(drawings.picture).save(folder / "drawings.png")
    model_sheet(drawings, pictures).save(folder / "sheet.png")
    if sheet is not None:
        Image.fromarray(sheet.picture).save(folder / "sheet_as_read.png")
    if refined is not None:
        plot_curve(refined, folder / "refinement.png")
    quality = measure(built, drawings, pictures, height=options.mesh.height)
    made = Made(
        folder=folder,
        drawings=drawings,
        built=built,
        quality=quality,
        suggestions=suggestions(quality, options, num_drawings=len(drawings.names)),
        film=film,
        film_note=film_note,
        views=views,
        seconds=seconds,
        weights=weights,
        refined=refined,
        sheet=sheet,
    )
    write_report(folder, "Reconstructed character", report_blocks(made))
    (folder / "report.json").write_text(json.dumps(report_facts(made), indent=2) + "\n", encoding="utf-8")
    return made


def _write_views(pictures: list[np.ndarray], folder: Path) -> list[Path]:
    """Write up to MOST_VIEWS of the frames, evenly chosen, as PNG files named by azimuth."""
    folder.mkdir()
    paths = []
    for index in range(0, len(pictures), -(-len(pictures) // MOST_VIEWS)):
        path = folder / f"{360.0 * index / len(pictures):03.0f}.png"
        Image.fromarray(pictures[index]).save(path)
        paths.append(path)
    return paths
