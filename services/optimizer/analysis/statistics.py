"""Ranks, correlations and confidence intervals"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

CONFIDENCE: Final = 0.95


class Interval(NamedTuple):
    """An estimate with its interval at the level `CONFIDENCE`."""

    value: float
    low: float
    high: float


def spearman(first: Floats, second: Floats) -> float:
    """Spearman's rank correlation of two samples (M,); ties share their mean rank."""
    a, b = (average_ranks(values) for values in (first, second))
    a, b = a - a.mean(), b - b.mean()
    scale = math.sqrt(float((a * a).sum()) * float((b * b).sum()))
    return float((a * b).sum()) / scale if scale > 0.0 else math.nan


def average_ranks(values: Floats) -> Floats:
    """Ranks of (n,) values from 1, the least; ties share their mean rank."""
    _, places, sizes = np.unique(values, return_inverse=True, return_counts=True)
    means = np.cumsum(sizes) - 0.5 * (sizes - 1.0)
    return np.asarray(means[places])


def rank_correlation(first: Floats, second: Floats) -> float | None:
    """Spearman's rank correlation over rows that are finite in both; None if undefined."""
    both = np.isfinite(first) & np.isfinite(second)
    if not both.any():
        return None
    correlation = spearman(first[both], second[both])
    return None if math.isnan(correlation) else correlation


def percentile_interval(value: float, resampled: Floats) -> Interval:
    """Interval between two quantiles of (B,) resampled estimates (Efron 1979); NaN is ignored."""
    defined = resampled[~np.isnan(resampled)]
    if not len(defined):
        return Interval(value, math.nan, math.nan)
    tail = 0.5 * (1.0 - CONFIDENCE)
    # Without interpolation, as values may be infinite.
    low, high = np.quantile(defined, (tail, 1.0 - tail), method="inverted_cdf")
    return Interval(value, float(low), float(high))
