"""The few places where a division or a root needs a guard, each with its reason."""

import torch
from torch import Tensor

from charnerf.checks import check_last_dim


def safe_normalize(vectors: Tensor) -> Tensor:
    """Scale vectors to unit length; zero stays zero, with a zero gradient.

    No epsilon floors the length: the vector is first divided by its largest component, so that neither the squares of 1e18 nor
    those of 1e-30 leave float32.

    Args:
        vectors: (..., 3) or any other last size.

    Returns:
        Unit vectors of the same shape; zero where the input is zero (the surface loss passes a zero direction, paper section
        "Mix of 2d ray sampling and 3d surface sampling").
    """
    if vectors.ndim == 0:
        check_last_dim("vectors", vectors, 3)
    largest = vectors.detach().abs().amax(dim=-1, keepdim=True)
    is_zero = largest == 0
    scaled = vectors / torch.where(is_zero, torch.ones_like(largest), largest)
    length = torch.where(is_zero, torch.ones_like(scaled), scaled).square().sum(dim=-1, keepdim=True).sqrt()
    return torch.where(is_zero, torch.zeros_like(scaled), scaled / length)
