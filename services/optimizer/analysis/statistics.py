"""Ranks and their correlation"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

CONFIDENCE: Final = 0.95
"""Level of intervals."""


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
