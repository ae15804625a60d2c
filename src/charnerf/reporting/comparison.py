"""Table II over the rows of a grid, ours beside the paper's, and what each row cost."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from charnerf.reporting.blocks import Block, Bullets, Heading, Table, Text
from charnerf.reporting.paper import TABLE_TWO
from charnerf.reporting.parts import BASELINE_NAMES, COLUMNS, NONE, cell, seconds_text
from charnerf.reporting.rows import Row, Unfinished

PAPER_KEYS = ("psnr", "ssim", "lpips")
_SHARES = {"rays": "rays left out", "samples": "samples left out", "grid_cells": "grid cells left out"}


@dataclass(frozen=True)
class Family:
    """Rows that stand in one table.

    Attributes:
        variant: What they share beside their experiments, "" where nothing.
        rows: In the paper's order.
        of_paper: Whether they are several rows of the paper's Table II.
    """

    variant: str
    rows: tuple[Row, ...]
    of_paper: bool


def families(rows: Sequence[Row]) -> list[Family]:
    """Rows by what they share beside their experiment, the paper's Table II once for each; then all others, best first."""
    by_variant: dict[str, list[Row]] = {}
    for row in rows:
        by_variant.setdefault(row.variant, []).append(row)
    order = list(TABLE_TWO)
    found, others = [], []
    for variant, members in sorted(by_variant.items()):
        listed = [row for row in members if row.experiment in order]
        if len({row.experiment for row in listed}) > 1:
            ordered = sorted(listed, key=lambda row: order.index(row.experiment or ""))
            found.append(Family(variant, tuple(ordered), of_paper=True))
            others += [row for row in members if row not in listed]
        else:
            others += members
    others = sorted(others, key=lambda row: -(row.mean("psnr_foreground") or 0.0))
    return [*found, *([Family("", tuple(others), of_paper=False)] if others else [])]


def sorted_rows(rows: Sequence[Row]) -> list[Row]:
    """Table after table: in the paper's order where rows are the paper's, else best on the foreground first."""
    return [row for family in families(rows) for row in family.rows]


def shown_rows(rows: Sequence[Row], count: int = 7) -> list[Row]:
    """All rows where there are few; else the one without any change and the best on the foreground, in their order."""
    if len(rows) <= count:
        return list(rows)
    plain = [row for row in rows if not row.variant][:1]
    best = sorted(rows, key=lambda row: -(row.mean("psnr_foreground") or 0.0))
    chosen = [*plain, *(row for row in best if row not in plain)][:count]
    return [row for row in rows if row in chosen]


def left_out_rows(rows: Sequence[Row], shown: Sequence[Row]) -> list[Block]:
    """Says that a picture does not show every row."""
    if len(shown) == len(rows):
        return []
    return [
        Text(f"{len(shown)} of {len(rows)} rows are shown: the plain one and the best on the foreground.")
    ]


def best_row(rows: Sequence[Row]) -> Row:
    """The row with the highest foreground PSNR."""
    return max(rows, key=lambda row: row.mean("psnr_foreground") or 0.0)


def spread(row: Row, key: str) -> str:
    """A metric of a row: its mean, and the standard deviation over seeds where there are several."""
    form, deviation = COLUMNS[key][1], row.spread(key)
    return cell(row.mean(key), form) + (f" ± {form.format(deviation)}" if deviation is not None else "")


def comparison(rows: Sequence[Row]) -> list[Block]:
    """Quality of every row, the paper's figures beside where it has the row, and the baselines below each table."""
    blocks: list[Block] = []
    found = families(rows)
    for family in found:
        blocks += _table(family, is_alone=len(found) == 1)
    told = "Means over the views of a character, then over characters, then over seeds"
    told += "; ± is the standard deviation over seeds." if any(len(row.runs) > 1 for row in rows) else "."
    if any(_has_paper(family) for family in found):
        told += " The paper trained for seven days on characters that are not published: its figures show the order, not a target."
    if any(family.of_paper and family.variant for family in found):
        told += " It has them for its own loss and settings alone; they stand beside every table."
    reasons = {
        str(run.metrics["lpips_reason"])
        for row in rows
        for run in row.runs
        if run.metrics.get("lpips_reason")
    }
    blocks.append(Text(told))
    blocks += [Text(f"LPIPS: none, because {reason}") for reason in sorted(reasons)]
    return blocks + starts(rows)


def starts(rows: Sequence[Row]) -> list[Block]:
    """Rows whose weights were meant to begin pretrained, and where they began."""
    found: dict[str, list[str]] = {}
    for row in rows:
        for start in dict.fromkeys(run.start for run in row.runs if run.start):
            found.setdefault(start, []).append(row.label)
    return [Text(f"Start of {', '.join(labels)}: {start}") for start, labels in found.items()]


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
        found = [NONE if of_paper else cell(scores.get(key), COLUMNS[key][1]) for key, of_paper in keys]
        cells += [[name, NONE, *found]] if set(found) != {NONE} else []
    title = "Table II" if with_paper else "All rows" if is_alone else "Further rows"
    return [Heading(f"{title}: {family.variant}" if family.variant else title), Table(header, cells)]


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
