"""Ranks, medians and their intervals"""

from __future__ import annotations

import math
from dataclasses import dataclass
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
