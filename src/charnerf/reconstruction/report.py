"""The report of a reconstruction: what was assumed, what was made, how long it took."""

from collections.abc import Sequence
from pathlib import Path

from charnerf.drawings.turnaround import Turnaround
from charnerf.finetuning.finetune import Finetuned
from charnerf.finetuning.report import curve_table, summary_lines
from charnerf.markdown import table
from charnerf.meshing.build import BuiltMesh

ROWS_OF_LEVELS = 8


def report_text(
    *,
    drawings: Turnaround,
    built: BuiltMesh,
    film: Path,
    film_note: str | None,
    views: Sequence[Path],
    seconds: dict[str, float],
    weights: str,
    refined: Finetuned | None = None,
    from_sheet: bool = False,
) -> str:
    """The Markdown text of report.md; the files that it shows lie beside it.

    Args:
        drawings: What was assumed.
        built: The mesh.
        film: The turntable's file.
        film_note: What is to be said about it, or None.
        views: Pictures, shown in the report's order.
        seconds: By stage.
        weights: Where the model came from.
        refined: How the weights were adapted to the drawings, if they were.
        from_sheet: Whether they were found on a sheet, whose picture lies beside.
    """
    lines = ["# Reconstructed character", "", " ".join(_picture(view) for view in views[:4]), ""]
    lines += ["## What was assumed about the drawings", ""]
    if from_sheet:
        lines += ["![the sheet, its figures and what was left aside](sheet_as_read.png)", ""]
    lines += ["![the drawings, cut out and aligned](drawings.png)", ""]
    lines += [f"- {one}" for one in drawings.assumptions]
    lines += [f"- **warning**: {one}" for one in drawings.warnings]
    lines += ["", "## Files", ""]
    lines += [f"- [mesh.glb](mesh.glb): {mesh_words(built)}; metres, Y up, facing +Z"]
    lines += [f"- [{film.name}]({film.name}){': ' + film_note if film_note else ''}"]
    lines += [
        "- [meshes/mesh_sheet.png](meshes/mesh_sheet.png): the mesh from all sides, beside the drawings"
    ]
    lines += ["- [sheet.png](sheet.png): a model sheet of the result, the drawings above"]
    lines += ["- [views](views): pictures with alpha, named by azimuth in degrees", ""]
    lines += _mesh_lines(built)
    if refined is not None:
        lines += ["", "## Refinement", "", *(f"- {one}" for one in summary_lines(refined)), ""]
        lines += ["![error against seconds](refinement.png)", "", *curve_table(refined)]
    lines += ["", "## Seconds", ""]
    lines += table(("stage", "seconds"), [(stage, f"{value:.1f}") for stage, value in seconds.items()])
    lines += ["", f"Weights: {weights}", ""]
    return "\n".join(lines)


def _picture(view: Path) -> str:
    return f"![{view.stem} degrees]({view.parent.name}/{view.name})"


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
    lines = [
        f"Surface where the density is {built.level:.3g} per metre; Euler number "
        f"{built.surface.euler_number}.",
        f"{100 * built.missed:.1f} % of the figure's pixels in the drawings met no surface; densities were raised there.",
        f"{100 * share:.1f} % of the grid's points were left out: outside the hull or away from the surface.",
        f"{built.num_floaters} loose parts and {built.num_cavities} hidden cavities were dropped.",
        f"{built.num_extracted} faces before decimation.",
    ]
    if built.textured is not None:
        by_field = built.textured.num_from_field / max(built.textured.num_texels, 1)
        lines.append(
            f"Texture: {100 - 100 * by_field:.1f} % of {built.textured.num_texels} texels from the drawings alone, the field"
            f" was asked for {100 * by_field:.1f} %."
        )
    return lines


def _mesh_lines(built: BuiltMesh) -> list[str]:
    """How the mesh came about, and the evidence for its level."""
    lines = ["## Mesh", "", *(f"- {one}" for one in mesh_sentences(built))]
    return [*lines, "", *level_lines(built)]


def level_lines(built: BuiltMesh) -> list[str]:
    """The density that the surface was drawn at, beside others: distance from rendered depths, silhouettes."""
    if built.choice is None:
        return [f"The density {built.level:.3g} per metre was given, not chosen."]
    lines = ["The density was chosen so that the surface lies where rendering, seen from around, loses"]
    lines += ["half of its light. IoU: of the surface's silhouettes with the drawings.", ""]
    rows = []
    tried = built.choice.tried
    step = max(1, len(tried) // ROWS_OF_LEVELS)
    for index, one in enumerate(tried):
        if index % step == 0 or one.level == built.level:
            mark = "**" if one.level == built.level else ""
            cells = (f"{mark}{one.level:.3g}{mark}", f"{1000 * one.depth_error:.1f}", f"{one.mask_iou:.3f}")
            rows.append(cells)
    return [*lines, *table(("density", "distance, mm", "IoU"), rows)]
