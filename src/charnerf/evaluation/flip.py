"""FLIP: how different two pictures look that are shown in turns, pixel by pixel; a pure function.

Letters: N pictures, H, W pixels, K filters; planes of colour come first. Filters are products with a matrix of each axis, and
pictures go on at their edges as they end there.

Source: Andersson 2020 (FLIP: A Difference Evaluator for Alternating Images), whose numbers these are.
"""

import math
from functools import lru_cache

import torch
from torch import Tensor

PIXELS_PER_DEGREE = 0.7 * 3840 / 0.7 * math.pi / 180.0
"""Of a display 0.7 m wide that is seen from 0.7 m."""
RADIUS = 10
"""Pixels around one that its error sees: three deviations of the widest filter."""

_XYZ_FROM_RGB = torch.tensor(
    (
        (10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794),
        (2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897),
        (1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382),
    ),
    dtype=torch.float64,
)
_OF_WHITE = (_XYZ_FROM_RGB / _XYZ_FROM_RGB.sum(1, keepdim=True)).float()
"""From linear RGB to XYZ, of which white has one each."""
_FROM_SHARES = torch.linalg.inv(_OF_WHITE.double()).float()
_SENSITIVITIES = ((1.0, 0.0047), (1.0, 0.0053), (34.1, 0.04), (13.5, 0.025))
"""Weights, and squared widths in degrees, of what the eye resolves: light, red against green, blue against yellow in two parts."""
_FEATURE_WIDTH = 0.082
"""Degrees."""
_COLOR_EXPONENT, _FEATURE_EXPONENT = 0.7, 0.5
_BENT_AT, _BENT_TO = 0.4, 0.95
"""Share of the largest difference of colours up to which errors rise steeply, and the error there."""


def flip_errors(prediction: Tensor, truth: Tensor) -> Tensor:
    """Errors (H, W), 0 to 1, of two pictures (H, W, 3), sRGB-encoded in [0, 1]."""
    pictures = torch.stack((prediction, truth)).float().clamp(0.0, 1.0).movedim(-1, 1)  # (2, 3, H, W)
    shares = _shares(_linear(pictures))
    by_color = _color_errors(*_as_seen(shares))
    by_feature = _feature_errors(*shares[:, 1])
    return by_color ** (1.0 - by_feature)


def _linear(rgb: Tensor) -> Tensor:
    """Linear RGB of sRGB-encoded values."""
    return torch.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def _shares(rgb: Tensor) -> Tensor:
    """XYZ (..., 3, H, W) of linear RGB, in shares of white's."""
    return torch.einsum("ij,...jhw->...ihw", _OF_WHITE.to(rgb), rgb)


def _as_seen(shares: Tensor) -> Tensor:
    """XYZ (N, 3, H, W) as it is seen from afar, in L, a, b: blurred in opponent colours, and colours fade with light."""
    x, y, z = shares.unbind(1)
    planes = torch.stack((y, x - y, y - z, y - z), dim=1)
    down, across = (_matrices(size)[:4] for size in planes.shape[-2:])
    light, red, *blue = (down @ planes @ across.mT).unbind(1)
    blurred = torch.stack((light + red, light, light - blue[0] - blue[1]), dim=1)
    rgb = torch.einsum("ij,njhw->nihw", _FROM_SHARES.to(shares), blurred).clamp(0.0, 1.0)
    return _lab(_shares(rgb))


def _lab(shares: Tensor) -> Tensor:
    """CIE L, a, b of XYZ in shares of white's (..., 3, H, W), a and b times a hundredth of L (Hunt)."""
    edge = 6.0 / 29.0
    bent = torch.where(
        shares > edge**3, shares.clamp_min(edge**3) ** (1.0 / 3.0), shares / (3.0 * edge**2) + 4.0 / 29.0
    )
    x, y, z = bent.unbind(-3)
    light = 116.0 * y - 16.0
    return torch.stack((light, 5.0 * light * (x - y), 2.0 * light * (y - z)), dim=-3)


