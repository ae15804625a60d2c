"""What a check found: rows with bounds, curves of error against stiffness, and their table, JSON and plot."""

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path

from charnerf.wording import counted


@dataclass(frozen=True)
class CheckRow:
    """One measurement.

    Attributes:
        kernel: What was measured.
        case: On which input.
        device: Where, such as "cpu".
        dtype: Of the inputs, such as "float32".
        formula: "ours", or "naive" for the formula that others use, which has to fail.
        value_error: Error against the reference, relative where the case says so.
        gradient_error: The same of the gradient; None where there is none.
        non_finite: Count of NaN and infinity in values and gradients.
        value_bound: Largest error allowed; None for a figure that is only reported.
        gradient_bound: The same for the gradient.
    """

    kernel: str
    case: str
    device: str
    dtype: str
    formula: str
    value_error: float
    gradient_error: float | None
    non_finite: int
    value_bound: float | None
    gradient_bound: float | None

    @property
    def within(self) -> bool:
        """Whether every error is within its bound and everything is finite."""
        pairs = ((self.value_error, self.value_bound), (self.gradient_error, self.gradient_bound))
        kept = all(error <= bound for error, bound in pairs if error is not None and bound is not None)
        return kept and self.non_finite == 0

    @property
    def ok(self) -> bool:
        """Ours has to hold and the naive formula has to fail: a check that can not fail shows nothing."""
        return self.within == (self.formula == "ours")

    @property
    def verdict(self) -> str:
        """One word for the table."""
        if self.formula == "ours":
            return "holds" if self.ok else "BROKEN"
        return "fails" if self.ok else "NOT SHOWN"


@dataclass(frozen=True)
class CheckCurve:
    """Errors along one axis: panel names the plot, label the line."""

    panel: str
    label: str
    x: tuple[float, ...]
    errors: tuple[float, ...]


@dataclass(frozen=True)
class CheckReport:
    """Everything that one check found."""

    rows: tuple[CheckRow, ...]
    curves: tuple[CheckCurve, ...]
    seconds: float
    environment: dict[str, str]

    @property
    def passed(self) -> bool:
        """Whether no bound is broken and every naive formula failed where it should."""
        return all(row.ok for row in self.rows)

    def table(self) -> str:
        """The rows as aligned text, with a summary line."""
        head = ("kernel", "case", "device", "dtype", "formula", "value", "gradient", "bounds", "verdict")
        body = [_cells(row) for row in self.rows]
        widths = [max(len(line[i]) for line in (head, *body)) for i in range(len(head))]
        lines = [
            "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
            for line in (head, *body)
        ]
        lines.insert(1, "-" * len(lines[0]))
        broken = sum(not row.ok for row in self.rows)
        lines.append(f"{counted(len(self.rows), 'row')}, {broken} broken, {self.seconds:.1f} s")
        return "\n".join(lines)

    def to_json(self, path: str | Path) -> None:
        """Write everything as JSON; errors that are not finite become null."""
        rows = [{**asdict(row), "ok": row.ok, "verdict": row.verdict} for row in self.rows]
        content = {
            "passed": self.passed,
            "seconds": self.seconds,
            "environment": self.environment,
            "rows": rows,
            "curves": [asdict(curve) for curve in self.curves],
        }
        Path(path).write_text(json.dumps(_json_safe(content), indent=1) + "\n", encoding="utf-8")

    def plot(self, path: str | Path) -> None:
        """Draw error against stiffness and samples, log-log; the file's ending chooses the format."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        panels = list(dict.fromkeys(curve.panel for curve in self.curves))
        columns = min(2, max(1, len(panels)))
        rows = max(1, math.ceil(len(panels) / columns))
        figure = Figure(figsize=(6.5 * columns, 4.2 * rows), layout="constrained")
        FigureCanvasAgg(figure)
        for index, panel in enumerate(panels):
            axes = figure.add_subplot(rows, columns, index + 1)
            for curve in self.curves:
                if curve.panel == panel:
                    _draw(axes, curve)
            what, _, against = panel.partition(" against ")
            axes.set(xscale="log", yscale="log", xlabel=against, ylabel="error", title=what)
            axes.grid(True, alpha=0.3)
            axes.legend(fontsize=7)
        figure.savefig(path, dpi=130)


def _draw(axes: object, curve: CheckCurve) -> None:
    """One line; errors of exactly 0 sit at the bottom, those that are not finite are marked at the top."""
    shown = [min(max(error, 1e-18), 1e3) if math.isfinite(error) else 1e3 for error in curve.errors]
    style = "--" if "naive" in curve.label else "-"
    (line,) = axes.plot(curve.x, shown, style, label=curve.label, linewidth=1.2)  # type: ignore[attr-defined]
    lost = [x for x, error in zip(curve.x, curve.errors, strict=True) if not math.isfinite(error)]
    axes.plot(lost, [1e3] * len(lost), "x", color=line.get_color())  # type: ignore[attr-defined]


def _cells(row: CheckRow) -> tuple[str, ...]:
    bounds = "/".join("-" if b is None else f"{b:.0e}" for b in (row.value_bound, row.gradient_bound))
    gradient = "-" if row.gradient_error is None else f"{row.gradient_error:.1e}"
    value = f"{row.value_error:.1e}" + (f" ({row.non_finite} not finite)" if row.non_finite else "")
    return row.kernel, row.case, row.device, row.dtype, row.formula, value, gradient, bounds, row.verdict


def _json_safe(value: object) -> object:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _json_safe(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_json_safe(item) for item in value]
    return value
