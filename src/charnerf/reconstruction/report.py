"""The report of a reconstruction: what was assumed, what was made, how good it is, how long it took."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from charnerf.drawings.read_sheet import SheetViews
from charnerf.drawings.turnaround import Turnaround
from charnerf.finetuning.finetune import Finetuned
from charnerf.finetuning.report import curve_table, summary_lines
from charnerf.meshing.build import BuiltMesh
from charnerf.meshing.optical_depth import LIGHT_GONE
from charnerf.reconstruction.quality import Quality, quality_words
from charnerf.reporting.blocks import (
    Block,
    Bullets,
    Files,
    Film,
    Heading,
    Mesh,
    Picture,
    SideBySide,
    Table,
    Text,
)
from charnerf.wording import counted

SHOWN_VIEWS = 4


@dataclass(frozen=True)
class Made:
    """What was made and how, as the report tells it.

    Attributes:
        folder: Where the files lie.
        drawings: What was assumed.
        built: The mesh, mesh.glb.
        quality: What it is worth.
        suggestions: What may make it better.
        film: The turntable's file.
        film_note: What is to be said about it, or None.
        views: Picture files by azimuth.
        seconds: By stage.
        weights: Where the model came from.
        refined: How the weights were adapted to the drawings, if they were.
        sheet: The sheet that they were found on, if they were; its picture lies beside.
    """

    folder: Path
    drawings: Turnaround
    built: BuiltMesh
    quality: Quality
    suggestions: Sequence[str]
    film: Path
    film_note: str | None
    views: Sequence[Path]
    seconds: dict[str, float]
    weights: str
    refined: Finetuned | None = None
    sheet: SheetViews | None = None

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What was assumed about the sheet, then about its drawings."""
        return (*(() if self.sheet is None else self.sheet.assumptions), *self.drawings.assumptions)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What looked wrong with the sheet, then with its drawings."""
        return (*(() if self.sheet is None else self.sheet.warnings), *self.drawings.warnings)


def report_blocks(made: Made) -> list[Block]:
    """The report, the result first; the files that it shows lie beside it."""
    shown = made.views[:: max(1, len(made.views) // SHOWN_VIEWS)][:SHOWN_VIEWS]
    blocks: list[Block] = [
        Heading("Reconstructed character", 1),
        Text(quality_words(made.quality), lead=True),
    ]
    blocks += [Bullets(made.suggestions)] if made.suggestions else []
    blocks += [Mesh(made.folder / "mesh.glb", f"The mesh, to be turned: {mesh_words(made.built)}")]
    blocks += [SideBySide([*(Picture(view, f"{int(view.stem)}°, rendered") for view in shown)])]
    blocks += [Film(made.film, f"Turntable{f': {made.film_note}' if made.film_note else ''}", made.views[0])]
    blocks += [
        Picture(made.folder / "sheet.png", "The drawings as the model took them, and the result all around")
    ]
    blocks += [
        Picture(
            made.folder / "meshes" / "mesh_sheet.png", "Drawings, and the mesh in its colours and as clay"
        )
    ]
    blocks += [*_drawings(made), *_quality(made.quality), *_files(made), *_mesh(made.built)]
    if made.refined is not None:
        blocks += [Heading("Refinement"), Bullets(summary_lines(made.refined))]
        blocks += [
            Picture(made.folder / "refinement.png", "Error against seconds"),
            curve_table(made.refined),
        ]
    stages = [(stage, f"{value:.1f}") for stage, value in made.seconds.items()]
    return [
        *blocks,
        Heading("Seconds"),
        Table(("stage", "seconds"), stages),
        Text(f"Weights: {made.weights}"),
    ]


def report_facts(made: Made) -> dict[str, Any]:
    """The figures of the report, for programs."""
    surface = made.built.surface
    return {
        "quality": made.quality.facts(),
        "suggestions": list(made.suggestions),
        "mesh": {
            "vertices": len(surface.vertices),
            "faces": len(surface.faces),
            "extents_m": [float(one) for one in surface.extents],
            "texture": None if made.built.textured is None else made.built.textured.size,
        },
        "assumptions": list(made.assumptions),
        "warnings": list(made.warnings),
        "seconds": made.seconds,
        "weights": made.weights,
        "refined": None if made.refined is None else made.refined.kept,
    }


def _drawings(made: Made) -> list[Block]:
    """What was assumed, drawn and said."""
    blocks: list[Block] = [Heading("What was assumed about the drawings")]
    if made.warnings:
        blocks.append(Bullets(made.warnings, warnings=True))
    if made.sheet is not None:
        blocks.append(
            Picture(made.folder / "sheet_as_read.png", "The sheet, its figures and what was left aside")
        )
    caption = "The drawings, cut out and aligned, and below, where any was moved, reconciled"
    return [*blocks, Picture(made.folder / "drawings.png", caption), Bullets(made.assumptions)]


def _quality(quality: Quality) -> list[Block]:
    """Outlines against every drawing, haze and what kind of surface it is."""
    rows = [(one.view, f"{one.given:.3f}", f"{one.reconciled:.3f}") for one in quality.silhouettes]
    return [
        Heading("How good it is"),
        Table(("drawing", "IoU with it as given", "IoU with it as reconciled"), rows),
        Text(
            "IoU: of the mesh's outline with the drawing's, 1 where they are one. What no drawing shows can not be checked here."
            " Haze: share of the pictures' figure that is neither clear nor opaque. A surface that is closed may still be frayed:"
            " holes through it and loose parts tell."
        ),
    ]


def _files(made: Made) -> list[Block]:
    """What lies beside the report."""
    entries = [
        ("mesh.glb", f"{mesh_words(made.built)}; metres, Y up, facing +Z"),
        (made.film.name, made.film_note or "the turntable"),
        ("meshes/mesh_sheet.png", "the mesh from all sides, beside the drawings"),
        ("sheet.png", "a model sheet of the result, the drawings above"),
        ("views", "pictures with alpha, named by azimuth in degrees"),
        ("report.json", "the figures of this report"),
    ]
    return [Heading("Files"), Files(entries)]


def mesh_words(built: BuiltMesh) -> str:
    """Counts and size of a mesh."""
    surface = built.surface
    width, depth, height = surface.extents
    closed = "closed" if surface.is_watertight else "not closed"
    size = f"{width:.2f} x {depth:.2f} x {height:.2f} m"
    counts = f"{len(surface.vertices)} vertices, {len(surface.faces)} faces, {closed}, {size}"
    if built.textured is None:
        return f"{counts}; vertex colours"
    return f"{counts}; a texture of {built.textured.size} x {built.textured.size}"


def mesh_sentences(built: BuiltMesh) -> list[str]:
    """How a mesh came about."""
    share = built.left_out.shares()["grid_cells"] or 0.0
    parts = counted(built.num_floaters, "loose part")
    cavities = counted(built.num_cavities, "hidden cavity", "hidden cavities")
    lines = [
        f"Surface where {100 * LIGHT_GONE:.0f} % of the light is gone on the clearest way in; Euler number"
        f" {built.surface.euler_number}.",
        f"{100 * built.missed:.1f} % of the figure's pixels in the drawings met no surface; optical depths were raised there.",
        f"{100 * share:.1f} % of the grid's points were left out: outside the hull or away from the surface.",
        f"{parts} and {cavities} were left out; of the parts no drawing needs {built.found.num_unneeded}.",
        f"Joined to the figure: {counted(built.found.num_joined, 'loose part')}.",
        f"{built.num_extracted} faces before decimation.",
    ]
    if built.textured is not None:
        by_field = built.textured.num_from_field / max(built.textured.num_texels, 1)
        lines.append(
            f"Texture: {100 - 100 * by_field:.1f} % of {built.textured.num_texels} texels from the drawings alone, the field"
            f" was asked for {100 * by_field:.1f} %."
        )
    return lines


def _mesh(built: BuiltMesh) -> list[Block]:
    """How the mesh came about."""
    return [Heading("Mesh"), Bullets(mesh_sentences(built))]
