"""Spread of designs by iteration, and thinning for plots"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace

Floats = NDArray[np.float64]

QUANTILES: Final = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Distribution:
    """The designs of each of I iterations.

    Attributes:
        index: (I,) from 0.
        fitness: (I, 7) `QUANTILES` of finite fitness, NaN if there is none.
        mean: (I,) of finite fitness.
        failed: (I,) number of designs without finite fitness.
        diversity: (I,) standard deviation of the designs as a share of each searched variable's
            range, averaged over these variables [1]; 0 for a converged search, NaN for a single
            design.
    """

    index: NDArray[np.int64]
    fitness: Floats
    mean: Floats
    failed: NDArray[np.int64]
    diversity: Floats


def distribution(columns: EvaluationColumns, space: DesignSpace) -> Distribution:
    starts = iteration_starts(columns)
    sizes = np.diff(starts, append=len(columns))
    result = Distribution(
        index=columns.iteration[starts],
        fitness=np.empty((len(starts), len(QUANTILES))),
        mean=np.empty(len(starts)),
        failed=np.empty(len(starts), dtype=np.int64),
        diversity=np.empty(len(starts)),
    )
    searched = len(space.variables)
    share = space.box.to_unit(columns.designs[:, :searched])
    # By size: most methods have iterations of one or two sizes.
    for size in np.unique(sizes):
        chosen = sizes == size
        rows = starts[chosen][:, np.newaxis] + np.arange(size)
        _describe(result, chosen, columns.fitness[rows], share[rows])
    return result


def _describe(
    result: Distribution, chosen: NDArray[np.bool_], fitness: Floats, share: Floats
) -> None:
    """Fill in iterations of n designs: fitness (i, n), share of the variables' ranges (i, n, d)."""
    size = fitness.shape[1]
    finite = np.isfinite(fitness)
    count = finite.sum(axis=1)
    # A mean of huge values may overflow.
    with np.errstate(over="ignore", invalid="ignore"):
        result.mean[chosen] = np.where(finite, fitness, 0.0).sum(axis=1) / count
    result.fitness[chosen] = finite_quantiles(fitness, QUANTILES)
    result.failed[chosen] = size - count
    result.diversity[chosen] = share.std(axis=1).mean(axis=1) if size > 1 else np.nan


def iteration_starts(columns: EvaluationColumns) -> NDArray[np.intp]:
    """Return the (I,) row of the first design of each iteration."""
    return np.flatnonzero(np.diff(columns.iteration, prepend=-1))


def finite_quantiles(values: Floats, quantiles: tuple[float, ...]) -> Floats:
    """Return (I, q) quantiles of each row's finite values (I, n), linearly interpolated.

    NaN for a row without a finite value.
    """
    ordered = np.sort(values, axis=1)
    last = np.isfinite(ordered).sum(axis=1) - 1
    place = np.maximum(last, 0)[:, np.newaxis] * np.array(quantiles)
    below = np.floor(place).astype(np.intp)
    above = np.minimum(below + 1, np.maximum(last, 0)[:, np.newaxis])
    low = np.take_along_axis(ordered, below, axis=1)
    high = np.take_along_axis(ordered, above, axis=1)
    share = place - below
    with np.errstate(invalid="ignore"):
        between = np.where(share > 0.0, (1.0 - share) * low + share * high, low)
    return np.where(last[:, np.newaxis] >= 0, between, np.nan)


def thinned(columns: EvaluationColumns, most: int) -> NDArray[np.intp]:
    """Return at most `most` rows for a plot: whole iterations, evenly chosen, ascending.

    The row of least fitness is always included. If one iteration exceeds the limit, its rows are
    thinned as well.
    """
    rows = len(columns)
    if rows <= most:
        return np.arange(rows)
    best = np.argmin(columns.fitness)
    starts = iteration_starts(columns)
    sizes = np.diff(starts, append=rows)
    chosen = np.linspace(0, rows - 1, most - 1).round().astype(np.intp)
    # As many as fit at the mean size; fewer if larger ones are among them.
    iterations = (most - 1) * len(starts) // rows
    while iterations >= 1:
        selected = np.linspace(0, len(starts) - 1, iterations).round().astype(np.intp)
        taken = int(sizes[selected].sum())
        if taken < most:
            chosen = np.concatenate([np.arange(starts[k], starts[k] + sizes[k]) for k in selected])
            break
        iterations = min(iterations - 1, iterations * (most - 1) // taken)
    return np.unique(np.append(chosen, best))
