"""Table II over the rows of a grid, ours beside the paper's, and what each row cost."""

from collections.abc import Mapping, Sequence
from typing import Any

from charnerf.reporting.blocks import Block, Bullets, Heading, Table, Text
from charnerf.reporting.paper import TABLE_TWO
from charnerf.reporting.parts import BASELINE_NAMES, COLUMNS, NONE, cell, seconds_text
from charnerf.reporting.rows import Row, Unfinished

PAPER_KEYS = ("psnr", "ssim", "lpips")
_SHARES = {"rays": "rays left out", "samples": "samples left out", "grid_cells": "grid cells left out"}


def sorted_rows(rows: Sequence[Row]) -> list[Row]:
    """In the paper's order where a row is one of the paper's, then best on the foreground first."""
    order = list(TABLE_TWO)

    def rank(row: Row) -> tuple[int, float]:
        place = order.index(row.experiment) if row.experiment in order else len(order)
        return place, -(row.mean("psnr_foreground") or 0.0)

    return sorted(rows, key=rank)


def best_row(rows: Sequence[Row]) -> Row:
    """The row with the highest foreground PSNR."""
    return max(rows, key=lambda row: row.mean("psnr_foreground") or 0.0)


def spread(row: Row, key: str) -> str:
    """A metric of a row: its mean, and the standard deviation over seeds where there are several."""
    form, deviation = COLUMNS[key][1], row.spread(key)
    return cell(row.mean(key), form) + (f" ± {form.format(deviation)}" if deviation is not None else "")


def comparison(rows: Sequence[Row]) -> list[Block]:
    """Quality of every row, the paper's figures beside where it has the row, and the baselines below."""
    with_paper = any(row.experiment in TABLE_TWO for row in rows)
    keys = [
        (key, of_paper)
        for key in COLUMNS
        for of_paper in (False, True)[: 1 + (with_paper and key in PAPER_KEYS)]
    ]
    header = ["row", "seeds", *("paper" if of_paper else COLUMNS[key][0] for key, of_paper in keys)]
    cells = [
        [
            row.label,
            str(len(row.runs)),
            *(_paper(row, key) if of_paper else spread(row, key) for key, of_paper in keys),
        ]
        for row in rows
    ]
    for name, scores in _baselines(rows):
        found = [NONE if of_paper else cell(scores.get(key), COLUMNS[key][1]) for key, of_paper in keys]
        cells += [[name, NONE, *found]] if set(found) != {NONE} else []
    told = "Means over the views of a character, then over characters, then over seeds"
    told += "; ± is the standard deviation over seeds." if any(len(row.runs) > 1 for row in rows) else "."
    if with_paper:
        told += " The paper trained for seven days on characters that are not published: its figures show the order, not a target."
    reasons = {
        str(run.metrics["lpips_reason"])
        for row in rows
        for run in row.runs
        if run.metrics.get("lpips_reason")
    }
    blocks: list[Block] = [
        Heading("Table II" if with_paper else "All rows"),
        Table(header, cells),
        Text(told),
    ]
    return blocks + [Text(f"LPIPS: none, because {reason}") for reason in sorted(reasons)]


def costs(rows: Sequence[Row]) -> list[Block]:
    """Size, seconds, memory and work left out of every row."""
    header = ["row", "parameters", "training", "steps", "a frame", "a mesh", "peak MiB", *_SHARES.values()]
    cells = [
        [
            row.label,
            cell(row.mean("num_parameters"), "{:,.0f}"),
            seconds_text(row.mean("seconds", "train")),
            cell(_steps(row), "{:.0f}"),
            seconds_text(row.mean("seconds", "render_per_frame")),
            seconds_text(row.mean("seconds", "mesh")),
            cell(row.mean("peak_memory_mib"), "{:.0f}"),
            *(cell(row.mean("left_out", key), "{:.1%}") for key in _SHARES),
        ]
        for row in rows
    ]
    places = sorted({_place(run.metrics.get("environment", {})) for row in rows for run in row.runs})
    return [Heading("What it cost"), Table(header, cells), Text(f"Measured on: {'; '.join(places)}.")]


def unfinished(found: Sequence[Unfinished]) -> list[Block]:
    """Cells that are not in the tables, and why."""
    if not found:
        return []
    lines = [f"{one.name}: {one.state}{f': {one.error}' if one.error else ''}" for one in found]
    return [Heading("Failed or unfinished"), Bullets(lines)]


def _paper(row: Row, key: str) -> str:
    """The paper's figure of a row, with as many digits as it prints."""
    figures = TABLE_TWO[row.experiment][1] if row.experiment in TABLE_TWO else {}
    return cell(figures.get(key), "{:.1f}" if key == "psnr" else "{:.3f}")


def _steps(row: Row) -> float | None:
    """Training steps; of runs that did not note them, those of the curve's last line."""
    noted = row.mean("steps")
    last = [run.curve[-1]["step"] for run in row.runs if run.curve and "step" in run.curve[-1]]
    return noted if noted is not None or not last else sum(last) / len(last)


def _baselines(rows: Sequence[Row]) -> list[tuple[str, Mapping[str, Any]]]:
    """Name and metrics of the baselines, once for every set of views that runs were measured on."""
    found: dict[tuple[Any, ...], tuple[str, Mapping[str, Any]]] = {}
    for row in rows:
        for run in row.runs:
            for name, scores in run.metrics.get("baselines", {}).items():
                same = (name, *(scores.get(key) for key in COLUMNS))
                found.setdefault(same, (BASELINE_NAMES.get(name, name), scores))
    return list(found.values())


def _place(environment: Mapping[str, Any]) -> str:
    parts = (environment.get("machine"), environment.get("device"), f"{environment.get('threads')} threads")
    return ", ".join(str(part) for part in parts if part)
