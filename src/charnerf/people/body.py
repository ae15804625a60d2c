"""Bodies: traits between 0 and 1, and the MakeHuman targets that they stand for."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from charnerf.people.assets import Assets

RACES = ("african", "asian", "caucasian")
_SHAPED = (
    "head",
    "forehead",
    "nose",
    "mouth",
    "chin",
    "neck",
    "torso",
    "hip",
    "stomach",
    "pelvis",
    "ears",
    "buttocks",
)


@dataclass(frozen=True)
class Traits:
    """What a body is like; numbers are between 0 and 1.

    Attributes:
        male: 0 female, 1 male.
        age: 0 a year, 0.19 ten years, 0.5 twenty-five, 1 ninety.
        muscle: Of the body.
        weight: Of the body.
        height: Of the body; lengths change with it, though all people are 2 m tall in the end.
        proportions: From uncommon to ideal.
        races: Shares by name, together 1.
        details: Further targets and how far they go.
    """

    male: float
    age: float
    muscle: float
    weight: float
    height: float
    proportions: float
    races: dict[str, float]
    details: dict[str, float] = field(default_factory=dict)


def draw_traits(rng: np.random.Generator, assets: Assets) -> Traits:
    """Traits at random: from children to old people, from thin to heavy, one of four a caricature."""
    first, second = rng.choice(RACES, size=2, replace=False)
    share = float(rng.uniform(0.6, 1.0))
    caricature = rng.random() < 0.25
    names = assets.details(_SHAPED)
    count = min(int(rng.integers(8, 16) if caricature else rng.integers(2, 7)), len(names))
    chosen = rng.choice(names, size=count, replace=False) if count else ()
    return Traits(
        male=float(rng.random() < 0.5),
        age=float(rng.choice((0.22, 0.36, 0.5, 0.85), p=(0.15, 0.3, 0.4, 0.15)) + rng.uniform(-0.06, 0.08)),
        muscle=float(rng.uniform(0.2, 1.0)),
        weight=float(rng.uniform(0.1, 1.0)),
        height=float(rng.uniform(0.1, 0.95)),
        proportions=float(rng.uniform(0.2, 1.0)),
        races={str(first): share, str(second): 1.0 - share},
        details={str(name): float(rng.uniform(0.2, 1.0 if caricature else 0.7)) for name in chosen},
    )


def shaped(vertices: np.ndarray, traits: Traits, assets: Assets) -> np.ndarray:
    """The base mesh's vertices (n, 3) as traits move them; targets that the assets lack are passed over."""
    moved = vertices.copy()
    for name, share in target_shares(traits):
        target = assets.target(name) if share > 1e-4 else None
        if target is not None:
            moved[target.indices] += share * target.offsets
    return moved


def target_shares(traits: Traits) -> Iterator[tuple[str, float]]:
    """Names of targets and how far each goes: the product of the shares of all traits in its name."""
    ages, muscles = _age_shares(traits.age), _steps(traits.muscle, "muscle")
    weights, sexes = _steps(traits.weight, "weight"), {"male": traits.male, "female": 1.0 - traits.male}
    heights = {
        "minheight": max(0.0, 1.0 - 2.0 * traits.height),
        "maxheight": max(0.0, 2.0 * traits.height - 1.0),
    }
    shapes = {
        "uncommonproportions": max(0.0, 1.0 - 2.0 * traits.proportions),
        "idealproportions": max(0.0, 2.0 * traits.proportions - 1.0),
    }
    for sex, of_sex in sexes.items():
        for age, of_age in ages.items():
            for race, of_race in traits.races.items():
                yield f"macrodetails/{race}-{sex}-{age}", of_sex * of_age * of_race
            for muscle, of_muscle in muscles.items():
                for weight, of_weight in weights.items():
                    name, share = f"{sex}-{age}-{muscle}-{weight}", of_sex * of_age * of_muscle * of_weight
                    yield f"macrodetails/universal-{name}", share
                    yield from (
                        (f"macrodetails/height/{name}-{one}", share * of) for one, of in heights.items()
                    )
                    yield from (
                        (f"macrodetails/proportions/{name}-{one}", share * of) for one, of in shapes.items()
                    )
    yield from traits.details.items()


def _steps(value: float, of: str) -> dict[str, float]:
    """Shares of least, average and most, of a trait."""
    return {
        f"min{of}": max(0.0, 1.0 - 2.0 * value),
        f"average{of}": 1.0 - abs(2.0 * value - 1.0),
        f"max{of}": max(0.0, 2.0 * value - 1.0),
    }


def _age_shares(age: float) -> dict[str, float]:
    ages, names = (0.0, 0.1875, 0.5, 1.0), ("baby", "child", "young", "old")
    shares = {name: float(np.interp(age, ages, np.eye(4)[index])) for index, name in enumerate(names)}
    return {name: share for name, share in shares.items() if share > 0.0}
