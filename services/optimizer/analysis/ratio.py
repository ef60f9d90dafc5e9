"""How much better one method is than another, from several runs of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import comb

import numpy as np

from gaitswarm.services.optimizer.analysis.interval import CONFIDENCE


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
