"""Where a picture was taken from, and means over bins of those angles.

A record is one view's metrics, a dict of numbers or None. Means are over the views of a character, then over
characters.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import torch
from torch import Tensor

from charnerf.geometry.cameras import angles_from_direction
from charnerf.types import Cameras, SourceViews

AZIMUTH_STEP_DEG = 30
ELEVATION_EDGES_DEG = (-90, -60, -30, -15, 0, 15, 30, 45, 60, 75, 90)
SOURCE_EDGES_DEG = (0, 15, 30, 45, 60, 75, 90, 105, 120, 135, 150, 165, 180)
"""Bins beyond 90 degrees are listed only where views fall into them: front, side and back leave none."""

ANGLE_KEYS = ("azimuth_deg", "elevation_deg", "source_angle_deg")
Record = Mapping[str, float | None]


@dataclass(frozen=True)
class ViewAngles:
    """Angles of views (N,), degrees: azimuth in [0, 360), elevation, angle to the nearest source view."""

    azimuth_deg: Tensor
    elevation_deg: Tensor
    source_deg: Tensor

    def records(self) -> list[Record]:
        """One record a view: azimuth_deg, elevation_deg, source_angle_deg."""
        columns = (self.azimuth_deg.tolist(), self.elevation_deg.tolist(), self.source_deg.tolist())
        return [dict(zip(ANGLE_KEYS, row, strict=True)) for row in zip(*columns, strict=True)]


def view_angles(cameras: Cameras, sources: SourceViews) -> ViewAngles:
    """Angles of cameras (N,) by their viewing axes, against the sources (B = 1) that are present."""
    towards = cameras.world_from_camera[:, :3, 2].double()
    azimuth, elevation = angles_from_direction(towards)
    there = sources.cameras.world_from_camera[0][sources.present[0]][:, :3, 2].double()
    cosines = (towards[:, None, :] * there[None].to(towards.device)).sum(-1).amax(dim=1)
    return ViewAngles(azimuth, elevation, torch.rad2deg(torch.acos(cosines.clamp(-1.0, 1.0))))


def azimuth_bin(azimuth_deg: float) -> int:
    """Bin of 30 degrees centred on 0, 30, ..; a bin holds its lower edge: -15 <= azimuth < 15 is 0."""
    return int((azimuth_deg + AZIMUTH_STEP_DEG / 2) % 360.0 // AZIMUTH_STEP_DEG)


def edge_bin(value: float, edges: Sequence[float]) -> int:
    """Index of the bin edges[i] <= value < edges[i + 1]; the last bin holds its upper edge too."""
    return sum(value >= edge for edge in edges[1:-1])


def mean_of(records: Sequence[Record], keys: Sequence[str]) -> dict[str, float | None]:
    """Mean of each key over the records that have a number for it; None where none has."""
    means: dict[str, float | None] = {}
    for key in keys:
        values = [value for record in records if (value := record.get(key)) is not None]
        means[key] = sum(values) / len(values) if values else None
    return means


def mean_over_characters(
    per_character: Sequence[Sequence[Record]], keys: Sequence[str]
) -> dict[str, float | None]:
    """Mean over the views of each character, then over the characters that have any."""
    return mean_of([mean_of(views, keys) for views in per_character if views], keys)


def binned_means(
    per_character: Sequence[Sequence[Record]],
    keys: Sequence[str],
    *,
    bin_of: Callable[[Record], int],
    labels: Sequence[Mapping[str, Any]],
) -> list[dict[str, Any]]:
    """Means in bins: label, keys and num_views; an empty bin has null and the reason beside each key."""
    rows: list[dict[str, Any]] = []
    for index, label in enumerate(labels):
        chosen = [[view for view in views if bin_of(view) == index] for views in per_character]
        count = sum(len(views) for views in chosen)
        row: dict[str, Any] = {**label, "num_views": count, **mean_over_characters(chosen, keys)}
        if not count:
            row |= {f"{key}_reason": "no view in this bin" for key in keys}
        rows.append(row)
    return rows


def by_azimuth(per_character: Sequence[Sequence[Record]], keys: Sequence[str]) -> list[dict[str, Any]]:
    """Means in twelve 30-degree bins of azimuth; records carry azimuth_deg."""
    labels = [{"azimuth_deg": step} for step in range(0, 360, AZIMUTH_STEP_DEG)]
    return binned_means(
        per_character, keys, bin_of=lambda view: azimuth_bin(view["azimuth_deg"] or 0.0), labels=labels
    )


def _by_edges(
    per_character: Sequence[Sequence[Record]], keys: Sequence[str], angle: str, edges: Sequence[int]
) -> list[dict[str, Any]]:
    """Means in bins between edges of one of the angles."""
    labels = [{f"{angle}_from": low, f"{angle}_to": high} for low, high in pairwise(edges)]
    return binned_means(
        per_character, keys, bin_of=lambda view: edge_bin(view[angle] or 0.0, edges), labels=labels
    )


def by_elevation(per_character: Sequence[Sequence[Record]], keys: Sequence[str]) -> list[dict[str, Any]]:
    """Means in bins of elevation, those with views only; records carry elevation_deg."""
    rows = _by_edges(per_character, keys, "elevation_deg", ELEVATION_EDGES_DEG)
    return [row for row in rows if row["num_views"]]


def by_source_angle(per_character: Sequence[Sequence[Record]], keys: Sequence[str]) -> list[dict[str, Any]]:
    """Means in 15-degree bins of the angle to the nearest source view; records carry source_angle_deg."""
    rows = _by_edges(per_character, keys, "source_angle_deg", SOURCE_EDGES_DEG)
    return [row for row in rows if row["num_views"] or row["source_angle_deg_to"] <= 90]
