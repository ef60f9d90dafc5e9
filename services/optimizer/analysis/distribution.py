"""How the swarm is spread, iteration by iteration, and which of its designs a picture shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from services.optimizer.jobs.columns import EvaluationColumns
from services.optimizer.jobs.design_space import DesignSpace

Floats = NDArray[np.float64]

QUANTILES: Final = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Distribution:
    """The swarm in each of I iterations.

    Attributes:
        index: (I,) of the iteration, from 0.
        fitness: (I, 7) `QUANTILES` of the swarm's finite fitness, NaN if there is none.
        mean: (I,) of the same values.
        failed: (I,) number of the other designs.
        diversity: (I,) standard deviation of the swarm's designs as a share of each searched
            variable's range, mean over these variables [1]; 0 for a swarm that has come together.
    """

    index: NDArray[np.int64]
    fitness: Floats
    mean: Floats
    failed: NDArray[np.int64]
    diversity: Floats


def distribution(columns: EvaluationColumns, space: DesignSpace, particles: int) -> Distribution:
    """Say how the swarm is spread, iteration by iteration.

    Args:
        columns: whole iterations, in order.
        space: of their job.
        particles: rows of every iteration.

    Returns:
        The distribution, in the order of the rows.
    """
    fitness = columns.fitness.reshape(-1, particles)
    finite = np.isfinite(fitness)
    count = finite.sum(axis=1)
    # A mean of huge values may overflow; such a mean is as good as none.
    with np.errstate(over="ignore", invalid="ignore"):
        mean = np.where(finite, fitness, 0.0).sum(axis=1) / count
    return Distribution(
        index=columns.iteration[::particles],
        fitness=finite_quantiles(fitness, QUANTILES),
        mean=mean,
        failed=particles - count,
        diversity=_diversity(columns, space, particles),
    )


def finite_quantiles(values: Floats, quantiles: tuple[float, ...]) -> Floats:
    """Quantiles of each row's finite values, linear between neighbours.

    Args:
        values: (I, n), +inf for a value that is none.
        quantiles: q shares from 0 to 1, ascending.

    Returns:
        (I, q), NaN for a row without a finite value.
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


def _diversity(columns: EvaluationColumns, space: DesignSpace, particles: int) -> Floats:
    searched = len(space.variables)
    share = space.box.to_unit(columns.designs[:, :searched])
    spread: Floats = share.reshape(-1, particles, searched).std(axis=1).mean(axis=1)
    return spread


def thinned(columns: EvaluationColumns, most: int) -> NDArray[np.intp]:
    """Choose whole iterations evenly, from the first to the last, for a picture of all.

    The row of least fitness is always among them. Where one iteration is too much, its rows are
    thinned as well.

    Args:
        columns: whole iterations, in order.
        most: rows to choose, at least 1.

    Returns:
        (n,) indices of rows, ascending, n <= `most`.
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
