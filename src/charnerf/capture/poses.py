"""A character in a slightly different pose: limbs and head turned smoothly about joints that its outline shows.

Somebody who draws a turnaround holds no pose exactly: an arm hangs otherwise in the back view, the head is turned in the
side view. A bend of the surface about shoulders, hips and neck makes such views of a mesh without a skeleton. Angles are
in radians.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from charnerf.capture.arms import find_arms
from charnerf.capture.outline import CELL_WIDTH, ROW_HEIGHT, middle_runs
from charnerf.capture.turns import rise, turned
from charnerf.geometry.world import HEIGHT
from charnerf.surfaces.surface_mesh import SurfaceMesh

_SOFT = 0.04 * HEIGHT  # m over which a turn sets in
_CROTCH = (0.2, 0.55)  # shares of the height between which legs part
_NECK = (0.55, 0.95)
_LEGS = 1.7  # of half the trunk's width: as far out as legs stand, hands hang beside them


@dataclass(frozen=True)
class Joints:
    """Where a character bends, seen from the front, m.

    Attributes:
        shoulder: Distance of a shoulder from the middle plane, and its height.
        hip: Distance of a hip from the middle plane, and its height.
        neck: Height of the neck.
        body: Half the width of what is no arm, by row from the floor, (ROWS,).
    """

    shoulder: tuple[float, float]
    hip: tuple[float, float]
    neck: float
    body: np.ndarray


@dataclass(frozen=True)
class Pose:
    """Turns of limbs, radians; pairs are the character's left (+x) and right.

    Attributes:
        arms: In the frontal plane about the shoulders: positive lowers an arm that is held out.
        legs: In the frontal plane about the hips: positive spreads.
        strides: About the hips, forward (-y).
        head_turn: About the vertical, to the character's left.
        head_tilt: In the frontal plane about the neck.
    """

    arms: tuple[float, float] = (0.0, 0.0)
    legs: tuple[float, float] = (0.0, 0.0)
    strides: tuple[float, float] = (0.0, 0.0)
    head_turn: float = 0.0
    head_tilt: float = 0.0


def find_joints(surface: SurfaceMesh) -> Joints:
    """Find shoulders, hips and neck in the outline of a surface (world frame, feet on z = 0)."""
    runs = middle_runs(surface)
    widths, heights = 0.5 * CELL_WIDTH * runs, ROW_HEIGHT * (np.arange(len(runs)) + 0.5)
    within = (heights > _NECK[0] * HEIGHT) & (heights < _NECK[1] * HEIGHT) & (widths > 0)
    neck = float(heights[within][np.argmin(widths[within])]) if within.any() else 0.8 * HEIGHT
    trunk = (heights > _CROTCH[1] * HEIGHT) & (heights < neck) & (widths > 0)
    half = float(np.median(widths[trunk])) if trunk.any() else 0.15 * HEIGHT
    arms = find_arms(surface, runs)
    shoulder = (half, neck - 0.05 * HEIGHT) if arms is None else (arms.shoulder, 0.5 * (arms.low + arms.high))
    parted = (heights > _CROTCH[0] * HEIGHT) & (heights < _CROTCH[1] * HEIGHT) & (runs == 0)
    crotch = float(heights[parted].max()) if parted.any() else 0.45 * HEIGHT
    # rows that hang together with an arm are wider than the trunk: there it ends at the shoulder
    attached = (heights > shoulder[1] - 0.15 * HEIGHT) & (widths > shoulder[0])
    body = np.where(attached, shoulder[0], widths)
    body[heights < crotch] = np.maximum(widths, _LEGS * half)[heights < crotch]  # legs stand apart
    body = ndimage.maximum_filter1d(body, 3)
    return Joints(shoulder, (0.5 * shoulder[0], crotch + 0.02 * HEIGHT), neck, body)


def reposed(surface: SurfaceMesh, joints: Joints, pose: Pose) -> SurfaceMesh:
    """The surface in another pose; its size, place and texture stay (limbs may reach lower or higher)."""
    x, y, z = surface.triangles.reshape(-1, 3).astype(np.float64).T
    left, out = x >= 0.0, np.abs(x)
    (across, shoulder), (hip, crotch), neck = joints.shoulder, joints.hip, joints.neck
    edge = np.interp(z, ROW_HEIGHT * (np.arange(len(joints.body)) + 0.5), joints.body)
    is_head = rise(z, neck - 0.5 * _SOFT, neck + 0.5 * _SOFT) * rise(-out, -2.0 * across, -1.5 * across)
    is_arm = (
        rise(out, edge, edge + _SOFT)
        * rise(z, crotch - 0.25 * HEIGHT, crotch - 0.15 * HEIGHT)
        * (1.0 - is_head)
    )
    is_leg = rise(-z, -crotch - _SOFT, -crotch + _SOFT) * (1.0 - is_arm)
    z, y = turned(z, y, (crotch, 0.0), np.where(left, *pose.strides) * is_leg)
    out, z = turned(out, z, (hip, crotch), np.where(left, *pose.legs) * is_leg)
    out, z = turned(out, z, (across, shoulder), -np.where(left, *pose.arms) * is_arm)
    x = np.where(left, 1.0, -1.0) * out
    x, y = turned(x, y, (0.0, 0.0), pose.head_turn * is_head)
    x, z = turned(x, z, (0.0, neck), pose.head_tilt * is_head)
    return replace(surface, triangles=np.stack((x, y, z), axis=1).reshape(-1, 3, 3).astype(np.float32))


def random_pose(rng: np.random.Generator, *, limbs: float, head: float) -> Pose:
    """A pose with arms off by up to an angle, legs by up to half of it, the head turned by up to another one."""
    return Pose(
        arms=tuple(rng.uniform(-limbs, limbs, 2)),
        legs=tuple(rng.uniform(0.0, 0.5 * limbs, 2)),
        strides=tuple(rng.uniform(-0.5 * limbs, 0.5 * limbs, 2)),
        head_turn=float(rng.uniform(-head, head)),
        head_tilt=float(rng.uniform(-0.3 * head, 0.3 * head)),
    )
