"""The formulas as they are usually written, kept only to show where they fail."""

import torch
from torch import Tensor


def alphas(densities: Tensor, deltas: Tensor) -> Tensor:
    """1 - exp(-tau): loses every digit of a thin interval."""
    return 1.0 - torch.exp(-densities * deltas)


def weights(densities: Tensor, deltas: Tensor) -> tuple[Tensor, Tensor]:
    """PixelNeRF's and NeRF's cumprod(1 - alpha + 1e-10)."""
    absorbed = alphas(densities, deltas)
    passed = torch.cumprod(
        torch.cat((torch.ones_like(absorbed[..., :1]), 1.0 - absorbed + 1e-10), dim=-1), dim=-1
    )
    return absorbed * passed[..., :-1], passed[..., -1]


def depth(light: Tensor, t_vals: Tensor) -> Tensor:
    """Mean distance divided by an opacity that may be zero."""
    return (light * t_vals).sum(-1) / light.sum(-1)


def normalize(vectors: Tensor) -> Tensor:
    """A vector over the root of its squares."""
    return vectors / vectors.square().sum(-1, keepdim=True).sqrt()


def encoding(x: Tensor, num_frequencies: int) -> Tensor:
    """Sines of 2^k pi x, rounded before the period is taken off."""
    phases = (
        x[..., None, :]
        * (2.0 ** torch.arange(num_frequencies, device=x.device, dtype=x.dtype) * torch.pi)[:, None]
    )
    return torch.cat((torch.sin(phases), torch.cos(phases)), dim=-1).flatten(-2)


def draw(t_edges: Tensor, masses: Tensor, quantiles: Tensor) -> Tensor:
    """Inverse CDF without guards."""
    cdf = torch.cumsum(masses / masses.sum(-1, keepdim=True), dim=-1)
    cdf = torch.cat((torch.zeros_like(cdf[..., :1]), cdf), dim=-1)
    upper = torch.searchsorted(cdf, quantiles.contiguous(), right=True).clamp(1, masses.shape[-1])
    low, high = cdf.gather(-1, upper - 1), cdf.gather(-1, upper)
    start, end = t_edges.gather(-1, upper - 1), t_edges.gather(-1, upper)
    return start + (quantiles - low) / (high - low) * (end - start)


def box_interval(
    origins: Tensor, directions: Tensor, box_min: Tensor, box_max: Tensor
) -> tuple[Tensor, Tensor]:
    """Slab method with a plain division by the direction."""
    first, second = (box_min - origins) / directions, (box_max - origins) / directions
    return torch.minimum(first, second).amax(-1), torch.maximum(first, second).amin(-1)


def project(points: Tensor, focal: float) -> Tensor:
    """Division by the depth, whatever it is."""
    return focal * points[..., :2] / -points[..., 2:]
