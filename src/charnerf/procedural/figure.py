"""What the builders of parts share: proportions, colours, surface and the random numbers of one character."""

from dataclasses import dataclass

import numpy as np

from charnerf.procedural.build import Build, make_build
from charnerf.procedural.palette import Palette, make_palette
from charnerf.procedural.proportions import CHANCES
from charnerf.procedural.shapes import Array

SURFACES = ("human", "creature", "fur", "robot", "skeleton")


@dataclass(frozen=True)
class Figure:
    """One character being made.

    shade is the brightness at the bottom of painted ramps (1 is none); crisp tells hard, box-like parts from
    soft ones; grain is the strength of cloth's blotches.
    """

    rng: np.random.Generator
    build: Build
    palette: Palette
    surface: str
    shade: float
    crisp: bool
    grain: float

    def chance(self, probability: float) -> bool:
        """True with a probability."""
        return bool(self.rng.uniform() < probability)

    def between(self, low: float, high: float) -> float:
        """A uniform random number."""
        return float(self.rng.uniform(low, high))

    def choose(self, *options: str) -> str:
        """One of the options."""
        return options[int(self.rng.integers(len(options)))]

    @property
    def trunk_bottom(self) -> float:
        """Height of the crotch, m."""
        return self.build.hip_height - 0.4 * self.build.leg_radius

    def trunk(self, share: float, margin: float = 1.0) -> tuple[Array, Array]:
        """Centre (3,) and half sizes (2,) of the trunk at a share of its height, grown by a margin."""
        build = self.build
        chest = build.waist + 0.75 * (build.shoulder - build.arm_radius * 0.6 - build.waist)
        top = max(build.shoulder - 1.0 * build.arm_radius, 0.6 * build.waist)
        neck = min(0.42 * build.head_width, 0.5 * top) if build.name != "blocky" else top
        hips = max(build.hip, 0.7 * build.waist) if build.name != "blocky" else build.waist
        knots = (0.0, 0.14, 0.42, 0.68, 0.88, 1.0)
        if build.name == "blocky":
            widths, depths = (
                (build.waist, build.waist, build.waist, build.waist, build.waist, build.waist),
                (1.0,) * 6,
            )
        else:
            widths = (0.72 * hips, hips, build.waist, chest, top, neck)
            bust = 1.1 if build.feminine else 1.0
            depths = (0.72, 0.98, 0.86 if build.name != "giant" else 1.05, bust, 0.78, 0.5)
        half = (np.interp(share, knots, widths), build.depth * np.interp(share, knots, depths))
        height = self.trunk_bottom + share * (build.shoulder_height - self.trunk_bottom)
        belly = (
            -0.25 * build.depth * np.exp(-(((share - 0.35) / 0.2) ** 2)) * (build.name in ("giant", "blob"))
        )
        return np.array((0.0, -build.stoop * share**2 + belly, height)), margin * np.array(half)


def make_figure(rng: np.random.Generator) -> Figure:
    """Draw a build, a surface and colours."""
    names = tuple(CHANCES)
    weights = np.array(tuple(CHANCES.values()))
    build = make_build(rng, names[int(rng.choice(len(names), p=weights / weights.sum()))])
    chances = (0.70, 0.10, 0.08, 0.08, 0.04)
    if build.name == "realistic":
        chances = (0.94, 0.03, 0.0, 0.03, 0.0)
    elif build.name == "blob":
        chances = (0.05, 0.5, 0.35, 0.1, 0.0)
    elif build.name == "blocky":
        chances = (0.75, 0.12, 0.0, 0.13, 0.0)
    surface = SURFACES[int(rng.choice(len(SURFACES), p=chances))]
    return Figure(
        rng=rng,
        build=build,
        palette=make_palette(rng, surface),
        surface=surface,
        shade=float(rng.uniform(0.72, 0.95)) if rng.uniform() < 0.45 else 1.0,
        crisp=build.power > 2.9 or build.sides <= 6,
        grain=float(rng.uniform(0.02, 0.07)) if rng.uniform() < 0.3 else 0.0,
    )
