"""The sRGB transfer function both ways (IEC 61966-2-1), numpy."""

import numpy as np

_LINEAR_OF_BYTE = np.where(
    np.arange(256) / 255.0 <= 0.04045,
    np.arange(256) / 255.0 / 12.92,
    ((np.arange(256) / 255.0 + 0.055) / 1.055) ** 2.4,
).astype(np.float32)


def linear_from_srgb(srgb: np.ndarray) -> np.ndarray:
    """Linear light (...) of sRGB-encoded values (...) in [0, 1]; values outside are clipped."""
    srgb = np.clip(srgb, 0.0, 1.0)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def srgb_from_linear(linear: np.ndarray) -> np.ndarray:
    """sRGB-encoded values (...) of linear light (...) in [0, 1]; values outside are clipped.

    >>> round(255 * float(srgb_from_linear(np.array(0.5))))
    188
    """
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1.0 / 2.4) - 0.055)


def linear_from_bytes(srgb: np.ndarray) -> np.ndarray:
    """Linear light (...), float32, of sRGB bytes (...)."""
    return _LINEAR_OF_BYTE[srgb]
