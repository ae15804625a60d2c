"""How figures stand: the poses that turnarounds are drawn in, and their shares."""

from dataclasses import dataclass

import numpy as np

Range = tuple[float, float]
FRONT = np.array((0.0, -1.0, 0.0))
_APART, _STRIDING, _TWISTED, _LOOKING_ASIDE, _UNEVEN = 0.45, 0.15, 0.25, 0.2, 0.2  # shares of the figures


@dataclass(frozen=True)
class Arm:
    """Angles of an arm, degrees: below level, swung forwards, and of the elbow, which bends to the front."""

    down: float
    forward: float
    elbow: float


@dataclass(frozen=True)
class Leg:
    """Angles of a leg from straight down, degrees: outwards and forwards."""

    out: float
    forward: float


@dataclass(frozen=True)
class Stance:
    """A whole pose; pairs are the figure's left (+x) and right, angles in degrees.

    Attributes:
        arms: Both arms.
        legs: Both legs.
        twist: Of the shoulders against the hips, about the vertical.
        lean: Of the trunk to its left.
        look: Turn of the head to its left.
    """

    arms: tuple[Arm, Arm]
    legs: tuple[Leg, Leg]
    twist: float
    lean: float
    look: float


# share of the figures; ranges of down, forward and elbow: half of turnarounds hold their arms down, most others as A, some as T
ARM_POSES: dict[str, tuple[float, Range, Range, Range]] = {
    "down": (0.45, (66.0, 86.0), (-5.0, 20.0), (0.0, 30.0)),
    "A": (0.3, (25.0, 66.0), (-5.0, 20.0), (0.0, 20.0)),
    "T": (0.15, (-5.0, 12.0), (-5.0, 5.0), (0.0, 8.0)),
    "holding": (0.1, (45.0, 80.0), (0.0, 50.0), (40.0, 110.0)),
}


def arm_directions(arm: Arm, side: float) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (3,) along upper arm and forearm, world frame; side is 1 for the left (+x) and -1 for the right."""
    upper, turn = _direction(arm.down, arm.forward, side), np.radians(arm.elbow)
    forwards = FRONT - (FRONT @ upper) * upper
    length = np.linalg.norm(forwards)
    if length < 1e-6:  # an arm held straight forwards
        return upper, upper
    return upper, np.cos(turn) * upper + np.sin(turn) * forwards / length


def leg_direction(leg: Leg, side: float) -> np.ndarray:
    """Unit vector (3,) from hip to ankle, world frame; side is 1 for the left (+x) and -1 for the right."""
    return _direction(90.0 - leg.out, leg.forward, side)


def _direction(down_deg: float, forward_deg: float, side: float) -> np.ndarray:
    """Unit vector (3,) to a side, turned below level, then about the axis from side to side to the front."""
    down, forward = np.radians(down_deg), np.radians(forward_deg)
    return np.array((side * np.cos(down), -np.sin(down) * np.sin(forward), -np.sin(down) * np.cos(forward)))


def draw_stance(rng: np.random.Generator) -> Stance:
    """A stance at random; in one of five each arm has a pose of its own."""
    first, second = rng.choice(list(ARM_POSES), size=2, p=[pose[0] for pose in ARM_POSES.values()])
    left = _draw_arm(rng, first)
    right = _draw_arm(rng, second) if rng.random() < _UNEVEN else _nearly(rng, left)
    out = float(rng.uniform(4.0, 20.0)) if rng.random() < _APART else float(rng.uniform(0.0, 4.0))
    stride = float(rng.uniform(-25.0, 25.0)) if rng.random() < _STRIDING else 0.0
    twist, look = rng.uniform(-20.0, 20.0, 2) * (rng.random(2) < (_TWISTED, _LOOKING_ASIDE))
    legs = (Leg(out, stride), Leg(out * float(rng.uniform(0.7, 1.3)), -stride))
    return Stance((left, right), legs, float(twist), float(rng.normal(0.0, 2.0)), float(look))


def _draw_arm(rng: np.random.Generator, pose: str) -> Arm:
    return Arm(*(float(rng.uniform(*limits)) for limits in ARM_POSES[pose][1:]))


def _nearly(rng: np.random.Generator, arm: Arm) -> Arm:
    """The other side's arm of somebody who means to stand evenly."""
    down, forward, elbow = rng.normal(0.0, 2.0, 3)
    return Arm(arm.down + float(down), arm.forward + float(forward), max(arm.elbow + float(elbow), 0.0))
