"""One report over all runs below a folder: one table, one diagram of their curves."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from charnerf.errors import DataError
from charnerf.reporting.blocks import Block, Heading, Picture, Table, Text
from charnerf.reporting.parts import (
    BASELINE_NAMES,
    COLUMNS,
    MAX_SHEETS,
    NONE,
    cell,
    character_table,
    metric_cells,
    read_metrics,
    seconds_text,
    sheets_of,
    verdict,
    write_report,
)
from charnerf.reporting.plots import Curve, plot_curves, read_curve


def _overrides(run: Path) -> str:
    """What the run's command line changed, as Hydra noted it; empty where it did not."""
    path = run / ".hydra" / "overrides.yaml"
    if not path.is_file():
        return ""
    lines = path.read_text(encoding="utf-8").splitlines()
    return " ".join(line[2:].strip().strip("'\"") for line in lines if line.startswith("- "))


def write_folder_report(folder: str | Path) -> Path:
    """Write report.md and report.html over all runs below a folder: one table, one diagram of their curves.

    Args:
        folder: Any folder; every metrics.json below it is a run.

    Returns:
        The Markdown file.

    Raises:
        DataError: If there is no run below it, or one of its files is unreadable.
    """
    folder = Path(folder)
    runs = sorted(path.parent for path in folder.rglob("metrics.json"))
    if not runs:
        raise DataError(
            f"{folder}: found no metrics.json below it, expected finished runs; train or evaluate first."
        )
    found = [(run, read_metrics(run / "metrics.json")) for run in runs]
    found.sort(key=lambda pair: -(pair[1]["psnr_foreground"] or 0.0))
    curves: dict[str, Curve] = {}
    rows = []
    for run, metrics in found:
        name = run.relative_to(folder).as_posix() if run != folder else run.name
        overrides = _overrides(run)
        path = run / "curve.csv"
        if path.is_file():
            curves[f"{name} {overrides}".strip()] = read_curve(path)
        spent = metrics["seconds"]
        rows.append(
            [
                name,
                overrides or NONE,
                *metric_cells(metrics),
                *(seconds_text(spent.get(key)) for key in ("train", "render_per_frame", "mesh")),
                cell(metrics.get("peak_memory_mib"), "{:.0f}"),
                f"{metrics['split']} {metrics['num_characters']} x {metrics['num_views']}",
            ]
        )
    header = ["run", "options", *(title for title, _ in COLUMNS.values())]
    header += ["training", "a frame", "a mesh", "MiB", "characters x views"]
    title = f"charnerf: {len(found)} runs in {folder.resolve().name}"
    blocks: list[Block] = [Heading(title, 1), Text(_folder_verdict(found, folder), lead=True)]
    blocks.append(Table(header, rows, emphasis=True))
    blocks += _folder_baselines(found)
    picture = plot_curves(curves, folder / "report_curves.png")
    blocks.append(Heading("Error against training time"))
    blocks.append(
        Picture(picture, "Validation PSNR of every run") if picture else Text("No run has a curve.csv.")
    )
    for run, metrics in found:
        name = run.relative_to(folder).as_posix() if run != folder else run.name
        sheets = sheets_of(run, character_table(metrics)[0], metrics)
        middle = list(sheets.values())[len(sheets) // 2 : len(sheets) // 2 + 1]
        if middle and len(found) <= MAX_SHEETS:
            blocks += [Heading(f"{name} {_overrides(run)}".strip()), *middle]
    return write_report(folder, title, blocks)


def _folder_verdict(found: Sequence[tuple[Path, Mapping[str, Any]]], folder: Path) -> str:
    """Which run is best."""
    run, metrics = found[0]
    name = run.relative_to(folder).as_posix() if run != folder else run.name
    options = _overrides(run)
    return f"Best on the foreground: {name}{f' ({options})' if options else ''}. {verdict(metrics)}"


def _folder_baselines(found: Sequence[tuple[Path, Mapping[str, Any]]]) -> list[Block]:
    """The baselines, once for every set of characters and views that the runs were measured on."""
    rows: dict[tuple[str, ...], list[str]] = {}
    for _, metrics in found:
        for name, scores in metrics.get("baselines", {}).items():
            cells = [f"{BASELINE_NAMES.get(name, name)}, {metrics['split']}", *metric_cells(scores)]
            rows.setdefault(tuple(cells), cells)
    header = ["baseline", *(title for title, _ in COLUMNS.values())]
    return [Heading("Without learning"), Table(header, list(rows.values()))] if rows else []
