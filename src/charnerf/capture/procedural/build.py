"""Proportions: where the joints of a character are and how thick its limbs are."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from charnerf.capture.procedural.shapes import Array

# Ranges in metres for a figure 2 m tall, unless a name says otherwise (share: of head height, of what is left below the neck).
RANGES: dict[str, dict[str, tuple[float, float]]] = {
    "realistic": {
        "head": (0.25, 0.30), "head_width_share": (0.66, 0.80), "head_depth_share": (0.80, 0.95), "neck": (0.05, 0.09),
        "leg_share": (0.53, 0.58), "shoulder": (0.19, 0.26), "depth": (0.105, 0.15), "waist": (0.125, 0.175), "hip": (0.15, 0.19),
        "arm": (0.54, 0.66), "arm_radius": (0.042, 0.062), "leg_radius": (0.075, 0.10), "hand": (0.07, 0.09), "foot": (0.22, 0.28),
    },
    "stylised": {
        "head": (0.32, 0.46), "head_width_share": (0.72, 0.95), "head_depth_share": (0.75, 1.0), "neck": (0.02, 0.08),
        "leg_share": (0.45, 0.56), "shoulder": (0.20, 0.32), "depth": (0.11, 0.18), "waist": (0.13, 0.22), "hip": (0.16, 0.24),
        "arm": (0.50, 0.66), "arm_radius": (0.05, 0.09), "leg_radius": (0.08, 0.12), "hand": (0.08, 0.13), "foot": (0.24, 0.32),
    },
    "chunky": {
        "head": (0.42, 0.58), "head_width_share": (0.80, 1.05), "head_depth_share": (0.80, 1.0), "neck": (0.0, 0.05),
        "leg_share": (0.38, 0.50), "shoulder": (0.28, 0.42), "depth": (0.16, 0.25), "waist": (0.20, 0.32), "hip": (0.22, 0.30),
        "arm": (0.46, 0.64), "arm_radius": (0.085, 0.13), "leg_radius": (0.11, 0.15), "hand": (0.12, 0.18), "foot": (0.28, 0.38),
    },
    "chibi": {
        "head": (0.78, 1.05), "head_width_share": (0.88, 1.15), "head_depth_share": (0.80, 1.05), "neck": (-0.03, 0.02),
        "leg_share": (0.30, 0.46), "shoulder": (0.18, 0.30), "depth": (0.13, 0.21), "waist": (0.17, 0.28), "hip": (0.18, 0.26),
        "arm": (0.28, 0.44), "arm_radius": (0.06, 0.10), "leg_radius": (0.085, 0.125), "hand": (0.08, 0.13), "foot": (0.22, 0.32),
    },
    "giant": {
        "head": (0.24, 0.36), "head_width_share": (0.75, 1.0), "head_depth_share": (0.8, 1.0), "neck": (-0.06, 0.04),
        "leg_share": (0.34, 0.44), "shoulder": (0.40, 0.55), "depth": (0.22, 0.34), "waist": (0.22, 0.40), "hip": (0.22, 0.32),
        "arm": (0.62, 0.86), "arm_radius": (0.10, 0.16), "leg_radius": (0.12, 0.17), "hand": (0.13, 0.20), "foot": (0.30, 0.40),
    },
    "blob": {
        "head": (0.62, 0.90), "head_width_share": (0.85, 1.1), "head_depth_share": (0.70, 0.95), "neck": (-0.16, -0.05),
        "leg_share": (0.26, 0.40), "shoulder": (0.28, 0.42), "depth": (0.24, 0.36), "waist": (0.30, 0.46), "hip": (0.28, 0.40),
        "arm": (0.50, 0.80), "arm_radius": (0.08, 0.13), "leg_radius": (0.10, 0.15), "hand": (0.12, 0.18), "foot": (0.26, 0.38),
    },
    "blocky": {
        "head": (0.46, 0.70), "head_width_share": (0.85, 1.05), "head_depth_share": (0.70, 1.0), "neck": (-0.03, 0.0),
        "leg_share": (0.38, 0.52), "shoulder": (0.24, 0.40), "depth": (0.12, 0.20), "waist": (0.22, 0.34), "hip": (0.22, 0.32),
        "arm": (0.44, 0.62), "arm_radius": (0.08, 0.13), "leg_radius": (0.10, 0.15), "hand": (0.09, 0.13), "foot": (0.24, 0.32),
    },
}  # fmt: skip
CHANCES = {
    "realistic": 0.22, "stylised": 0.22, "chunky": 0.14, "chibi": 0.16, "giant": 0.07, "blob": 0.07, "blocky": 0.12,
}  # fmt: skip


@dataclass(frozen=True)
class Build:
    """Proportions of one character, m; its crown is at 2 m before hats, and all is scaled at the end.

    sides and power are the cross-sections of limbs and trunk (see shapes.loft); arm_angle_deg is how far arms hang below level.
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
            "arm_angle_deg": rng.uniform(68.0, 86.0), "elbow_deg": rng.uniform(0.0, 8.0), "arm_forward_deg": rng.uniform(0.0, 18.0),
        }  # fmt: skip
    if kind < down_chance + 0.24:
        return {
            "arm_angle_deg": rng.uniform(25.0, 60.0), "elbow_deg": rng.uniform(0.0, 12.0), "arm_forward_deg": rng.uniform(0.0, 30.0),
        }  # fmt: skip
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
