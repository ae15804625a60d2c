"""Which rows stand in one table: those of the paper's Table II, and all others."""

from collections.abc import Sequence
from dataclasses import dataclass

from charnerf.reporting.blocks import Block, Text
from charnerf.reporting.rows import Row

TABLE_TWO = {
    "pixelnerf": {"psnr": 29.2, "ssim": 0.973, "lpips": 0.071},
    "single_encoder": {"psnr": 25.1, "ssim": 0.955, "lpips": 0.147},
    "no_mha": {"psnr": 29.8, "ssim": 0.976, "lpips": 0.073},
    "no_mha_depth": {"psnr": 25.6, "ssim": 0.966, "lpips": 0.128},
    "no_view": {"psnr": 28.7, "ssim": 0.974, "lpips": 0.072},
    "charnerf": {"psnr": 34.3, "ssim": 0.988, "lpips": 0.031},
}
"""The paper's Table II, its rows by the names of our experiments."""


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
    tables, others = [], []
    for variant, members in sorted(by_variant.items()):
        listed = [row for row in members if row.experiment in order]
        if len({row.experiment for row in listed}) > 1:
            ordered = sorted(listed, key=lambda row: order.index(row.experiment or ""))
            tables.append(Family(variant, tuple(ordered), of_paper=True))
            others += [row for row in members if row not in listed]
        else:
            others += members
    others = sorted(others, key=lambda row: -(row.mean("psnr_foreground") or 0.0))
    return [*tables, *([Family("", tuple(others), of_paper=False)] if others else [])]


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
