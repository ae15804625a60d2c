"""The measured part of a model card: the training curve and the tables, from what runs and evaluations left on disk.

The card is a Markdown file with the lines of BEGIN and END in it; what stands between them is written anew.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from charnerf.errors import ConfigError, DataError
from charnerf.evaluation.metrics_file import write_metrics
from charnerf.files import write_text
from charnerf.markdown import table
from charnerf.reporting.formats import BASELINE_NAMES, COLUMNS, cell, metric_cells, seconds_text
from charnerf.reporting.plots import plot_training
from charnerf.reporting.run_files import Curve, read_curve, read_metrics

BEGIN, END = "<!-- figures: written by `charnerf card` -->", "<!-- end of figures -->"
CURVE_PICTURE = "curve.png"


def write_card(card: Path, curves: Sequence[Path], measured: Mapping[str, Path]) -> list[Path]:
    """Write the figures into a card, the curve's picture and the metrics beside it.

    Args:
        card: Markdown file with the lines of BEGIN and END.
        curves: curve.csv of the runs that made the weights, in order; each went on from the one before.
        measured: By title, folders of evaluations (or their metrics.json).

    Returns:
        The files written, the card first.

    Raises:
        DataError: If the card lacks its marks, or a file is missing or wrong.
    """
    text = _read(card)
    found = {title: read_metrics(_metrics_file(path)) for title, path in measured.items()}
    joined = join_curves([read_curve(path) for path in curves])
    lines, files = [BEGIN], [card]
    if joined:
        picture = plot_training(joined, card.parent / CURVE_PICTURE)
        if picture is not None:
            files.append(picture)
            lines += ["", f"![Validation PSNR while training]({CURVE_PICTURE})"]
        lines += ["", _training(joined, curves)]
    for title, metrics in found.items():
        copy = card.parent / f"metrics_{_slug(title)}.json"
        if _metrics_file(measured[title]).resolve() != copy.resolve():
            write_metrics(copy, _published(metrics))
        files.append(copy)
        lines += ["", *_tables(title, metrics, copy.name)]
    start, end = text.index(BEGIN), text.index(END)
    write_text(card, text[:start] + "\n".join([*lines, "", ""]) + text[end:])
    return files


def _published(metrics: dict[str, Any]) -> dict[str, Any]:
    """Metrics that name the data set but not the folder of somebody's machine that it lay in."""
    root = metrics.get("data_root")
    return metrics if root is None else {**metrics, "data_root": Path(root).name}


def titled(texts: Sequence[str]) -> dict[str, Path]:
    """Folders by title of TITLE=FOLDER.

    Raises:
        ConfigError: If a text is not of this form.
    """
    found = {}
    for text in texts:
        title, _, folder = text.partition("=")
        if not title or not folder:
            raise ConfigError(f"--measured: found '{text}', expected TITLE=FOLDER.")
        found[title] = Path(folder)
    return found


def join_curves(curves: Sequence[Curve]) -> Curve:
    """One curve of runs that went on from one another: seconds and steps that begin anew are added to those before."""
    joined: Curve = []
    for curve in curves:
        rows = [row for row in curve if "seconds" in row]
        for key in ("seconds", "step"):
            before = max((row[key] for row in joined if key in row), default=0.0)
            first = min((row[key] for row in rows if key in row), default=before)
            if first < before:
                rows = [{**row, key: row[key] + before} if key in row else row for row in rows]
        joined += rows
    return joined


def _read(card: Path) -> str:
    try:
        text = card.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(
            f"{card}: can not be read ({error}), expected the Markdown file of a model card."
        ) from error
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(END) < text.index(BEGIN):
        raise DataError(
            f"{card}: expected the lines '{BEGIN}' and '{END}' once each, in this order; add them."
        )
    return text


def _metrics_file(path: Path) -> Path:
    return path / "metrics.json" if path.is_dir() else path


def _slug(title: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", title.lower()).strip("_")


def _training(curve: Curve, curves: Sequence[Path]) -> str:
    """One sentence on the runs."""
    last, key = curve[-1], "val_psnr_foreground"
    best = max((row for row in curve if key in row), key=lambda row: row[key], default=None)
    sentence = (
        f"{len(curves)} run{'s' if len(curves) > 1 else ''}, {seconds_text(last['seconds'])} of training"
    )
    if "step" in last:
        sentence += f", {last['step']:.0f} steps"
    if best is not None:
        sentence += (
            f"; best validation: {best[key]:.2f} dB on the foreground after {seconds_text(best['seconds'])}"
        )
    return sentence + "."


def _tables(title: str, metrics: Mapping[str, Any], file: str) -> list[str]:
    """A set's tables: methods, then azimuths, then seconds."""
    baselines = metrics.get("baselines", {})
    rows = [["charnerf", *metric_cells(metrics)]]
    order = [*BASELINE_NAMES, *(name for name in baselines if name not in BASELINE_NAMES)]
    rows += [
        [BASELINE_NAMES.get(name, name), *metric_cells(baselines[name])]
        for name in order
        if name in baselines and baselines[name].get("psnr") is not None
    ]
    seconds, every = metrics["seconds"], metrics["num_views"] // max(metrics["num_characters"], 1)
    return [
        f"**{title}**: {metrics['num_characters']} characters of the {metrics['split']} split, {every} views each"
        f" ([all figures]({file})). {seconds_text(seconds.get('encode'))} to encode a character, "
        f"{seconds_text(seconds.get('render_per_frame'))} a frame, {seconds_text(seconds.get('mesh'))} a mesh.",
        "",
        *table(["", *(name for name, _ in COLUMNS.values())], rows),
        "",
        *_azimuths(metrics),
    ]


def _azimuths(metrics: Mapping[str, Any]) -> list[str]:
    """PSNR and foreground PSNR by azimuth, ours and the visual hull's."""
    hull = metrics.get("baselines", {}).get("visual_hull", {}).get("by_azimuth", [])
    bins = metrics["by_azimuth"]
    rows = []
    for who, found in (("charnerf", bins), ("visual hull", hull)):
        for key, what in (("psnr", "PSNR"), ("psnr_foreground", "foreground")):
            if found:
                rows.append([f"{who}, {what}", *(cell(row.get(key), "{:.1f}") for row in found)])
    return table(["dB by azimuth", *(f"{row['azimuth_deg']}°" for row in bins)], rows)
