"""What the processes of one training tell one another; a lone process hears itself.

All processes call these as often, in the same order.
"""

from typing import TypeVar

import torch
from torch import Tensor, distributed

Item = TypeVar("Item")


def mean_over_processes(values: Tensor) -> Tensor:
    """Mean of each value over the processes, without a gradient.

    Args:
        values: (...), such as how many rays meet the surface.
    """
    if not _are_several():
        return values.detach()
    with torch.no_grad():
        mean = values.detach().clone()
        distributed.all_reduce(mean)
        return mean / distributed.get_world_size()


def gathered(item: Item) -> list[Item]:
    """What each process gives, in their order."""
    if not _are_several():
        return [item]
    items: list[Item] = [item] * distributed.get_world_size()
    distributed.all_gather_object(items, item)
    return items


def _are_several() -> bool:
    return distributed.is_available() and distributed.is_initialized()
