"""Rankings of stored designs by another preference"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.statistics import spearman
from gaitswarm.services.optimizer.analysis.utilities import fitness_by
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import TuningWorlds
from gaitswarm.services.optimizer.jobs.preference import Preference

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class RankedDesign:
    """One of the best designs.

    Attributes:
        rank: by the new preference, from 1; ties by age.
        rank_before: by the job's own preference; None if the design failed.
    """

    row: int
    rank: int
    rank_before: int | None
    fitness: float


@dataclass(frozen=True, slots=True, eq=False)
class Ranking:
    """All evaluations under one preference; fitness is minimized.

    Attributes:
        present_best: new fitness of the job's own best design, None without one.
        best_so_far: (iterations,), +inf until a design succeeds.
        correlation: Spearman's, between old and new finite fitness; None if undefined.
    """

    top: tuple[RankedDesign, ...]
    present_best: float | None
    best_so_far: Floats
    correlation: float | None


@dataclass(frozen=True, slots=True, eq=False)
class RankedJob:
    """A job's designs by another preference."""

    spec: JobSpec
    columns: EvaluationColumns
    ranking: Ranking


def tuning_of(job: Job) -> JobSpec:
    """Return the spec of a job whose designs can be ranked."""
    if not isinstance(job.spec, JobSpec):
        raise InvalidRequest(
            f"job {job.id} is of kind {job.spec.kind}; only tuning jobs are judged by a preference",
            field="preference",
        )
    return job.spec


def rank(
    columns: EvaluationColumns,
    preference: Preference,
    *,
    top: int,
    worlds: TuningWorlds | None = None,
) -> Ranking:
    fitness, before = fitness_by(columns, preference, worlds=worlds), columns.fitness
    present, ordered = _best_first(before, 1), np.sort(before)
    return Ranking(
        top=tuple(
            RankedDesign(
                row=row,
                rank=place,
                rank_before=_place(row, before, ordered),
                fitness=float(fitness[row]),
            )
            for place, row in enumerate(_best_first(fitness, top).tolist(), start=1)
        ),
        present_best=float(fitness[present[0]]) if len(present) else None,
        best_so_far=best_so_far(columns.iteration, fitness),
        correlation=rank_correlation(fitness, before),
    )


def best_so_far(iteration: NDArray[np.int64], fitness: Floats) -> Floats:
    """Return the least fitness up to each distinct iteration.

    iteration: (r,) ascending. fitness: (r,), +inf for a failed design.
    """
    if not len(iteration):
        return np.empty(0)
    starts = np.flatnonzero(np.diff(iteration, prepend=-1))
    return np.minimum.accumulate(np.minimum.reduceat(fitness, starts))


def _best_first(fitness: Floats, most: int) -> NDArray[np.intp]:
    """Rows of the least finite fitness, best first; ties by age."""
    rows = np.flatnonzero(np.isfinite(fitness))
    if len(rows) > most:
        # Sorting all of them would take longer than judging them.
        worst = np.partition(fitness[rows], most - 1)[most - 1]
        rows = rows[fitness[rows] <= worst]
    return rows[np.argsort(fitness[rows], kind="stable")][:most]


def _place(row: int, fitness: Floats, ordered: Floats) -> int | None:
    """Rank of a row among finite fitness, from 1; ties by age."""
    value = fitness[row]
    if not np.isfinite(value):
        return None
    return int(np.searchsorted(ordered, value) + np.count_nonzero(fitness[:row] == value)) + 1


def rank_correlation(now: Floats, before: Floats) -> float | None:
    """Spearman's rank correlation over rows that are finite in both; None if undefined."""
    both = np.isfinite(now) & np.isfinite(before)
    if not both.any():
        return None
    correlation = spearman(now[both], before[both])
    return None if math.isnan(correlation) else correlation
