"""Characters measured side by side, in processes of one thread each: small operations gain less by threads."""

import pickle
from collections.abc import Callable, Sequence
from functools import lru_cache, partial

import torch

from charnerf.evaluation.character import CharacterResult
from charnerf.parallel import in_processes

Measure = Callable[[str], CharacterResult]
"""From a character's name to what was measured; sent to other processes."""


def processes_worth(number: int, device: torch.device) -> int:
    """How many of a number of characters are measured at once: a process takes seconds to start."""
    return max(1, min(torch.get_num_threads(), number // 2)) if device.type == "cpu" else 1


def measured_side_by_side(
    measure: Measure,
    names: Sequence[str],
    processes: int,
    *,
    cost: Callable[[str], float],
    on_share: Callable[[float], object],
) -> list[CharacterResult]:
    """Measure characters in several processes; the numbers are those of one.

    Args:
        measure: Measures one; pickled once, whatever it holds.
        names: Of the characters.
        processes: How many are measured at once.
        cost: Of a character by name: dear ones are begun first, so that processes end together.
        on_share: Called with the share that is done, in [0, 1], after every character.

    Raises:
        CharNeRFError: What the first character that could not be measured raised; a DataError if a process dies.
    """
    work = partial(_measure, pickle.dumps(measure), torch.get_float32_matmul_precision())
    results: dict[str, CharacterResult] = {}
    with in_processes(work, sorted(names, key=cost, reverse=True), processes) as measured:
        for name, result in measured:
            results[name] = result
            on_share(len(results) / len(names))
    return [results[name] for name in names]


def _measure(pickled: bytes, precision: str, name: str) -> CharacterResult:
    """Measure a character with products as the process that asks for it has them."""
    torch.set_float32_matmul_precision(precision)
    return _opened(pickled)(name)


@lru_cache(maxsize=1)
def _opened(pickled: bytes) -> Measure:
    """What was sent, once a process."""
    measure: Measure = pickle.loads(pickled)
    return measure