def _distances(lab: Tensor, other: Tensor) -> Tensor:
    """Differences (H, W) of colours (3, H, W) that are far apart, compressed (HyAB)."""
    off = lab - other
    distances: Tensor = (off[0].abs() + (off[1].square() + off[2].square()).sqrt()) ** _COLOR_EXPONENT
    return distances


def _color_errors(prediction: Tensor, truth: Tensor) -> Tensor:
    """Errors (H, W), 0 to 1, by colours (3, H, W) as they are seen."""
    green, blue = (_lab(_shares(torch.eye(3)[one].view(3, 1, 1))) for one in (1, 2))
    most = float(_distances(green, blue))
    errors, bend = _distances(prediction, truth), _BENT_AT * most
    rest = _BENT_TO + (errors - bend) / (most - bend) * (1.0 - _BENT_TO)
    return torch.where(errors < bend, _BENT_TO / bend * errors, rest)


def _feature_errors(prediction: Tensor, truth: Tensor) -> Tensor:
    """Errors (H, W), 0 to 1, by edges and points of light (H, W)."""
    light = torch.stack((prediction, truth))
    down, across = (_matrices(size)[4:, None] for size in light.shape[-2:])
    smooth, edge, point = (light @ across.mT).unbind(0)
    found = []
    for filtered, slope in ((edge, down[1]), (point, down[2])):
        found.append(((down[0] @ filtered).square() + (slope @ smooth).square()).sqrt())
    off = torch.stack([(one[0] - one[1]).abs() for one in found]).amax(0)
    errors: Tensor = (off / math.sqrt(2.0)) ** _FEATURE_EXPONENT
    return errors


@lru_cache(maxsize=256)
def _matrices(size: int) -> Tensor:
    """Filters along an axis of so many pixels as matrices (7, size, size): four that blur, then smooth, edge and point."""
    windows = torch.cat((_blurs(), _features())).float()
    places = (torch.arange(size)[:, None] + torch.arange(-RADIUS, RADIUS + 1)).clamp(0, size - 1)
    shape = (len(windows), *places.shape)
    matrices = torch.zeros(len(windows), size, size)
    return matrices.scatter_add(2, places.expand(shape), windows[:, None].expand(shape))


def _offsets() -> Tensor:
    return torch.arange(-RADIUS, RADIUS + 1, dtype=torch.float64)


def _blurs() -> Tensor:
    """Windows (4, 21) of what the eye resolves; the last two add up to one that keeps the mean."""
    degrees = _offsets() / PIXELS_PER_DEGREE
    weights, windows = [], []
    for weight, width in _SENSITIVITIES:
        window = torch.exp(-(math.pi**2) * degrees**2 / width)
        weights.append(weight * math.sqrt(math.pi / width) * window.sum() ** 2)
        windows.append(window / window.sum())
    both = weights[2] + weights[3]
    shares = (1.0, 1.0, weights[2] / both, weights[3] / both)
    return torch.stack([window * share**0.5 for window, share in zip(windows, shares, strict=True)])


def _features() -> Tensor:
    """Windows (3, 21): smooth, of sum 1; edge and point, whose parts above and below zero have the sums 1 and -1."""
    deviation = 0.5 * _FEATURE_WIDTH * PIXELS_PER_DEGREE
    offsets = _offsets()
    smooth = torch.exp(-(offsets**2) / (2.0 * deviation**2)).where(
        offsets.abs() <= math.ceil(3.0 * deviation), 0.0
    )
    edge, point = -offsets * smooth, (offsets**2 / deviation**2 - 1.0) * smooth

    def balanced(window: Tensor) -> Tensor:
        above, below = window.clamp_min(0.0), window.clamp_max(0.0)
        return above / above.sum() - below / below.sum()

    return torch.stack((smooth / smooth.sum(), balanced(edge), balanced(point)))
