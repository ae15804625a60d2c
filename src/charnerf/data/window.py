"""Which characters training draws from for a while, where not all of them are kept open."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import torch

from charnerf.data.sampler import step_seed

_ORDER = 2**31  # a stream of seeds beside those of steps


@dataclass(frozen=True)
class Window:
    """A window that moves over groups of characters, in an order drawn anew each time round.

    It depends on seed and step alone: a run that goes on, and every process of one, see the same window.

    Attributes:
        groups: Characters that come and go together: of one shard, or each by itself.
        held: Groups in the window.
        steps: Steps until the group that came first goes, and another comes.
        seed: Of the run.
    """

    groups: tuple[tuple[str, ...], ...]
    held: int
    steps: int
    seed: int

    def names(self, step: int) -> tuple[str, ...]:
        """The characters of a step."""
        if self.held >= len(self.groups):
            return tuple(name for group in self.groups for name in group)
        first = step // self.steps
        places = [self._group(turn) for turn in range(first, first + self.held)]
        return tuple(name for place in dict.fromkeys(places) for name in self.groups[place])

    def _group(self, turn: int) -> int:
        """Which group comes at a turn: all of them, in another order each round."""
        count = len(self.groups)
        return _order(self.seed, turn // count, count)[turn % count]


@lru_cache(maxsize=4)
def _order(seed: int, round_: int, count: int) -> tuple[int, ...]:
    generator = torch.Generator().manual_seed(step_seed(seed, _ORDER + round_))
    return tuple(torch.randperm(count, generator=generator).tolist())


def groups_of(names: Sequence[str], shards: Sequence[Sequence[str]] | None) -> tuple[tuple[str, ...], ...]:
    """Characters by shard, in the shards' order, or each by itself where there are no shards."""
    if shards is None:
        return tuple((name,) for name in names)
    wanted = set(names)
    grouped = (tuple(name for name in shard if name in wanted) for shard in shards)
    return tuple(group for group in grouped if group)
