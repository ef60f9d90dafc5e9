"""What if another preference had judged: designs ranked anew, without a single walk."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.statistics import spearman
from gaitswarm.services.optimizer.analysis.utilities import fitness_of, log_utilities
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
        row: of the columns that were ranked.
        rank: by the new preference, from 1, the earliest of equals first.
        rank_before: by the job's own preference; None for a design that failed by it.
        fitness: by the new preference, minimized.
    """

    row: int
    rank: int
    rank_before: int | None
    fitness: float


@dataclass(frozen=True, slots=True, eq=False)
class Ranking:
    """All evaluations under one preference; fitness is minimized.

    Attributes:
        top: the best designs, best first.
        present_best: fitness of the design that the job itself holds to be the best, None without
            one.
        best_so_far: (iterations,), +inf until a design has walked in every scenario.
        correlation: Spearman's, of the fitness before and now over the designs that have both;
            None where it is undefined.
    """

    top: tuple[RankedDesign, ...]
    present_best: float | None
    best_so_far: Floats
    correlation: float | None


@dataclass(frozen=True, slots=True, eq=False)
class RankedJob:
    """A job's designs by another preference.

    Attributes:
        spec: of the job, with its own preference.
        columns: its evaluations, to which the ranking's rows refer.
        ranking: by the other preference.
    """

    spec: JobSpec
    columns: EvaluationColumns
    ranking: Ranking


def tuning_of(job: Job) -> JobSpec:
    """The spec of a job whose designs can be ranked."""
    if not isinstance(job.spec, JobSpec):
        raise InvalidRequest(
            f"job {job.id} is of kind {job.spec.kind}; only the designs of a job that tunes a"
            " drive are judged by a preference",
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
    """Judge all rows by another preference."""
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


def fitness_by(
    columns: EvaluationColumns, preference: Preference, *, worlds: TuningWorlds | None = None
) -> Floats:
    """Judge all rows by a preference.

    Returns:
        (r,) fitness, minimized, +inf for a design that failed.
    """
    logarithms = log_utilities(columns, preference)
    return fitness_of(logarithms if worlds is None else worlds.aggregated(logarithms))


def best_so_far(iteration: NDArray[np.int64], fitness: Floats) -> Floats:
    """The least fitness up to each iteration.

    Args:
        iteration: (r,) iteration of each row, ascending.
        fitness: (r,) of each row, +inf for a design that failed.

    Returns:
        (iterations,), one for each different iteration; it never rises.
    """
    if not len(iteration):
        return np.empty(0)
    starts = np.flatnonzero(np.diff(iteration, prepend=-1))
    return np.minimum.accumulate(np.minimum.reduceat(fitness, starts))


def _best_first(fitness: Floats, most: int) -> NDArray[np.intp]:
    """Rows of the least finite fitness (r,), the best first and the earliest of equals first."""
    rows = np.flatnonzero(np.isfinite(fitness))
    if len(rows) > most:
        # To sort all of them would take longer than to judge them.
        worst = np.partition(fitness[rows], most - 1)[most - 1]
        rows = rows[fitness[rows] <= worst]
    return rows[np.argsort(fitness[rows], kind="stable")][:most]


def _place(row: int, fitness: Floats, ordered: Floats) -> int | None:
    """Of a row among all of finite fitness (r,), from 1, the earliest of equals first."""
    own = fitness[row]
    if not np.isfinite(own):
        return None
    return int(np.searchsorted(ordered, own) + np.count_nonzero(fitness[:row] == own)) + 1


def rank_correlation(now: Floats, before: Floats) -> float | None:
    """Spearman's rank correlation, over the rows that are finite in both.

    Args:
        now: (r,) numbers.
        before: (r,) those that they are compared with.

    Returns:
        The correlation [1]; None where it is undefined.
    """
    both = np.isfinite(now) & np.isfinite(before)
    if not both.any():
        return None
    correlation = spearman(now[both], before[both])
    return None if math.isnan(correlation) else correlation
