"""Small painted textures (sRGB), measured in metres on the shape that wears them."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Color = NDArray[np.float64]  # sRGB in [0, 1], (3,)

TEXELS_PER_M = 110.0
FINENESS = 2  # painted this many times finer, then averaged: soft edges


class Canvas:
    """A texture in the making: u to the right around the shape, v upwards, both in [0, 1].

    Args:
        width_m: Length that u spans (a circumference), m.
        height_m: Length that v spans, m.
        color: Base colour.
        density: Texels per metre.
    """

    def __init__(
        self, width_m: float, height_m: float, color: Color, *, density: float = TEXELS_PER_M
    ) -> None:
        self.width_m, self.height_m = max(width_m, 1e-3), max(height_m, 1e-3)
        columns = int(np.clip(round(self.width_m * density), 8, 192)) * FINENESS
        rows = int(np.clip(round(self.height_m * density), 8, 160)) * FINENESS
        self.rgb = np.broadcast_to(np.asarray(color, dtype=np.float64), (rows, columns, 3)).copy()
        u, v = (np.arange(columns) + 0.5) / columns, 1.0 - (np.arange(rows) + 0.5) / rows
        self.u, self.v = np.meshgrid(u, v)

    def paint(self, mask: NDArray[np.bool_], color: ArrayLike, opacity: float = 1.0) -> None:
        """Lay a colour over the texels of a mask (rows, columns)."""
        self.rgb[mask] = (1.0 - opacity) * self.rgb[mask] + opacity * np.asarray(color)

    def local(self, u: float, v: float) -> tuple[Array, Array]:
        """Offsets in metres (right, up) of every texel from a point; the shorter way around."""
        right = (self.u - u + 0.5) % 1.0 - 0.5
        return right * self.width_m, (self.v - v) * self.height_m

    def band(self, low: float, high: float, color: Color) -> None:
        """A ring around the shape between two v."""
        self.paint((self.v >= low) & (self.v < high), color)

    def strip(
        self, u: float, half_width: float, color: Color, *, low: float = 0.0, high: float = 1.0
    ) -> None:
        """An upright strip about u; half width in u."""
        self.paint(
            (np.abs((self.u - u + 0.5) % 1.0 - 0.5) < half_width) & (self.v >= low) & (self.v < high), color
        )

    def ellipse(self, u: float, v: float, right: float, up: float, color: ArrayLike) -> None:
        """An ellipse with half sizes in metres."""
        x, y = self.local(u, v)
        self.paint((x / right) ** 2 + (y / up) ** 2 < 1.0, color)

    def rectangle(
        self, u: float, v: float, right: float, up: float, color: Color, *, tilt: float = 0.0
    ) -> None:
        """A rectangle with half sizes in metres; its outer end rises by tilt metres per metre."""
        x, y = self.local(u, v)
        self.paint((np.abs(x) < right) & (np.abs(y - tilt * x) < up), color)

    def shade(self, top: float, bottom: float) -> None:
        """Multiply by a vertical ramp: soft light from above, as painted into many game textures."""
        self.rgb *= (bottom + (top - bottom) * self.v)[..., None]

    def grain(self, rng: np.random.Generator, strength: float, cell_m: float) -> None:
        """Blotches of brightness with a given cell size: cloth, fur, rust."""
        rows = max(2, round(self.height_m / cell_m))
        columns = max(2, round(self.width_m / cell_m))
        noise = rng.uniform(-1.0, 1.0, (rows, columns))
        row = np.minimum(((1.0 - self.v) * rows).astype(int), rows - 1)
        column = np.minimum((self.u * columns).astype(int), columns - 1)
        self.rgb *= (1.0 + strength * noise[row, column])[..., None]

    def image(self) -> NDArray[np.uint8]:
        """The texture, (rows, columns, 3) sRGB."""
        rows, columns = self.rgb.shape[0] // FINENESS, self.rgb.shape[1] // FINENESS
        mean = self.rgb.reshape(rows, FINENESS, columns, FINENESS, 3).mean(axis=(1, 3))
        return (np.clip(mean, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)


def mix(first: ArrayLike, second: ArrayLike, share: float) -> Color:
    """Between two colours."""
    return (1.0 - share) * np.asarray(first, dtype=np.float64) + share * np.asarray(second, dtype=np.float64)


def darker(color: ArrayLike, factor: float = 0.7) -> Color:
    """A colour times a factor, kept in [0, 1]."""
    return np.clip(np.asarray(color, dtype=np.float64) * factor, 0.0, 1.0)


def _stripes(canvas: Canvas, rng: np.random.Generator, color: Color) -> None:
    width = rng.uniform(0.03, 0.09)
    phase = rng.uniform()
    share = rng.uniform(0.25, 0.55)
    canvas.paint((canvas.v * canvas.height_m / width + phase) % 1.0 < share, color)


def _pinstripes(canvas: Canvas, rng: np.random.Generator, color: Color) -> None:
    count = rng.integers(6, 18)
    canvas.paint((canvas.u * count) % 1.0 < rng.uniform(0.2, 0.5), color)


def _diagonal(canvas: Canvas, rng: np.random.Generator, color: Color) -> None:
    count, slope = rng.integers(3, 8), rng.choice((-1.0, 1.0)) * rng.uniform(2.0, 6.0)
    canvas.paint((canvas.u * count + canvas.v * slope) % 1.0 < rng.uniform(0.3, 0.5), color)


def _checks(canvas: Canvas, rng: np.random.Generator, color: Color) -> None:
    cell = rng.uniform(0.04, 0.09)
    columns = max(2, 2 * round(canvas.width_m / cell / 2.0))
    rows = np.floor(canvas.v * canvas.height_m / cell)
    canvas.paint((np.floor(canvas.u * columns) + rows) % 2 < 1, color)


def _plaid(canvas: Canvas, rng: np.random.Generator, color: Color) -> None:
    cell = rng.uniform(0.06, 0.12)
    columns = max(2, round(canvas.width_m / cell))
    canvas.paint((canvas.u * columns) % 1.0 < 0.4, color, 0.5)
    canvas.paint((canvas.v * canvas.height_m / cell) % 1.0 < 0.4, color, 0.5)


def _dots(canvas: Canvas, rng: np.random.Generator, color: Color) -> None:
    cell = rng.uniform(0.06, 0.12)
    columns = max(2, round(canvas.width_m / cell))
    row = canvas.v * canvas.height_m / cell
    x = (canvas.u * columns + 0.5 * (np.floor(row) % 2)) % 1.0 - 0.5
    canvas.paint(x**2 + (row % 1.0 - 0.5) ** 2 < rng.uniform(0.06, 0.12), color)


def _blotches(canvas: Canvas, rng: np.random.Generator, color: Color) -> None:
    for _ in range(int(rng.integers(6, 16))):
        right, up = rng.uniform(0.03, 0.09, 2)
        canvas.ellipse(rng.uniform(), rng.uniform(), right, up, color)


def _zigzag(canvas: Canvas, rng: np.random.Generator, color: Color) -> None:
    count, centre, height = rng.integers(4, 9), rng.uniform(0.3, 0.7), rng.uniform(0.03, 0.07)
    wave = np.abs((canvas.u * count) % 1.0 - 0.5) * 2.0 * height
    offset = (canvas.v - centre) * canvas.height_m - wave
    canvas.paint(np.abs(offset) < rng.uniform(0.01, 0.03), color)


def _halves(canvas: Canvas, rng: np.random.Generator, color: Color) -> None:
    canvas.paint(canvas.u < 0.5 if rng.uniform() < 0.5 else canvas.u >= 0.5, color)


def _fade(canvas: Canvas, rng: np.random.Generator, color: Color) -> None:
    share = np.clip(canvas.v if rng.uniform() < 0.5 else 1.0 - canvas.v, 0.0, 1.0)[..., None]
    canvas.rgb = (1.0 - 0.8 * share) * canvas.rgb + 0.8 * share * np.asarray(color)


def _panels(canvas: Canvas, rng: np.random.Generator, color: Color) -> None:
    columns, rows = rng.integers(3, 8), rng.integers(2, 5)
    line_u, line_v = 0.008 / canvas.width_m * columns, 0.008 / canvas.height_m * rows
    near = ((canvas.u * columns) % 1.0 < line_u) | ((canvas.v * rows) % 1.0 < line_v)
    canvas.paint(near, color)


PATTERNS = (
    _stripes,
    _pinstripes,
    _diagonal,
    _checks,
    _plaid,
    _dots,
    _blotches,
    _zigzag,
    _halves,
    _fade,
    _panels,
)


def add_pattern(canvas: Canvas, rng: np.random.Generator, color: Color) -> None:
    """Lay a random pattern over the whole canvas."""
    PATTERNS[int(rng.integers(len(PATTERNS)))](canvas, rng, color)


def emblem_mask(x: Array, y: Array, kind: int) -> NDArray[np.bool_]:
    """An emblem's inside; x and y are offsets in units of its half size."""
    angle, radius = np.arctan2(x, y), np.hypot(x, y)
    shapes = (
        radius < 1.0,
        (radius < 1.0) & (radius > 0.6),
        np.abs(x) + np.abs(y) < 1.0,
        ((np.abs(x) < 0.3) & (np.abs(y) < 1.0)) | ((np.abs(y - 0.2) < 0.3) & (np.abs(x) < 0.8)),
        radius < 0.55 + 0.45 * np.cos(5.0 * angle),
        (x**2 + (y - 0.5 * np.sqrt(np.abs(x))) ** 2) < 0.6,
        (np.abs(y - 0.6 * np.abs(x)) < 0.25) & (np.abs(x) < 1.0),
        (np.abs(x) < 1.0) & (y < 0.7) & (y > -0.8 + 0.9 * np.abs(x)),
        (np.abs(x - 0.35 * np.sign(y)) < 0.4) & (np.abs(y) < 1.0) & (np.abs(x) < 0.75),
        ((radius < 1.0) & (radius > 0.75)) | ((radius < 0.6) & (x * y > 0.0)),
        (np.abs(x) < 0.9) & (np.abs(y) < 0.9) & ((np.floor(x * 2.2) + np.floor(y * 2.2)) % 2 < 1),
        (radius < 0.9) & (np.hypot(x - 0.45, y - 0.2) > 0.75),
    )
    return shapes[kind % len(shapes)]


NUM_EMBLEMS = 12


def add_emblem(canvas: Canvas, at: tuple[float, float], half_m: float, kind: int, color: Color) -> None:
    """Paint an emblem about a point (u, v)."""
    x, y = canvas.local(*at)
    canvas.paint(emblem_mask(x / half_m, y / half_m, kind), color)
