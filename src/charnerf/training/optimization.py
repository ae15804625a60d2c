"""The optimizer of a model, and its learning rate over a run."""

import math
from collections.abc import Callable, Iterable
from typing import Any

import torch

from charnerf.errors import ConfigError
from charnerf.models.charnerf import CharNeRF
from charnerf.models.combinators.base import AbstractCombinator

OptimizerOf = Callable[[Iterable[torch.nn.Parameter] | list[dict[str, Any]]], torch.optim.Optimizer]
WARM_UP = 0.01  # share of the run in which the learning rate rises


def optimizer_of(model: CharNeRF, make: OptimizerOf) -> torch.optim.Optimizer:
    """The optimizer of all parameters; a combinator with an lr_scale other than 1 is a group of its own.

    Raises:
        ConfigError: If the optimizer takes no groups and there would be two.
    """
    combinators = [one for one in model.modules() if isinstance(one, AbstractCombinator)]
    lr_scale = combinators[0].lr_scale
    own = {id(p): p for one in combinators for p in one.parameters()}
    if lr_scale == 1.0 or not own:
        return make(model.parameters())
    others = [p for p in model.parameters() if id(p) not in own]
    try:
        optimizer = make([{"params": others}, {"params": list(own.values())}])
    except (AttributeError, TypeError) as error:
        raise ConfigError(
            f"combinator.lr_scale: found {lr_scale}, but this optimizer takes no groups of parameters ({error}); expected 1,"
            " or an optimizer of torch.optim."
        ) from error
    optimizer.param_groups[1]["lr"] *= lr_scale
    return optimizer


def rate_at(progress: float, *, final: float) -> float:
    """Factor on the learning rate: rises from 1/20 to 1 in the first hundredth of the run, then a cosine to `final`."""
    rise = min(1.0, 0.05 + 0.95 * progress / WARM_UP)
    return rise * (final + (1.0 - final) * 0.5 * (1.0 + math.cos(math.pi * progress)))
