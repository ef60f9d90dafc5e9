"""Medians and ratios of several runs, with distribution-free intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from math import comb
from typing import Final

import numpy as np

CONFIDENCE: Final = 0.95


@dataclass(frozen=True, slots=True)
class MedianInterval:
    """A median with an interval that covers the true one, whatever the distribution.

    Attributes:
        low: Lower end, None where there are too few runs for an interval.
        high: Upper end, None with `low`.
        coverage: Probability that the interval covers: the least that order statistics can have
            and that is at least `CONFIDENCE`; None with `low`.
    """

    median: float
    low: float | None
    high: float | None
    coverage: float | None


def cells(interval: MedianInterval | None, written: Callable[[float], str]) -> tuple[str, str]:
    """Median and interval as cells of a table; dashes without an interval."""
    if interval is None:
        return "–", "–"
    if interval.low is None or interval.high is None:
        return written(interval.median), "–"
    return written(interval.median), f"{written(interval.low)} to {written(interval.high)}"


def percent_change(ratio: float) -> str:
    """Write 1.05 as `+5.0 %`."""
    return f"{100.0 * (ratio - 1.0):+.1f} %"


def median_interval(values: Sequence[float]) -> MedianInterval:
    """Median of n runs, between two of their order statistics (binomial, exact)."""
    n = len(values)
    return _between(list(values), [comb(n, k) for k in range(n + 1)])


def median_ratio(numerators: Sequence[float], denominators: Sequence[float]) -> MedianInterval:
    """Median of all n m ratios of a run of one method to a run of the other.

    This is the estimate of Hodges and Lehmann for a shift of the logarithms. Its interval lies
    between two of the ordered ratios, by the exact distribution of Mann and Whitney's U; it holds
    if the methods' values differ by a factor. Runs of the same seed are not paired.
    """
    ratios = np.divide.outer(np.array(numerators), np.array(denominators)).ravel()
    return _between(ratios.tolist(), _counts_of_u(len(numerators), len(denominators)))


def _between(values: list[float], counts: Sequence[int]) -> MedianInterval:
    """Interval by counts of equally likely cases.

    counts: (N + 1) numbers of cases in which 0, 1, ... of the N sorted values lie below the true
    value, symmetric.
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
    """Count the orders of n and m values by the number of pairs whose first value is greater."""
    if n == 0 or m == 0:
        return (1,)
    counts = [0] * (n * m + 1)
    # The greatest of all is of the first kind, and exceeds all m others, or of the second.
    for u, count in enumerate(_counts_of_u(n - 1, m)):
        counts[u + m] += count
    for u, count in enumerate(_counts_of_u(n, m - 1)):
        counts[u] += count
    return tuple(counts)
