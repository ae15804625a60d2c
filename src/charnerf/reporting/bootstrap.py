"""Paired bootstrap over characters between rows, and Holm's correction over the pairs.

The characters are a sample of all characters that might be drawn: resampling them, pairs kept together, tells how far a mean
difference would move with other ones. Seeds are averaged before, so training noise is not in the intervals.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

RESAMPLES = 10_000
LEVEL = 0.95


@dataclass(frozen=True)
class Difference:
    """Mean of paired differences over characters.

    Attributes:
        first: Row that is better where the mean is positive.
        second: Row that it is compared with.
        mean: Mean of first minus second.
        low: Lower end of the interval, of this pair alone.
        high: Upper end.
        p_value: Two-sided, corrected over the pairs where it comes from `compare_rows`.
        num_characters: Pairs that were compared.
    """

    first: str
    second: str
    mean: float
    low: float
    high: float
    p_value: float
    num_characters: int

    @property
    def holds(self) -> bool:
        """Whether the difference is not explained by the choice of characters, at LEVEL over all pairs together."""
        return self.p_value < 1.0 - LEVEL


def bootstrap_means(values: ArrayLike, *, resamples: int = RESAMPLES, seed: int = 0) -> np.ndarray:
    """Means of resamples with replacement.

    Args:
        values: (n,), or (n, k) for k columns that are resampled together.
        resamples: How many.
        seed: The same seed, the same resamples.

    Returns:
        (resamples,) or (resamples, k).
    """
    sample = np.asarray(values, dtype=np.float64)
    count = len(sample)
    # how often each one is drawn is multinomial: counts times values instead of gathered copies
    drawn = np.random.default_rng(seed).multinomial(count, np.full(count, 1.0 / count), size=resamples)
    return drawn @ sample / count


def paired_bootstrap(
    differences: ArrayLike,
    *,
    names: tuple[str, str] = ("first", "second"),
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Difference:
    """Percentile interval and two-sided p-value of the mean of paired differences (n,).

    The p-value inverts the interval: the smallest level at which it excludes 0. It is at least 2^(1 - n), the chance that n
    symmetric differences have one sign: resampling can not make n characters say more than that.

    Raises:
        ValueError: If there is no difference.
    """
    values = np.asarray(differences, dtype=np.float64)
    if values.ndim != 1 or len(values) == 0:
        raise ValueError(f"differences: found shape {values.shape}, expected (n,) with n of at least 1.")
    means = bootstrap_means(values, resamples=resamples, seed=seed)
    tail = 0.5 * (1.0 - LEVEL)
    low, high = np.quantile(means, (tail, 1.0 - tail))
    slack = 1e-12 * np.abs(values).max()  # sums of the same numbers in another order
    beyond = min(np.count_nonzero(means <= slack), np.count_nonzero(means >= -slack))
    p_value = max(2.0 * (1 + beyond) / (resamples + 1), 2.0 ** (1 - len(values)))
    return Difference(*names, float(values.mean()), float(low), float(high), min(1.0, p_value), len(values))


def holm(p_values: Sequence[float]) -> list[float]:
    """P-values corrected for their number: the chance of any false difference among all of them stays below the level.

    Source: Holm, A simple sequentially rejective multiple test procedure, 1979.
    """
    count = len(p_values)
    corrected = [0.0] * count
    largest = 0.0
    for rank, index in enumerate(sorted(range(count), key=lambda one: p_values[one])):
        largest = max(largest, min(1.0, (count - rank) * p_values[index]))
        corrected[index] = largest
    return corrected


def compare_rows(
    scores: Mapping[str, Mapping[str, float]],
    *,
    pairs: Sequence[tuple[str, str]] | None = None,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> list[Difference]:
    """Pairs of rows, p-values corrected over them.

    Args:
        scores: By row, then by character; pairs are over the characters that both rows have.
        pairs: Rows to compare; None compares all of them.
        resamples: Of each pair.
        seed: Of the resamples, the same in every pair.

    Returns:
        Differences of pairs that share a character, the better row first.
    """
    differences = []
    for first, second in combinations(scores, 2) if pairs is None else pairs:
        shared = [name for name in scores[first] if name in scores[second]]
        if not shared:
            continue
        values = np.array([scores[first][name] - scores[second][name] for name in shared])
        better, other = (first, second) if values.mean() >= 0.0 else (second, first)
        sign = 1.0 if better == first else -1.0
        differences.append(
            paired_bootstrap(sign * values, names=(better, other), resamples=resamples, seed=seed)
        )
    corrected = holm([one.p_value for one in differences])
    return [replace(one, p_value=p_value) for one, p_value in zip(differences, corrected, strict=True)]
