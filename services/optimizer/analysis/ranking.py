"""What if another preference had judged: designs ranked anew, without a single walk."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from services.optimizer.analysis.utilities import fitness_of, log_utilities
from services.optimizer.jobs.columns import EvaluationColumns
from services.optimizer.jobs.preference import Preference

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class RankedDesign:
    """One of the best. row: of the columns that were ranked.

    rank counts from 1, the earliest of equals first; rank_before: by the job's own preference, None
    for a design that it did not rank. fitness: by the new preference.
    """

    row: int
    rank: int
    rank_before: int | None
    fitness: float


@dataclass(frozen=True, slots=True, eq=False)
class Ranking:
    """All evaluations under one preference; fitness is minimized.

    present_best: fitness of the design that the job itself holds to be the best, None without one.
    best_so_far: (iterations,), +inf until a design has walked in every scenario.
    correlation: Spearman's, of the fitness before and now over the designs that have both; None
        where it is undefined.
    """

    top: tuple[RankedDesign, ...]
    present_best: float | None
    best_so_far: Floats
    correlation: float | None


def rank(columns: EvaluationColumns, preference: Preference, *, top: int) -> Ranking:
    """Judge all rows by a preference. top: how many designs to name."""
    fitness = fitness_of(log_utilities(columns, preference))
    now, before = _Order.of(fitness), _Order.of(columns.fitness)
    return Ranking(
        top=_top(now, before, top),
        present_best=float(fitness[before.best[0]]) if len(before.best) else None,
        best_so_far=best_so_far(columns.iteration, fitness),
        correlation=_correlation(now, before),
    )


def best_so_far(iteration: NDArray[np.int64], fitness: Floats) -> Floats:
    """(r,) iterations in order and fitness -> (iterations,): least fitness until each."""
    if not len(iteration):
        return np.empty(0)
    starts = np.flatnonzero(np.diff(iteration, prepend=-1))
    return np.minimum.accumulate(np.minimum.reduceat(fitness, starts))


@dataclass(frozen=True, slots=True, eq=False)
class _Order:
    """Values (r,) and the rows of the finite ones, `best` first, the earliest of equals first."""

    values: Floats
    best: NDArray[np.intp]

    @classmethod
    def of(cls, values: Floats) -> _Order:
        ordered = np.argsort(values, kind="stable")
        return cls(values, ordered[: int(np.isfinite(values).sum())])

    def ranks(self) -> NDArray[np.int64]:
        """(r,) from 1; 0 for a row without a rank."""
        ranks = np.zeros(len(self.values), dtype=np.int64)
        ranks[self.best] = np.arange(1, len(self.best) + 1)
        return ranks

    def shared_ranks(self, among: NDArray[np.bool_]) -> Floats:
        """(r,) from 1 among some of the finite rows; equals share the mean of theirs."""
        rows = self.best[among[self.best]]
        values = self.values[rows]
        starts = np.flatnonzero(np.diff(values, prepend=-np.inf))
        counts = np.diff(starts, append=len(rows))
        ranks = np.zeros(len(self.values))
        ranks[rows] = np.repeat(starts + 0.5 * (counts + 1), counts)
        return ranks


def _top(now: _Order, before: _Order, count: int) -> tuple[RankedDesign, ...]:
    old_ranks = before.ranks()
    return tuple(
        RankedDesign(
            row=row,
            rank=place,
            rank_before=int(old_ranks[row]) or None,
            fitness=float(now.values[row]),
        )
        for place, row in enumerate(now.best[:count].tolist(), start=1)
    )


def _correlation(now: _Order, before: _Order) -> float | None:
    both = np.isfinite(now.values) & np.isfinite(before.values)
    ranks = [order.shared_ranks(both)[both] for order in (now, before)]
    a, b = (rank - 0.5 * (len(rank) + 1) for rank in ranks)
    scale = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / scale if scale > 0.0 else None
