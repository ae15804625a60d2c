"""Table II over the rows of a grid, ours beside the paper's, and what each row cost."""

from collections.abc import Mapping, Sequence
from typing import Any

from charnerf.reporting.blocks import Block, Bullets, Heading, Table, Text
from charnerf.reporting.families import TABLE_TWO, Family, families
from charnerf.reporting.formats import BASELINE_NAMES, COLUMNS, NONE, cell, seconds_text
from charnerf.reporting.rows import Row
from charnerf.reporting.runs import Unfinished
from charnerf.wording import counted

PAPER_KEYS = ("psnr", "ssim", "lpips")
_LEFT_OUT = {"rays": "rays left out", "samples": "samples left out", "grid_cells": "grid cells left out"}


def spread(row: Row, key: str) -> str:
    """A metric of a row: its mean, and the standard deviation over seeds where there are several."""
    form, deviation = COLUMNS[key][1], row.spread(key)
    return cell(row.mean(key), form) + (f" ± {form.format(deviation)}" if deviation is not None else "")


def comparison(rows: Sequence[Row]) -> list[Block]:
    """Quality of every row, the paper's figures beside where it has the row, and the baselines below each table."""
    blocks: list[Block] = []
    tables = families(rows)
    for family in tables:
        blocks += _table(family, is_alone=len(tables) == 1)
    note = "Means over the views of a character, then over characters, then over seeds"
    note += "; ± is the standard deviation over seeds." if any(len(row.runs) > 1 for row in rows) else "."
    if any(_has_paper(family) for family in tables):
        note += " The paper trained for seven days on characters that are not published: its figures show the order, not a target."
    if any(family.of_paper and family.variant for family in tables):
        note += " It has them for its own loss and settings alone; they stand beside every table."
    reasons = {
        str(run.metrics["lpips_reason"])
        for row in rows
        for run in row.runs
        if run.metrics.get("lpips_reason")
    }
    blocks.append(Text(note))
    blocks += [Text(f"LPIPS: none, because {reason}") for reason in sorted(reasons)]
    return blocks + starts(rows)


def starts(rows: Sequence[Row]) -> list[Block]:
    """Rows whose weights were meant to begin pretrained, and where they began."""
    labels: dict[str, list[str]] = {}
    for row in rows:
        for start in dict.fromkeys(run.start for run in row.runs if run.start):
            labels.setdefault(start, []).append(row.label)
    return [Text(f"Start of {', '.join(each)}: {start}") for start, each in labels.items()]


def _has_paper(family: Family) -> bool:
    """Whether the paper's figures stand beside ours: in its tables, and where a row stands alone."""
    return family.of_paper or (len(family.rows) == 1 and family.rows[0].experiment in TABLE_TWO)


def _table(family: Family, *, is_alone: bool) -> list[Block]:
    """Heading and table of a family."""
    with_paper = _has_paper(family)
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
        for row in family.rows
    ]
    for name, scores in _baselines(family.rows):
        values = [NONE if of_paper else cell(scores.get(key), COLUMNS[key][1]) for key, of_paper in keys]
        cells += [[name, NONE, *values]] if set(values) != {NONE} else []
    title = "Table II" if with_paper else "All rows" if is_alone else "Further rows"
    return [Heading(f"{title}: {family.variant}" if family.variant else title), Table(header, cells)]


def costs(rows: Sequence[Row]) -> list[Block]:
    """Size, seconds, memory and work left out of every row."""
    header = ["row", "parameters", "training", "steps", "a frame", "a mesh", "peak MiB", *_LEFT_OUT.values()]
    cells = [
        [
            row.label,
            cell(row.mean("num_parameters"), "{:,.0f}"),
            seconds_text(row.mean("seconds", "train")),
            cell(_steps(row), "{:.0f}"),
            seconds_text(row.mean("seconds", "render_per_frame")),
            seconds_text(row.mean("seconds", "mesh")),
            cell(row.mean("peak_memory_mib"), "{:.0f}"),
            *(cell(row.mean("left_out", key), "{:.1%}") for key in _LEFT_OUT),
        ]
        for row in rows
    ]
    places = sorted({_place(run.metrics.get("environment", {})) for row in rows for run in row.runs})
    return [Heading("What it cost"), Table(header, cells), Text(f"Measured on: {'; '.join(places)}.")]


def unfinished(runs: Sequence[Unfinished]) -> list[Block]:
    """Cells that are not in the tables, and why."""
    if not runs:
        return []
    lines = [f"{one.name}: {one.state}{f': {one.error}' if one.error else ''}" for one in runs]
    return [Heading("Failed or unfinished"), Bullets(lines)]


def _paper(row: Row, key: str) -> str:
    """The paper's figure of a row, with as many digits as it prints."""
    figures = TABLE_TWO.get(row.experiment or "", {})
    return cell(figures.get(key), "{:.1f}" if key == "psnr" else "{:.3f}")


def _steps(row: Row) -> float | None:
    """Training steps; of runs that did not note them, those of the curve's last line."""
    noted = row.mean("steps")
    last = [run.curve[-1]["step"] for run in row.runs if run.curve and "step" in run.curve[-1]]
    return noted if noted is not None or not last else sum(last) / len(last)


def _baselines(rows: Sequence[Row]) -> list[tuple[str, Mapping[str, Any]]]:
    """Name and metrics of the baselines, once for every set of views that runs were measured on."""
    baselines: dict[tuple[Any, ...], tuple[str, Mapping[str, Any]]] = {}
    for row in rows:
        for run in row.runs:
            for name, scores in run.metrics.get("baselines", {}).items():
                same = (name, *(scores.get(key) for key in COLUMNS))
                baselines.setdefault(same, (BASELINE_NAMES.get(name, name), scores))
    return list(baselines.values())


def _place(environment: Mapping[str, Any]) -> str:
    parts = (environment.get("machine"), environment.get("device"), _threads(environment.get("threads")))
    return ", ".join(str(part) for part in parts if part)


def _threads(number: Any) -> str | None:
    return counted(number, "thread") if isinstance(number, int) else None
