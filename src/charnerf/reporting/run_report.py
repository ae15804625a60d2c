"""report.md and report.html of one run."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from charnerf.reporting.blocks import Block, Bullets, Code, Heading, Picture, Table, Text
from charnerf.reporting.parts import (
    BASELINE_NAMES,
    COLUMNS,
    MAX_SHEETS,
    cell,
    character_table,
    metric_cells,
    read_metrics,
    seconds_text,
    sheets_of,
    verdict,
    write_report,
)
from charnerf.reporting.plots import plot_angles, plot_training, read_curve


def _headline(metrics: Mapping[str, Any]) -> Table:
    """Ours beside the baselines, with seconds."""
    header = ["", *(title for title, _ in COLUMNS.values()), "encode", "a frame"]
    rows = [("charnerf", metrics, metrics["seconds"])]
    for name, found in metrics.get("baselines", {}).items():
        rows.append((BASELINE_NAMES.get(name, name), found, found.get("seconds", {})))
    cells = [
        [
            name,
            *metric_cells(found),
            seconds_text(spent.get("encode")),
            seconds_text(spent.get("render_per_frame")),
        ]
        for name, found, spent in rows
    ]
    return Table(header, cells, emphasis=True)


def _reasons(metrics: Mapping[str, Any]) -> list[str]:
    """Why figures are missing, one line each."""
    lines = []
    for where, found in (
        ("", metrics),
        ("seconds: ", metrics["seconds"]),
        ("left out: ", metrics.get("left_out", {})),
        ("environment: ", metrics.get("environment", {})),
    ):
        for key, value in found.items():
            if key.endswith("_reason") and value:
                lines.append(f"{where}{key.removesuffix('_reason')}: none, because {value}")
    return lines


def _spent(metrics: Mapping[str, Any]) -> list[Block]:
    """Seconds, memory, work left out, environment."""
    spent, stages = metrics["seconds"], metrics.get("peak_memory_by_stage_mib", {})
    rows = [
        [title, seconds_text(spent.get(key)), cell(stages.get(stage), "{:.0f}")]
        for title, key, stage in (
            ("training", "train", "train"),
            ("encoding a character", "encode", "encode"),
            ("a frame", "render_per_frame", "render"),
            ("a mesh", "mesh", "mesh"),
        )
    ]
    shares = metrics.get("left_out", {})
    names = {"rays": "rays", "samples": "samples on rays", "grid_cells": "grid cells of the mesh"}
    left = [f"{title}: {cell(shares.get(key), '{:.1%}')} not evaluated" for key, title in names.items()]
    place = metrics.get("environment", {})
    where = [f"{key}: {value}" for key, value in place.items() if not key.endswith("_reason")]
    return [
        Heading("Time and memory"),
        Table(["stage", "time (median)", "peak memory, MiB"], rows),
        Text(f"Peak memory of the whole process: {cell(metrics.get('peak_memory_mib'), '{:.0f}')} MiB."),
        Heading("What was left out"),
        Bullets(left),
        Heading("Where this was measured"),
        Bullets(where),
    ]


def _go_on(folder: Path, metrics: Mapping[str, Any]) -> list[Block]:
    """Commands that continue from here."""
    name = next(iter(metrics["per_character"]), "NAME")
    commands = [
        f"charnerf evaluate {folder} --data DATASET --split {metrics['split']} --views all",
        f"charnerf mesh {folder} --data DATASET --character {name} -o {folder / 'meshes'}",
        f"charnerf reconstruct FRONT.png SIDE.png BACK.png --weights {folder} -o DIR",
        f"tensorboard --logdir {folder / 'tensorboard'}",
        f"charnerf report {folder.parent}",
    ]
    return [Heading("How to go on"), Code("\n".join(commands))]


def _chosen(sheets: Mapping[str, Picture]) -> list[str]:
    """Best, middle and worst of the names, worst first in `sheets`."""
    names = list(sheets)
    return list(dict.fromkeys([names[-1], names[len(names) // 2], names[0]])) if names else []


def write_run_report(run_folder: str | Path, *, more: Sequence[Block] = ()) -> Path:
    """Write report.md and report.html of a run from its metrics.json, curve.csv, config.yaml and images/.

    Args:
        run_folder: The run; only metrics.json must be there.
        more: Blocks to stand before what was spent.

    Returns:
        The Markdown file.

    Raises:
        DataError: If metrics.json is missing or unreadable, or curve.csv is another file.
    """
    folder = Path(run_folder)
    metrics = read_metrics(folder / "metrics.json")
    worst_first, table = character_table(metrics)
    sheets = sheets_of(folder, worst_first, metrics)
    shown = _chosen(sheets)
    title = f"charnerf run {folder.name}"
    blocks: list[Block] = [Heading(title, 1), Text(verdict(metrics), lead=True), _headline(metrics)]
    if shown:
        blocks += [Heading("Best, middle, worst"), *(sheets[name] for name in shown)]
    blocks += _curve_blocks(folder)
    blocks += [
        Heading("By viewing angle"),
        Picture(
            plot_angles(metrics, folder / "images" / "angles.png"),
            "PSNR by azimuth, and by distance from a drawing",
        ),
        Heading("Per character, worst first"),
        table,
    ]
    rest = [sheets[name] for name in sheets if name not in shown][: MAX_SHEETS - len(shown)]
    if rest:
        blocks += [Heading("More characters"), *rest]
    blocks += more
    blocks += _spent(metrics)
    reasons = _reasons(metrics)
    if reasons:
        blocks += [Heading("What could not be had"), Bullets(reasons)]
    blocks += _go_on(folder, metrics)
    config = folder / "config.yaml"
    if config.is_file():
        blocks.append(Code(config.read_text(encoding="utf-8"), folded="The composed configuration"))
    return write_report(folder, title, blocks)


def _curve_blocks(folder: Path) -> list[Block]:
    """Error against training seconds, or why it is missing."""
    path = folder / "curve.csv"
    blocks: list[Block] = [Heading("Error against training time")]
    picture = plot_training(read_curve(path), folder / "images" / "curve.png") if path.is_file() else None
    if picture is None:
        return [*blocks, Text("This run has no validation figures over time (curve.csv).")]
    return [*blocks, Picture(picture, "Validation PSNR over training seconds")]
