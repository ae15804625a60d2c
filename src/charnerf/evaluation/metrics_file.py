"""The content of metrics.json and views.csv from what an evaluation collected, and the files themselves."""

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, final

import torch

from charnerf.evaluation.angles import by_azimuth, by_elevation, by_source_angle
from charnerf.evaluation.environment import environment
from charnerf.evaluation.scores import ANGLE_KEYS, VIEW_KEYS, CharacterScores, summarize
from charnerf.evaluation.timing import Stopwatch, process_peak_mib
from charnerf.files import write_text
from charnerf.types import LeftOut

VIEWS_FILE = "views.csv"


@final
class Collected:
    """What is collected while characters pass by.

    Attributes:
        watch: Seconds and memory of the stages.
        left_out: Work that was not done, summed.
        nearest: By character, the training character that the baseline `nearest` took, and how well it fits.
        scores: By method ("ours" and the baselines), then by character.
    """

    def __init__(self, device: torch.device, methods: Sequence[str]) -> None:
        self.watch = Stopwatch(device)
        self.left_out = LeftOut()
        self.nearest: dict[str, dict[str, Any]] = {}
        self.scores: dict[str, dict[str, CharacterScores]] = {method: {} for method in methods}


def collected_metrics(
    state: Collected, names: Sequence[str], *, split: str, train_seconds: float | None
) -> dict[str, Any]:
    """All numbers in the form of metrics.json."""
    ours = [state.scores["ours"][name] for name in names]
    views = [scores.views for scores in ours]
    return {
        "split": split,
        "num_characters": len(names),
        "num_views": sum(len(found) for found in views),
        **summarize(ours),
        "by_azimuth": by_azimuth(views, VIEW_KEYS),
        "by_elevation": by_elevation(views, VIEW_KEYS),
        "by_source_angle": by_source_angle(views, VIEW_KEYS),
        "per_character": {
            name: {"num_views": len(scores.views), **summarize([scores])}
            for name, scores in zip(names, ours, strict=True)
        },
        "baselines": _baselines(state, names),
        "seconds": _seconds(state.watch, train_seconds),
        **_memory(state.watch),
        "left_out": _left_out(state.left_out),
        "environment": environment(state.watch.device),
    }


def _baselines(state: Collected, names: Sequence[str]) -> dict[str, Any]:
    """Every metric of the baselines; the hull's seconds, and which training characters were nearest."""
    found: dict[str, Any] = {}
    for method, by_name in state.scores.items():
        if method != "ours":
            scores = [by_name[name] for name in names]
            found[method] = summarize(scores)
            found[method]["by_azimuth"] = by_azimuth([each.views for each in scores], VIEW_KEYS)
    if "nearest" in found:
        found["nearest"]["found"] = state.nearest
    if "visual_hull" in found:
        found["visual_hull"]["seconds"] = {
            "encode": state.watch.median_seconds("hull_encode"),
            "render_per_frame": state.watch.median_seconds("hull_render"),
        }
    return found


def _seconds(watch: Stopwatch, train_seconds: float | None) -> dict[str, Any]:
    """Median seconds of the stages, null with the reason where one did not run."""
    seconds: dict[str, Any] = {"train": train_seconds}
    if train_seconds is None:
        seconds["train_reason"] = "the training time of these weights is not known here"
    seconds["encode"] = watch.median_seconds("encode")
    seconds["render_per_frame"] = watch.median_seconds("render")
    seconds["mesh"] = watch.median_seconds("mesh")
    if seconds["mesh"] is None:
        seconds["mesh_reason"] = "no mesh was made"
    return seconds


def _memory(watch: Stopwatch) -> dict[str, Any]:
    """Peak memory of all, and of each stage of ours, MiB."""
    peaks = watch.peaks_mib()
    whole = max(peaks.values(), default=0.0) if watch.device.type == "cuda" else process_peak_mib()
    stages = {stage: peaks[stage] for stage in ("encode", "render", "mesh") if stage in peaks}
    return {"peak_memory_mib": whole, "peak_memory_by_stage_mib": stages}


def _left_out(left_out: LeftOut) -> dict[str, Any]:
    """Shares left out; null with the reason where there was nothing of the kind."""
    shares: dict[str, Any] = dict(left_out.shares())
    return shares | {
        f"{key}_reason": "nothing of the kind was counted"
        for key, share in left_out.shares().items()
        if share is None
    }


def write_metrics(path: str | Path, metrics: dict[str, Any]) -> None:
    """Write metrics.json in one step: a reader finds the old file or the whole new one.

    Raises:
        ValueError: If a number is NaN or infinite, which JSON can not say.
    """
    write_text(Path(path), json.dumps(metrics, indent=2, allow_nan=False) + "\n")


def write_views(path: Path, state: Collected) -> None:
    """Write views.csv: a row for every method, character and view, empty cells where a metric could not be had."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(("method", "character", "view", *ANGLE_KEYS, *VIEW_KEYS))
    for method, by_name in state.scores.items():
        for name, scores in by_name.items():
            for frame, record in zip(scores.frames, scores.views, strict=True):
                table.writerow((method, name, frame, *(record[key] for key in (*ANGLE_KEYS, *VIEW_KEYS))))
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, text.getvalue())
