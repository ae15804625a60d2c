"""Every test character in every row, worst first."""

from collections.abc import Sequence
from statistics import fmean

from charnerf.reporting.blocks import Block, Heading, Table, Text
from charnerf.reporting.parts import COLUMNS, cell
from charnerf.reporting.rows import Row
from charnerf.reporting.verdicts import scores_by_character

SHOWN = ("psnr_foreground", "psnr", "silhouette_iou")


def ranked(rows: Sequence[Row]) -> list[str]:
    """Characters by their mean foreground PSNR over the rows, worst first."""
    found: dict[str, list[float]] = {}
    for row in rows:
        for name, value in scores_by_character(row, "psnr_foreground").items():
            found.setdefault(name, []).append(value)
    return sorted(found, key=lambda name: fmean(found[name]))


def characters(rows: Sequence[Row]) -> list[Block]:
    """One table a metric."""
    names = ranked(rows)
    blocks: list[Block] = [Heading("Per character, worst first")]
    for key in SHOWN:
        title, form = COLUMNS[key]
        scores = {row.label: scores_by_character(row, key) for row in rows}
        cells = [[name, *(cell(found.get(name), form) for found in scores.values())] for name in names]
        blocks += [Text(f"{title}:"), Table(["character", *scores], cells)]
    return blocks
