"""Error against training seconds over all rows, and the seconds that each took to a quality."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median

from charnerf.reporting.blocks import Block, Heading, Picture, Plot, Table, Text
from charnerf.reporting.formats import seconds_text
from charnerf.reporting.interactive import lines_figure
from charnerf.reporting.plots import Line, plot_lines
from charnerf.reporting.rows import Row
from charnerf.reporting.run_files import Curve, curve_points

PANELS = {
    "val_psnr": "validation PSNR, dB",
    "val_psnr_foreground": "validation foreground PSNR, dB",
    "val_ssim": "validation SSIM",
}
_SECONDS = "training seconds (evaluation excluded)"
_FORMS = {
    "val_psnr": ("PSNR", "{:.1f} dB"),
    "val_psnr_foreground": ("foreground", "{:.1f} dB"),
    "val_ssim": ("SSIM", "{:.2f}"),
}
_NEVER = "not reached"


def time_to_quality(curve: Curve, key: str, level: float) -> float | None:
    """Training seconds until a metric first reaches a level, straight between validations; None if it never does."""
    before: tuple[float, float] | None = None
    for seconds, value in zip(*curve_points(curve, key), strict=True):
        if value >= level:
            if before is None:
                return seconds
            return before[0] + (seconds - before[0]) * (level - before[1]) / (value - before[1])
        before = (seconds, value)
    return None


def quality_levels(curves: Sequence[Curve], key: str) -> list[float]:
    """Two levels to compare rows at: what every curve reaches, and what the middle one reaches (rounded down)."""
    bests = sorted(max(points) for curve in curves if (points := curve_points(curve, key)[1]))
    if not bests:
        return []
    step = 0.01 if key == "val_ssim" else 0.1
    return sorted({int(value / step + 1e-9) * step for value in (bests[0], median(bests))})


def training_time(rows: Sequence[Row], folder: Path) -> list[Block]:
    """The diagram and the table of seconds to a quality."""
    blocks: list[Block] = [Heading("Error against training time")]
    panels = {title: _lines(rows, key) for key, title in PANELS.items()}
    panels = {title: lines for title, lines in panels.items() if lines}
    if not panels:
        return [*blocks, Text("No run has validation figures over time (curve.csv).")]
    picture = plot_lines(panels, folder / "report_curves.png", x=_SECONDS)
    caption = "Validation PSNR, foreground PSNR and SSIM against training seconds, one line a seed"
    blocks.append(Plot(lines_figure(panels, x=_SECONDS), Picture(picture, caption)))
    header, cells = ["row"], [[row.label] for row in rows]
    for key, (name, form) in _FORMS.items():
        for level in quality_levels([run.curve for row in rows for run in row.runs], key):
            header.append(f"{name} {form.format(level)}")
            for line, row in zip(cells, rows, strict=True):
                line.append(_seconds(row, key, level))
    note = "Training seconds until the validation figure is first reached, the median over seeds."
    return [*blocks, Table(header, cells), Text(note)]


def _lines(rows: Sequence[Row], key: str) -> Mapping[str, list[Line]]:
    """Lines of every row that has the metric, one a seed."""
    every = {row.label: [curve_points(run.curve, key) for run in row.runs] for row in rows}
    drawn: dict[str, list[Line]] = {
        label: [line for line in lines if line[0]] for label, lines in every.items()
    }
    return {label: lines for label, lines in drawn.items() if lines}


def _seconds(row: Row, key: str, level: float) -> str:
    """Median over the seeds; how many never reached the level where some did not."""
    times = [time_to_quality(run.curve, key, level) for run in row.runs]
    reached = [one for one in times if one is not None]
    if not reached:
        return _NEVER
    missed = len(times) - len(reached)
    return seconds_text(median(reached)) + (f" ({missed} of {len(times)} {_NEVER})" if missed else "")
