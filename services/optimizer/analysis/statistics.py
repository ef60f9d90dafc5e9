"""Ranks, their correlation, and resamples"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats

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


def resample_weights(draws: Floats) -> Floats:
    """(1 + B, n) multiplicity of each row: first 1, then in a bootstrap by draws (B, n) < 1."""
    rows = draws.shape[1]
    picks = (draws * rows).astype(np.intp)
    return np.vstack([np.ones(rows), *(np.bincount(row, minlength=rows) for row in picks)])
