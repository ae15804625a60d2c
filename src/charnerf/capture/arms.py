"""Arms held out to the sides, lowered and bent: a T pose becomes an A pose.

Most characters that can be had stand in T pose, and drawings show both. A smooth turn about the shoulders, found in the outline
from the front, and one about the elbows, forward too: arms that always lie beside the body teach a network to put them there,
whatever the side drawing shows.
"""

from dataclasses import dataclass

import numpy as np

from charnerf.capture.outline import CELL_WIDTH, ROW_HEIGHT, middle_runs
from charnerf.capture.turns import rise, turned
from charnerf.geometry.world import HEIGHT
from charnerf.surfaces.surface_mesh import SurfaceMesh

LOWERED = (np.radians(10.0), np.radians(80.0))  # how far arms are turned down
_BENT = np.radians(15.0)  # standard deviation of the elbows' turns up and down
_FORWARD = np.radians(100.0)  # farthest that forearms turn forward; half of them by less than a quarter of it
_OUTER = 0.6  # share of the reach beyond which there is nothing but arm
_THICKEST = 0.5  # largest extent in height of the outer arms, over the reach, of a T pose
_LOWEST = 0.4  # share of the height below which no arm is level
_LOW_SHOULDERS = 0.6


def lower_arms(surface: SurfaceMesh, rng: np.random.Generator) -> np.ndarray:
    """Triangles of a character with its arms lowered by an angle drawn at random.

    Args:
        surface: World frame, feet on z = 0.
        rng: What angles are drawn from; the same number of draws whatever the surface.

    Returns:
        float64 (M, 3, 3); those of the surface where it does not hold its arms out level.
    """
    down, elbows, forward = rng.uniform(*LOWERED), rng.normal(0.0, _BENT), _FORWARD * rng.random() ** 2
    triangles = surface.triangles.astype(np.float64)
    arms = find_arms(surface, middle_runs(surface))
    if arms is None:
        return triangles
    shoulder, low, high = arms.shoulder, arms.low, arms.high
    elbow = shoulder + 0.45 * (arms.reach - shoulder)
    x, y, z = triangles.reshape(-1, 3).T
    side, out = np.where(x < 0.0, -1.0, 1.0), np.abs(x)
    middle, soft = 0.5 * (low + high), 0.04 * HEIGHT
    arm = rise(z, low - soft, low) * rise(-z, -high - soft, -high)
    # the forearm first, while it lies along x: down by one turn, forward by the other
    lower = arm * rise(out, elbow - soft, elbow + soft)
    out, z = turned(out, z, (elbow, middle), -elbows * lower)
    out, y = turned(out, y, (elbow, 0.0), -forward * lower)
    out, z = turned(out, z, (shoulder, middle), -down * arm * rise(out, shoulder - soft, shoulder + soft))
    return np.stack((side * np.maximum(out, 0.0), y, z), axis=1).reshape(-1, 3, 3)


@dataclass(frozen=True)
class Arms:
    """Arms held out level: distances of shoulders and hands from the middle, lowest and highest place, m."""

    shoulder: float
    reach: float
    low: float
    high: float


def find_arms(surface: SurfaceMesh, runs: np.ndarray) -> Arms | None:
    """Where a character holds its arms out level, if it does.

    Args:
        surface: World frame, feet on z = 0.
        runs: Its `middle_runs`.
    """
    corners = surface.triangles.reshape(-1, 3).astype(np.float64)
    out, z = np.abs(corners[:, 0]), corners[:, 2]
    reach = float(out.max())
    outer = z[out > _OUTER * reach]
    low, high = float(outer.min()), float(outer.max())
    widths = runs * (0.5 * CELL_WIDTH)  # half, m
    below = widths[int(0.55 * low / ROW_HEIGHT) : int(low / ROW_HEIGHT)]
    above = widths[int(high / ROW_HEIGHT) + 1 :]
    if high - low > _THICKEST * reach or low < _LOWEST * HEIGHT or not len(below) or not len(above):
        return None
    shoulder = float(np.median(below))
    if high < _LOW_SHOULDERS * HEIGHT:  # under a large head: what is as far out as that is no arm
        shoulder = max(shoulder, float(above.max()))
    return Arms(shoulder, reach, low, high) if 0.0 < shoulder < 0.75 * reach else None
