"""The content of metrics.json and views.csv from the results of characters, and the files themselves."""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import torch

from charnerf.evaluation.ahead import characters_ahead
from charnerf.evaluation.angles import ANGLE_KEYS, by_azimuth, by_elevation, by_source_angle
from charnerf.evaluation.character import OURS, CharacterResult
from charnerf.evaluation.environment import environment
from charnerf.evaluation.scores import VIEW_KEYS, summarize
from charnerf.evaluation.timing import process_peak_mib
from charnerf.files import write_text
from charnerf.types import LeftOut

VIEWS_FILE = "views.csv"


def split_metrics(
    results: Sequence[CharacterResult],
    root: str | Path,
    split: str,
    *,
    device: torch.device,
    train_seconds: float | None,
    processes: int = 1,
) -> dict[str, Any]:
    """All numbers of a split in the form of metrics.json; measured in at most so many processes."""
    count = min(processes, len(results))
    ours = [result.scores[OURS] for result in results]
    views = [scores.views for scores in ours]
    drawings = [result.drawings for result in results if result.drawings is not None]
    per_character = _by_character(results, OURS)
    return {
        "split": split,
        "num_characters": len(results),
        "num_views": sum(map(len, views)),
        **summarize(ours),
        "by_azimuth": by_azimuth(views, VIEW_KEYS),
        "by_elevation": by_elevation(views, VIEW_KEYS),
        "by_source_angle": by_source_angle(views, VIEW_KEYS),
        "per_character": {
            result.name: {"num_views": len(result.frames), **per_character[result.name]} for result in results
        },
        "baselines": _baselines(results, per_character),
        **({"drawings": summarize(drawings)} if drawings else {}),
        "seconds": _seconds(results, train_seconds),
        **_memory(results, device),
        "left_out": _left_out(sum((result.left_out for result in results), LeftOut())),
        "environment": environment(device) | ({"threads": 1, "processes": count} if count > 1 else {}),
        "data_root": str(Path(root).resolve()),
    }


def _by_character(results: Sequence[CharacterResult], method: str) -> dict[str, dict[str, Any]]:
    """The means of a method over the views of each character."""
    return {result.name: summarize([result.scores[method]]) for result in results}


def _baselines(results: Sequence[CharacterResult], ours: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Every metric of the baselines, and where they beat the model; the hull's seconds; which training characters were nearest."""
    baselines: dict[str, Any] = {}
    for method in results[0].scores:
        if method != OURS:
            scores = [result.scores[method] for result in results]
            by_angle = by_azimuth([each.views for each in scores], VIEW_KEYS)
            ahead = characters_ahead(_by_character(results, method), ours)
            baselines[method] = {**summarize(scores), "by_azimuth": by_angle, "ahead": ahead}
    if "nearest" in baselines:
        baselines["nearest"]["found"] = {
            result.name: {"character": near.name, "silhouette_iou_of_sources": near.iou}
            for result in results
            if (near := result.nearest) is not None
        }
    if "visual_hull" in baselines:
        baselines["visual_hull"]["seconds"] = {
            "encode": _median_seconds(results, "hull_encode"),
            "render_per_frame": _median_seconds(results, "hull_render"),
        }
    return baselines


def _seconds(results: Sequence[CharacterResult], train_seconds: float | None) -> dict[str, Any]:
    """Median seconds of the stages, null with the reason where one did not run."""
    seconds: dict[str, Any] = {"train": train_seconds}
    if train_seconds is None:
        seconds["train_reason"] = "the training time of these weights is not known here"
    seconds["encode"] = _median_seconds(results, "encode")
    seconds["render_per_frame"] = _median_seconds(results, "render")
    seconds["mesh"] = _median_seconds(results, "mesh")
    if seconds["mesh"] is None:
        seconds["mesh_reason"] = "no mesh was made"
    seconds["metrics"] = _median_seconds(results, "metrics")
    return seconds


def _median_seconds(results: Sequence[CharacterResult], stage: str) -> float | None:
    """Median over the executions of a stage; None if it never ran."""
    seconds = [one for result in results for one in result.seconds.get(stage, ())]
    return median(seconds) if seconds else None


def _memory(results: Sequence[CharacterResult], device: torch.device) -> dict[str, Any]:
    """Peak memory of all, and of each stage of ours, MiB; null with the reason, and no stages, where the system does not tell."""
    peaks: dict[str, float] = {}
    for result in results:
        for stage, peak in result.peaks_mib.items():
            peaks[stage] = max(peaks.get(stage, 0.0), peak)
    whole = max(peaks.values(), default=0.0) if device.type == "cuda" else process_peak_mib()
    if whole is not None:  # what was measured in other processes is not in this one's peak
        whole = max(whole, *peaks.values(), 0.0)
    stages = {stage: peaks[stage] for stage in ("encode", "render", "mesh") if stage in peaks}
    memory: dict[str, Any] = {"peak_memory_mib": whole, "peak_memory_by_stage_mib": stages}
    if whole is None:
        memory["peak_memory_mib_reason"] = "the system does not tell"
    return memory


def _left_out(left_out: LeftOut) -> dict[str, Any]:
    """Shares left out; null with the reason where there was nothing of the kind."""
    shares = left_out.shares()
    missing = [key for key, share in shares.items() if share is None]
    return {**shares, **{f"{key}_reason": "nothing of the kind was counted" for key in missing}}


def write_metrics(path: str | Path, metrics: Mapping[str, Any]) -> None:
    """Write metrics.json, whole or not at all.

    Raises:
        ValueError: If a number is NaN or infinite, which JSON can not say.
    """
    write_text(Path(path), json.dumps(metrics, indent=2, allow_nan=False) + "\n")


def write_views(path: Path, results: Sequence[CharacterResult]) -> None:
    """Write views.csv: a row for every method, character and view, empty cells where a metric could not be had."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    keys = (*ANGLE_KEYS, *VIEW_KEYS)
    rows.writerow(("method", "character", "view", *keys))
    for method in results[0].scores:
        for result in results:
            for frame, record in zip(result.frames, result.scores[method].views, strict=False):
                rows.writerow((method, result.name, frame, *(record[key] for key in keys)))
    write_text(path, text.getvalue())
