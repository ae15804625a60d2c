"""Networks with seeded weights that were never trained: of a trained one's build, of another width, of any config."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import torch

from charnerf.config.composition import compose_config
from charnerf.inference.build import build_model
from charnerf.inference.model import Model
from charnerf.models.charnerf import CharNeRF

STARTS_AT_ZERO = ("second.weight", "score.weight")  # as the layers themselves start


def untrained_like(network: CharNeRF, seed: int = 0) -> CharNeRF:
    """A network of the same build with seeded weights that were never trained."""
    fresh = copy.deepcopy(network)
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for name, parameter in fresh.named_parameters():
            if parameter.ndim < 2 or name.endswith(STARTS_AT_ZERO):
                parameter.fill_(1.0 if "norm" in name and name.endswith("weight") else 0.0)
            else:
                scale = (2.0 / parameter[0].numel()) ** 0.5
                parameter.copy_(scale * torch.randn(parameter.shape, generator=generator).to(parameter))
    return fresh


def network_of(overrides: Sequence[str]) -> tuple[CharNeRF, Any]:
    """A network of a composed config with seeded weights, and the config."""
    cfg = compose_config(list(overrides))
    return untrained_like(build_model(cfg)).requires_grad_(False).eval(), cfg


def resized_network(model: Model, width: int, seed: int = 0) -> CharNeRF:
    """A network as the model's with another width and seeded weights, on the same device."""
    config = copy.deepcopy(model.config)
    config.model.width = width
    network = untrained_like(build_model(config), seed)
    return network.requires_grad_(False).eval().to(model.device)


def parameters_of(network: CharNeRF) -> int:
    """Number of weights."""
    return sum(parameter.numel() for parameter in network.parameters())
