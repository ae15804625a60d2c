"""Volume rendering as pure functions: from densities along a ray to what is seen.

Optical depth tau_i = density_i * delta_i. Transmittance is the exponential of a negative sum, never a
product of (1 - alpha), and alpha of a thin interval is -expm1(-tau), never 1 - exp(-tau): so thin media keep
all their digits, opaque ones a finite gradient, and the weights and the final transmittance sum to 1 to
rounding for any tau in [0, inf). Half precisions are computed and returned in float32.
"""

import torch
from torch import Tensor

from charnerf.checks import check_same_shape
from charnerf.geometry.safe import full_precision

_UNSEEN_OPACITY = 1e-7  # rounding of 1 - opacity in float32: less than that of a ray's light is not seen


def alphas_from_densities(densities: Tensor, deltas: Tensor) -> Tensor:
    """Share of light that each interval absorbs: 1 - exp(-density * delta).

    Args:
        densities: (..., S), 1/m, non-negative.
        deltas: Interval lengths, (..., S), m, non-negative and finite; the product may overflow to infinity.

    Returns:
        (..., S), in [0, 1], with full relative accuracy for any product.

    Raises:
        ShapeError: If the two shapes differ.

    Source: paper Eq. color-composite, which drops the "1 -".

    >>> alphas_from_densities(torch.tensor([1e-20, 1.0, 1e30]), torch.ones(3))
    tensor([1.0000e-20, 6.3212e-01, 1.0000e+00])
    """
    check_same_shape("densities", densities, "deltas", deltas)
    return absorbed_share(full_precision(densities) * full_precision(deltas))


def absorbed_share(optical_depths: Tensor) -> Tensor:
    """1 - exp(-tau) of optical depths tau (...), with all digits in value and gradient.

    expm1 alone would do for the value; its derivative is computed as result + 1, which is 0 in float32 from
    tau = 17 on, where the true one, exp(-tau), is a number up to tau = 87.
    """
    thin = -torch.expm1(-optical_depths.clamp_max(0.5))
    return torch.where(optical_depths < 0.5, thin, 1.0 - torch.exp(-optical_depths))


def optical_depths_before(optical_depths: Tensor) -> tuple[Tensor, Tensor]:
    """Exclusive running sum of optical depths (..., S) along the last axis, and the total (...)."""
    running = optical_depths.cumsum(dim=-1)
    before = torch.cat((torch.zeros_like(running[..., :1]), running[..., :-1]), dim=-1)
    return before, running[..., -1]


def transmittance_from_densities(densities: Tensor, deltas: Tensor) -> Tensor:
    """Light that reaches each sample before being absorbed.

    Computed in log space: the gradient stays finite where a sample is opaque.

    Args:
        densities: (..., S), 1/m, non-negative.
        deltas: Interval lengths, (..., S), m, non-negative and finite.

    Returns:
        Transmittance before each sample, (..., S), in [0, 1]; the first is 1.

    Raises:
        ShapeError: If the two shapes differ.

    Source: paper Eq. color-composite; product index corrected to j < i (NeRF, Mildenhall 2020, eq. 3).
    """
    check_same_shape("densities", densities, "deltas", deltas)
    before, _ = optical_depths_before(full_precision(densities) * full_precision(deltas))
    return torch.exp(-before)


def weights_from_optical_depths(optical_depths: Tensor) -> tuple[Tensor, Tensor]:
    """Weights (..., S) and final transmittance (...) of intervals of given optical depths (..., S), >= 0."""
    optical_depths = full_precision(optical_depths)
    before, total = optical_depths_before(optical_depths)
    return torch.exp(-before) * absorbed_share(optical_depths), torch.exp(-total)


def weights_from_densities(densities: Tensor, deltas: Tensor) -> tuple[Tensor, Tensor]:
    """Share of light that each interval absorbs of what reaches it, and what passes all of them.

    Args:
        densities: (..., S), 1/m, non-negative, constant within each interval.
        deltas: Interval lengths, (..., S), m, non-negative and finite; the product may overflow to infinity.

    Returns:
        Weights (..., S) and final transmittance (...); they sum to 1 to rounding.

    Raises:
        ShapeError: If the two shapes differ.

    Source: paper Eq. color-composite, with both misprints corrected.
    """
    check_same_shape("densities", densities, "deltas", deltas)
    return weights_from_optical_depths(full_precision(densities) * full_precision(deltas))


def composite(weights: Tensor, values: Tensor, background: Tensor) -> Tensor:
    """Blend values along rays over a background.

    Args:
        weights: (..., S), their sum at most 1.
        values: Colours or other values, (..., S, C).
        background: Broadcast to (..., C).

    Returns:
        Sum of weights * values + (1 - sum of weights) * background, (..., C).
    """
    weights, values = full_precision(weights), full_precision(values)
    seen = (weights[..., None] * values).sum(dim=-2)
    return seen + (1.0 - weights.sum(dim=-1))[..., None] * full_precision(background)


def expected_depth(weights: Tensor, t_vals: Tensor, far: Tensor) -> Tensor:
    """Expected distance along the ray of the part that is seen; far where nothing is seen.

    The mean of t_vals under the weights, in which the background at far takes part with a weight of 1e-7, the rounding of an
    opacity: no division by zero, and a gradient of at most 1e7 * (far - near) on rays that see nothing.

    Args:
        weights: (..., S), non-negative.
        t_vals: (..., S), m.
        far: (...) or a scalar tensor, m.

    Returns:
        (...), m.
    """
    weights, t_vals, far = full_precision(weights), full_precision(t_vals), full_precision(far)
    moment = (weights * t_vals).sum(dim=-1) + _UNSEEN_OPACITY * far
    return moment / (weights.sum(dim=-1) + _UNSEEN_OPACITY)


def depth_over_background(weights: Tensor, t_vals: Tensor, far: Tensor) -> Tensor:
    """Expected distance along the ray with the background standing at far: what a depth loss compares.

    Its gradient to a weight is at most far - near for any opacity, unlike that of `expected_depth`.

    Args:
        weights: (..., S), their sum at most 1.
        t_vals: (..., S), m.
        far: (...) or a scalar tensor, m.

    Returns:
        (...), m.
    """
    weights, t_vals, far = full_precision(weights), full_precision(t_vals), full_precision(far)
    return (weights * (t_vals - far[..., None])).sum(dim=-1) + far
