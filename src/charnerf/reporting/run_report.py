"""report.md and report.html of one run."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from charnerf.pictures import open_picture
from charnerf.reporting.blocks import Block, Bullets, Code, Heading, Picture, SideBySide, Table, Text
from charnerf.reporting.document import write_report
from charnerf.reporting.formats import BASELINE_NAMES, COLUMNS, cell, metric_cells, seconds_text
from charnerf.reporting.meshes import run_meshes
from charnerf.reporting.plots import plot_angles, plot_training
from charnerf.reporting.run_files import read_curve, read_metrics
from charnerf.wording import counted, listed

MAX_SHEETS = 12
MOST_NAMES = 8
MOST_WIDTH = 420  # pixels of pictures that stand side by side


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
    title = f"charnerf run {folder.name}"
    blocks: list[Block] = [
        Heading(title, 1),
        Text(verdict(metrics), lead=True),
        _headline(metrics),
        *_ahead(metrics),
    ]
    worst_first = _worst_first(metrics)
    sheets = _sheets(folder, worst_first, metrics)
    shown = _best_middle_worst(sheets)
    if shown:
        blocks += [Heading("Best, middle, worst"), *_beside([sheets[name] for name in shown])]
    blocks += run_meshes(folder)
    blocks += [*_curve(folder), *_angles(folder, metrics), *_characters(worst_first, metrics)]
    rest = [sheets[name] for name in sheets if name not in shown][: MAX_SHEETS - len(shown)]
    if rest:
        blocks += [Heading("More characters"), *_beside(rest)]
    blocks += [*more, *_spent(metrics), *_missing(metrics), *_go_on(folder, metrics)]
    config = folder / "config.yaml"
    if config.is_file():
        blocks.append(Code(config.read_text(encoding="utf-8"), folded="The composed configuration"))
    return write_report(folder, title, blocks)


def verdict(metrics: Mapping[str, Any]) -> str:
    """What the run reached, and by how much it beats the better baseline."""
    start = (
        f"{counted(metrics['num_characters'], 'character')} of the {metrics['split']} split, "
        f"{counted(metrics['num_views'], 'view')}: "
        f"{cell(metrics['psnr'], '{:.2f}')} dB PSNR, "
        f"{cell(metrics['psnr_foreground'], '{:.2f}')} dB on the foreground"
    )
    gains = []
    for key, unit, form in (
        ("psnr", "dB PSNR", "{:+.2f}"),
        ("psnr_foreground", "dB foreground", "{:+.2f}"),
        ("ssim", "SSIM", "{:+.3f}"),
    ):
        baselines = metrics.get("baselines", {}).values()
        others = [scores[key] for scores in baselines if scores.get(key) is not None]
        if others and metrics[key] is not None:
            gains.append(f"{form.format(metrics[key] - max(others))} {unit}")
    return start + (f"; against the better baseline {', '.join(gains)}." if gains else ".")


def _headline(metrics: Mapping[str, Any]) -> Table:
    """Ours beside the baselines, with seconds."""
    header = ["", *(title for title, _ in COLUMNS.values()), "encode", "a frame"]
    rows = [("charnerf", metrics)]
    rows += [(BASELINE_NAMES.get(name, name), each) for name, each in metrics.get("baselines", {}).items()]
    if "drawings" in metrics:
        rows.append(("the drawings themselves, from where they were drawn", metrics["drawings"]))
    cells = []
    for name, scores in rows:
        spent = scores.get("seconds", {})
        seconds = [seconds_text(spent.get(stage)) for stage in ("encode", "render_per_frame")]
        cells.append([name, *metric_cells(scores), *seconds])
    return Table(header, cells, emphasis=True)


def _ahead(metrics: Mapping[str, Any]) -> list[Block]:
    """On which characters the visual hull has the truer shape than the model: a reason not to use the model there."""
    ahead = metrics.get("baselines", {}).get("visual_hull", {}).get("ahead", {})
    if not ahead:
        return []
    lines = [
        f"{COLUMNS[key][0]}: {len(names)} of {metrics['num_characters']}{_named(names)}"
        for key, names in ahead.items()
    ]
    return [Text("Characters of which the visual hull has the truer shape, by"), Bullets(lines)]


def _named(names: Sequence[str]) -> str:
    """A few names in brackets, and how many more there are; nothing for none."""
    return f" ({listed(names, MOST_NAMES)})" if names else ""


def _worst_first(metrics: Mapping[str, Any]) -> list[str]:
    """Names of the characters by foreground PSNR, then PSNR."""
    scores = metrics["per_character"]
    return sorted(
        scores, key=lambda name: (scores[name]["psnr_foreground"] or 0.0, scores[name]["psnr"] or 0.0)
    )


def _sheets(folder: Path, names: Sequence[str], metrics: Mapping[str, Any]) -> dict[str, Picture]:
    """Contact sheets that are there, in the order of the names."""
    sheets = {}
    for name in names:
        path = folder / "images" / name / "sheet.png"
        if path.is_file():
            scores = metrics["per_character"][name]
            caption = (
                f"{name}: {cell(scores['psnr'], '{:.1f}')} dB, "
                f"foreground {cell(scores['psnr_foreground'], '{:.1f}')} dB, "
                f"IoU {cell(scores['silhouette_iou'], '{:.2f}')}"
            )
            sheets[name] = Picture(path, caption)
    return sheets


def _beside(pictures: Sequence[Picture]) -> list[Block]:
    """Pictures beside one another where each has room for its labels, else below one another."""
    widths = []
    for one in pictures:
        with open_picture(one.path) as picture:
            widths.append(picture.width)
    return [SideBySide(pictures)] if max(widths) <= MOST_WIDTH else list(pictures)


def _best_middle_worst(worst_first: Mapping[str, Picture]) -> list[str]:
    """Three of the names, or as many as there are."""
    names = list(worst_first)
    return list(dict.fromkeys([names[-1], names[len(names) // 2], names[0]])) if names else []


def _curve(folder: Path) -> list[Block]:
    """Error against training seconds, or why it is missing."""
    path = folder / "curve.csv"
    blocks: list[Block] = [Heading("Error against training time")]
    picture = plot_training(read_curve(path), folder / "images" / "curve.png") if path.is_file() else None
    if picture is None:
        return [*blocks, Text("This run has no validation figures over time (curve.csv).")]
    return [*blocks, Picture(picture, "Validation PSNR over training seconds")]


def _angles(folder: Path, metrics: Mapping[str, Any]) -> list[Block]:
    """PSNR by where a view was taken from."""
    picture = plot_angles(metrics, folder / "images" / "angles.png")
    caption = "PSNR by azimuth, and by distance from a drawing"
    return [Heading("By viewing angle"), Picture(picture, caption)]


def _characters(names: Sequence[str], metrics: Mapping[str, Any]) -> list[Block]:
    """Every metric of every character."""
    header = ["character", *(title for title, _ in COLUMNS.values())]
    cells = [[name, *metric_cells(metrics["per_character"][name])] for name in names]
    return [Heading("Per character, worst first"), Table(header, cells)]


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
            ("all metrics of a character", "metrics", "metrics"),
        )
    ]
    shares = metrics.get("left_out", {})
    names = {"rays": "rays", "samples": "samples on rays", "grid_cells": "grid cells of the mesh"}
    left = [f"{title}: {cell(shares.get(key), '{:.1%}')} not evaluated" for key, title in names.items()]
    place = metrics.get("environment", {})
    where = [
        f"{key.replace('_', ' ')}: {_plain(value)}"
        for key, value in place.items()
        if not key.endswith("_reason")
    ]
    return [
        Heading("Time and memory"),
        Table(["stage", "time (median)", "peak memory, MiB"], rows),
        Text(f"Peak memory of the whole process: {cell(metrics.get('peak_memory_mib'), '{:.0f}')} MiB."),
        Heading("What was left out"),
        Bullets(left),
        Heading("Where this was measured"),
        Bullets(where),
    ]


def _plain(value: Any) -> str:
    """A fact of the environment in words."""
    return (
        ", ".join(f"{name}: {one}" for name, one in value.items())
        if isinstance(value, Mapping)
        else str(value)
    )


def _missing(metrics: Mapping[str, Any]) -> list[Block]:
    """Why figures are missing, one line each."""
    lines = []
    for where, figures in (
        ("", metrics),
        ("seconds: ", metrics["seconds"]),
        ("left out: ", metrics.get("left_out", {})),
        ("environment: ", metrics.get("environment", {})),
    ):
        for key, value in figures.items():
            if key.endswith("_reason") and value:
                lines.append(f"{where}{key.removesuffix('_reason')}: none, because {value}")
    return [Heading("What could not be had"), Bullets(lines)] if lines else []


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
