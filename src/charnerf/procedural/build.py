"""Proportions: where the joints of a character are and how thick its limbs are."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from charnerf.procedural.proportions import RANGES
from charnerf.procedural.shapes import Array


@dataclass(frozen=True)
class Build:
    """Proportions of one character, m; its crown is at 2 m before hats, and all is scaled at the end.

    sides and power are the cross-sections of limbs and trunk (see shapes.loft); arm_angle_deg is how far arms
    hang below level.
    """

    name: str
    head: float
    head_width: float
    head_depth: float
    chin: float
    shoulder_height: float
    hip_height: float
    shoulder: float
    depth: float
    waist: float
    hip: float
    arm: float
    arm_radius: float
    leg_radius: float
    hand: float
    foot: float
    arm_angle_deg: float
    elbow_deg: float
    arm_forward_deg: float
    leg_gap: float
    stoop: float
    feminine: bool
    sides: int
    power: float

    def arm_points(self, left: bool) -> Array:
        """Shoulder, elbow and wrist, (3, 3)."""
        side = 1.0 if left else -1.0
        shoulder = np.array(
            (
                side * (self.shoulder - 0.7 * self.arm_radius),
                self.shoulder_y,
                self.shoulder_height - 1.05 * self.arm_radius,
            )
        )
        points = [shoulder]
        for bend, forward in ((0.0, 0.3), (self.elbow_deg, 1.0)):
            down = np.deg2rad(min(self.arm_angle_deg + bend, 88.0))
            ahead = np.deg2rad(self.arm_forward_deg * forward)
            step = np.array(
                (side * np.cos(down) * np.cos(ahead), -np.sin(ahead), -np.sin(down) * np.cos(ahead))
            )
            points.append(points[-1] + 0.5 * self.arm * step)
        return np.stack(points)

    def leg_points(self, left: bool) -> Array:
        """Hip joint, knee and ankle, (3, 3)."""
        side = 1.0 if left else -1.0
        top = side * max(self.hip - self.leg_radius, 0.85 * self.leg_radius)
        ankle = side * (max(self.hip - self.leg_radius, 0.9 * self.leg_radius) + self.leg_gap)
        foot, bend = self.foot_height, 0.0 if self.sides == 4 else 0.015
        return np.array(
            (
                (top, 0.0, self.hip_height + 0.03),
                (0.5 * (top + ankle), -bend, 0.5 * (self.hip_height + foot)),
                (ankle, 0.6 * bend, foot * 0.8),
            )
        )

    @property
    def foot_height(self) -> float:
        """Height of the ankle, m."""
        return 0.55 * self.leg_radius + 0.03

    @property
    def shoulder_y(self) -> float:
        """Where the shoulders are along y: stooping brings them forwards, m."""
        return -0.6 * self.stoop

    @property
    def head_centre(self) -> NDArray[np.float64]:
        """Middle of the head, (3,)."""
        return np.array((0.0, -self.stoop - 0.1 * self.depth, self.chin + 0.5 * self.head))


def _pose(rng: np.random.Generator, name: str) -> dict[str, float]:
    kind = rng.uniform()
    down_chance = 0.45 if name == "blocky" else 0.14
    if kind < down_chance:
        return {
            "arm_angle_deg": rng.uniform(68.0, 86.0),
            "elbow_deg": rng.uniform(0.0, 8.0),
            "arm_forward_deg": rng.uniform(0.0, 18.0),
        }
    if kind < down_chance + 0.24:
        return {
            "arm_angle_deg": rng.uniform(25.0, 60.0),
            "elbow_deg": rng.uniform(0.0, 12.0),
            "arm_forward_deg": rng.uniform(0.0, 30.0),
        }
    bent = rng.uniform(0.0, 8.0) if rng.uniform() < 0.35 else 0.0
    return {
        "arm_angle_deg": bent,
        "elbow_deg": rng.uniform(-3.0, 5.0),
        "arm_forward_deg": rng.uniform(0.0, 6.0),
    }


def make_build(rng: np.random.Generator, name: str) -> Build:
    """Random proportions of a named build (a key of RANGES)."""
    value = {key: float(rng.uniform(*limits)) for key, limits in RANGES[name].items()}
    feminine = bool(rng.uniform() < 0.45)
    chin = 2.0 - value["head"]
    shoulder_height = chin - value["neck"]
    leg = value["leg_share"] * shoulder_height
    slim = 0.9 if feminine and name in ("realistic", "stylised") else 1.0
    blocky = name == "blocky"
    sides = 4 if blocky else int(rng.choice((6, 8, 8, 10, 12, 16)))
    boxy = rng.uniform() < {"realistic": 0.05, "chibi": 0.35, "chunky": 0.5, "giant": 0.4}.get(name, 0.25)
    stooped = rng.uniform() < (0.5 if name in ("giant", "blob") else 0.08)
    arm = value["arm"] * (0.95 if feminine else 1.0)
    return Build(
        name=name,
        head=value["head"],
        head_width=0.5 * value["head"] * value["head_width_share"],
        head_depth=0.5 * value["head"] * value["head_depth_share"],
        chin=chin,
        shoulder_height=shoulder_height,
        hip_height=leg,
        shoulder=value["shoulder"] * slim,
        depth=value["depth"],
        waist=value["waist"] * slim,
        hip=value["waist"] * slim if blocky else max(value["hip"], 1.05 * value["leg_radius"]),
        arm=arm,
        arm_radius=value["arm_radius"] * slim,
        leg_radius=min(value["leg_radius"], 0.49 * value["waist"]) if blocky else value["leg_radius"],
        hand=value["hand"] * slim,
        foot=value["foot"],
        **_pose(rng, name),
        leg_gap=0.0 if blocky else float(rng.choice((0.0, 0.02, 0.05, 0.1))) * rng.uniform(0.3, 1.2),
        stoop=rng.uniform(0.04, 0.14) if stooped else 0.0,
        feminine=feminine,
        sides=sides,
        power=rng.uniform(3.0, 6.0) if boxy or blocky else rng.uniform(2.0, 2.6),
    )
