"""Fewer evaluations than there are, for a picture: evenly in time, and with the best."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from services.optimizer.evaluation_columns import EvaluationColumns


def thinned(columns: EvaluationColumns, most: int) -> NDArray[np.intp]:
    """At most so many rows, ascending: whole iterations, from the first to the last, evenly.

    The row of least fitness is always among them. Where one iteration is too much, its rows are
    thinned as well. most: at least 1.
    """
    rows = len(columns)
    if rows <= most:
        return np.arange(rows)
    best = np.argmin(columns.fitness)
    starts = np.flatnonzero(np.diff(columns.iteration, prepend=-1))
    particles = rows // len(starts)
    iterations = (most - 1) // particles
    if iterations < 1:
        chosen = np.linspace(0, rows - 1, most - 1).round().astype(np.intp)
    else:
        kept = np.linspace(0, len(starts) - 1, iterations).round().astype(np.intp)
        chosen = (starts[kept][:, np.newaxis] + np.arange(particles)).reshape(-1)
    return np.unique(np.append(chosen, best))
