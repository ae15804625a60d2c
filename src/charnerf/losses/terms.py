"""The loss terms as pure functions; each is a mean over rays or points.

Means are over those of this process; where it divides by a count of its own, that is the mean of the processes' counts, so
that the mean of their errors is the error of all together.
"""

import torch
from torch import Tensor

from charnerf.distributed import mean_over_processes

SOME = 1e-6  # below any mean of counts but 0, where what is divided is 0 too


def squared_color_error(rgb: Tensor, target_rgb: Tensor) -> Tensor:
    """Mean over (...) of the squared 2-norm, which sums over the channels, of (..., 3) colours.

    Source: paper, Final Loss function.
    """
    return (rgb - target_rgb).square().sum(-1).mean()


def absolute_alpha_error(alphas: Tensor, target_alphas: Tensor) -> Tensor:
    """Mean over (...) of |alpha - target|.

    Source: paper, Final Loss function.
    """
    return (alphas - target_alphas).abs().mean()


def squared_opacity_error(opacity: Tensor, target_alphas: Tensor) -> Tensor:
    """Mean over rays (...) of the squared difference of opacity and the picture's alpha (beyond the paper)."""
    return (opacity - target_alphas).square().mean()


def absolute_depth_error(depth: Tensor, target_depth: Tensor, opacity: Tensor) -> Tensor:
    """Mean over rays that meet the surface (target above 0) of opacity * |depth - target|, m; 0 if none does.

    The opacity weighs without a gradient of its own: the depth of the seen part moves by (t - depth) /
    opacity with a weight, up to 1e7 m on a ray that sees nothing yet, and the product stays within the
    length of the ray.
    """
    meets = (target_depth > 0).to(depth.dtype)
    error = opacity.detach() * (depth - target_depth).abs()
    return (error * meets).sum() / mean_over_processes(meets.sum()).clamp_min(SOME)


def balanced_occupancy_error(alphas: Tensor, inside: Tensor) -> Tensor:
    """Mean squared difference of alpha and the label (...), inside and outside weighing the same (beyond the paper)."""
    error = (alphas - inside).square()
    outside = 1.0 - inside
    counts = mean_over_processes(torch.stack((inside.sum(), outside.sum()))).clamp_min(SOME)
    return 0.5 * ((error * inside).sum() / counts[0] + (error * outside).sum() / counts[1])
