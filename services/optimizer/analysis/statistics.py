"""Ranks, medians and their intervals"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import comb
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def spearman(one: Floats, other: Floats) -> float:
    """Spearman's rank correlation, ties sharing their mean rank.

    Args:
        one: (M,) values.
        other: (M,) values of the same things.
    """
    a, b = (average_ranks(values) for values in (one, other))
    a, b = a - a.mean(), b - b.mean()
    scale = math.sqrt(float((a * a).sum()) * float((b * b).sum()))
    return float((a * b).sum()) / scale if scale > 0.0 else math.nan


def average_ranks(values: Floats) -> Floats:
    """Ranks from 1, the least; equal values share their mean rank.

    Args:
        values: (n,), +inf allowed.

    Returns:
        (n,).
    """
    _, places, sizes = np.unique(values, return_inverse=True, return_counts=True)
    means = np.cumsum(sizes) - 0.5 * (sizes - 1.0)
    return np.asarray(means[places])


CONFIDENCE: Final = 0.95
"""Of all intervals."""


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate with its interval at `CONFIDENCE`.

    Attributes:
        value: The estimate.
        low: Lower end of the interval.
        high: Upper end.
    """

    value: float
    low: float
    high: float


def percentile_interval(value: float, resampled: NDArray[np.float64]) -> Interval:
    """Interval between two quantiles of what resamples come to (Efron 1979).

    Args:
        resampled: (B,) the same of each resample, NaN for one that has none; +-inf allowed.
    """
    known = resampled[~np.isnan(resampled)]
    if not len(known):
        return Interval(value, math.nan, math.nan)
    tail = 0.5 * (1.0 - CONFIDENCE)
    # Of ordered values, so that an infinite one is not interpolated.
    low, high = np.quantile(known, (tail, 1.0 - tail), method="inverted_cdf")
    return Interval(value, float(low), float(high))


@dataclass(frozen=True, slots=True)
class MedianInterval:
    """A median with an interval that covers the true one, whatever the distribution.

    Attributes:
        median: of the values.
        low: lower end, None where there are too few runs for an interval.
        high: upper end, None with `low`.
        coverage: probability that the interval covers, of those that order statistics can have the
            least that is at least `CONFIDENCE`; None with `low`.
    """

    median: float
    low: float | None
    high: float | None
    coverage: float | None


def median_interval(values: Sequence[float]) -> MedianInterval:
    """Median of n runs, between two of their order statistics (binomial, exact)."""
    n = len(values)
    return _between(list(values), [comb(n, k) for k in range(n + 1)])


def median_ratio(numerators: Sequence[float], denominators: Sequence[float]) -> MedianInterval:
    """Median of all n m ratios of a run of one method to a run of the other.

    That is the estimate of Hodges and Lehmann for a shift of the logarithms. Its interval lies
    between two of the ordered ratios, by the exact distribution of Mann and Whitney's U; it holds
    if the methods' values differ by a factor. Runs of one seed are not paired: they share nothing.
    """
    ratios = np.divide.outer(np.array(numerators), np.array(denominators)).ravel()
    return _between(ratios.tolist(), _counts_of_u(len(numerators), len(denominators)))


def _between(values: list[float], counts: Sequence[int]) -> MedianInterval:
    """counts: of equally likely cases in which 0, 1, ... of N sorted values lie below the true one.

    There are N + 1 of them, symmetric.
    """
    ordered, total = sorted(values), sum(counts)
    median = float(np.median(ordered))
    outside, left_out = 0, 0
    while left_out < len(ordered) // 2 and 2 * (outside + counts[left_out]) <= (
        (1.0 - CONFIDENCE) * total
    ):
        outside += counts[left_out]
        left_out += 1
    if left_out == 0:
        return MedianInterval(median, None, None, None)
    coverage = 1.0 - 2.0 * outside / total
    return MedianInterval(median, ordered[left_out - 1], ordered[-left_out], coverage)


@cache
def _counts_of_u(n: int, m: int) -> tuple[int, ...]:
    """Orders of n and m values by the number of pairs, 0 to n m, whose first value is greater."""
    if n == 0 or m == 0:
        return (1,)
    counts = [0] * (n * m + 1)
    # The greatest of all is of the first kind, and exceeds all m others, or of the second.
    for u, count in enumerate(_counts_of_u(n - 1, m)):
        counts[u + m] += count
    for u, count in enumerate(_counts_of_u(n, m - 1)):
        counts[u] += count
    return tuple(counts)
