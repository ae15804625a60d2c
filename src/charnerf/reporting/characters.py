"""Every test character in every row, worst first."""

from collections.abc import Sequence
from statistics import fmean

from charnerf.reporting.blocks import Block, Heading, Table, Text
from charnerf.reporting.formats import COLUMNS, cell
from charnerf.reporting.rows import Row

SHOWN = ("psnr_foreground", "psnr", "silhouette_iou")


def scores_by_character(row: Row, key: str) -> dict[str, float]:
    """A metric of every character, averaged over the row's seeds."""
    values: dict[str, list[float]] = {}
    for run in row.runs:
        for name, scores in run.metrics["per_character"].items():
            if scores.get(key) is not None:
                values.setdefault(name, []).append(scores[key])
    return {name: fmean(each) for name, each in values.items()}


def ranked(rows: Sequence[Row]) -> list[str]:
    """Characters by their mean foreground PSNR over the rows, worst first."""
    values: dict[str, list[float]] = {}
    for row in rows:
        for name, value in scores_by_character(row, "psnr_foreground").items():
            values.setdefault(name, []).append(value)
    return sorted(values, key=lambda name: fmean(values[name]))


def characters(rows: Sequence[Row]) -> list[Block]:
    """One table a metric."""
    names = ranked(rows)
    blocks: list[Block] = [Heading("Per character, worst first")]
    for key in SHOWN:
        title, form = COLUMNS[key]
        scores = {row.label: scores_by_character(row, key) for row in rows}
        cells = [[name, *(cell(each.get(name), form) for each in scores.values())] for name in names]
        blocks += [Text(f"{title}:"), Table(["character", *scores], cells)]
    return blocks
