"""Ranks of values, and how far two rankings agree."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def spearman(one: Floats, other: Floats) -> float:
    """Spearman's rank correlation, ties sharing their mean rank.

    Args:
        one: (M,) values.
        other: (M,) values of the same things.

    Returns:
        -1 to 1; NaN where one of the two is constant.
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
    ordered = np.sort(values)
    first: Floats = np.searchsorted(ordered, values, "left").astype(np.float64)
    last: Floats = np.searchsorted(ordered, values, "right").astype(np.float64)
    return 0.5 * (first + last + 1.0)
