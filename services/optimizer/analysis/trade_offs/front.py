"""The Pareto front of a job, from its stored objectives: ideal, knees, winners and hypervolume."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.ranking import fitness_by
from gaitswarm.services.optimizer.analysis.robustness.preference_winners import NAMED
from gaitswarm.services.optimizer.analysis.trade_offs.dominance import non_dominated
from gaitswarm.services.optimizer.analysis.trade_offs.hypervolume import (
    HypervolumeCurve,
    hypervolume_curve,
)
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import TuningWorlds

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

BEYOND_NADIR: Final = 0.1
"""Distance of the reference point from the nadir, as a share of the front's range."""

MOST_KNEES: Final = 5
"""Knees that are named, at most."""

KNEE_DISTANCE: Final = 0.25
"""Share of the front's range by which two knees differ in one objective at least."""


@dataclass(frozen=True, slots=True)
class Knee:
    """A design of the front that is nearer to the ideal than its surroundings.

    Attributes:
        row: of the job's evaluations.
        distance: from the plane through the mean of the extremes, in normalised objectives.
    """

    row: int
    distance: float


@dataclass(frozen=True, slots=True)
class FrontWinner:
    """The job's best design by some preference, and where it is with respect to the front.

    Attributes:
        row: of the job's evaluations.
        on_front: whether it is of the front, or equal to a design of it.
        dominated_by: designs of the front that dominate it.
        behind: share by which one of them is better in every objective; 0 on the front.
    """

    row: int
    on_front: bool
    dominated_by: int
    behind: float


@dataclass(frozen=True, slots=True, eq=False)
class Front:
    """What a job's designs trade against each other: five objectives over all scenarios.

    Normalised objectives are logarithms, 0 at the ideal and 1 at the nadir.

    Attributes:
        vectors: (r, M) objectives of all designs, see `objective_vectors`.
        rows: (f,) those of the front, ascending; of equal designs the earliest.
        ideal: (M,) least of the front in each objective.
        nadir: (M,) greatest of the front.
        normalised: (r, M) objectives of all designs.
        reference: (M,) reference point of the hypervolume, in the objectives' units.
        extremes: (M,) row of the best in each objective, of equal ones the nearest to the ideal.
        knees: the most pronounced first.
        winners: best designs by A, B and C, and by the job's own preference as `job`.
        iterations: (k,) iterations with evaluations.
        hypervolume: (k,) share of the box between ideal and reference that is dominated by the
            designs of this and all earlier iterations.
        standard_error: of the last hypervolume if it is an estimate, else 0.
    """

    vectors: Floats
    rows: Rows
    ideal: Floats
    nadir: Floats
    normalised: Floats
    reference: Floats
    extremes: Rows
    knees: tuple[Knee, ...]
    winners: Mapping[str, FrontWinner]
    iterations: NDArray[np.int64]
    hypervolume: Floats
    standard_error: float

    def spread(self, most: int) -> Rows:
        """Choose designs that cover the front: named ones, then always the one farthest from all"""
        if most >= len(self.rows):
            return self.rows
        winners = [winner.row for winner in self.winners.values() if winner.on_front]
        named = [*self.extremes.tolist(), *(knee.row for knee in self.knees), *winners]
        chosen = np.isin(self.rows, named)
        points = self.normalised[self.rows]
        distance = np.full(len(points), np.inf)
        for point in points[chosen]:
            np.minimum(distance, np.square(points - point).sum(axis=1), out=distance)
        while np.count_nonzero(chosen) < most:
            farthest = int(distance.argmax())
            chosen[farthest] = True
            apart = np.square(points - points[farthest]).sum(axis=1)
            np.minimum(distance, apart, out=distance)
        return self.rows[chosen]


def pareto_front(
    columns: EvaluationColumns,
    vectors: Floats,
    *,
    worlds: TuningWorlds | None = None,
) -> Front:
    """Find the front of a job's designs.

    Args:
        vectors: (r, M) their objectives over all scenarios, at least one row finite.
    """
    came = _best_at_their_time(vectors)
    rows = came[non_dominated(vectors[came])]
    ideal, nadir = vectors[rows].min(axis=0), vectors[rows].max(axis=0)
    logarithms, low, span = _logarithms(vectors, rows)
    normalised = (logarithms - low) / span
    iterations, hypervolume, error = _over_iterations(columns.iteration, normalised, came)
    with np.errstate(over="ignore"):
        reference = np.exp(low + (1.0 + BEYOND_NADIR) * span)
    extremes = _extremes(vectors, normalised, rows)
    judged = {name: fitness_by(columns, chosen, worlds=worlds) for name, chosen in NAMED.items()}
    judged["job"] = columns.fitness
    return Front(
        vectors=vectors,
        rows=rows,
        ideal=ideal,
        nadir=nadir,
        normalised=normalised,
        reference=reference,
        extremes=extremes,
        knees=knees(normalised, rows, extremes),
        winners={
            name: _winner(vectors, rows, int(fitness.argmin())) for name, fitness in judged.items()
        },
        iterations=iterations,
        hypervolume=hypervolume,
        standard_error=error,
    )


def knees(normalised: Floats, rows: Rows, extremes: Rows) -> tuple[Knee, ...]:
    """Find the knees of a front.

    The distance of a design is that from the plane of equal intercepts through the mean of the
    extremes, towards the ideal (Das 1999). A knee has the greatest distance among all designs that
    differ from it by less than `KNEE_DISTANCE` in each objective (Zhang, Tian and Jin 2015).

    Args:
        normalised: (r, M) objectives of all designs, 0 at the ideal and 1 at the nadir.
        rows: (f,) those of the front.
        extremes: (M,) rows of the best in each objective.
    """
    plane = normalised[extremes].sum(axis=1).mean()
    distances = (plane - normalised[rows].sum(axis=1)) / math.sqrt(normalised.shape[1])
    order = np.argsort(-distances, kind="stable")
    points, free = normalised[rows[order]], distances[order] > 0.0
    found: list[Knee] = []
    while len(found) < MOST_KNEES and free.any():
        place = int(free.argmax())
        near = (np.abs(points - points[place]) < KNEE_DISTANCE).all(axis=1)
        if not near[:place].any():
            found.append(Knee(int(rows[order[place]]), float(distances[order[place]])))
        # It is farther from the plane than all that are still free, so those beside it are none.
        free &= ~near
    return tuple(found)


def _best_at_their_time(vectors: Floats) -> Rows:
    """Rows (of r) without any earlier one that is as good in all objectives."""
    time = np.arange(len(vectors), dtype=np.float64)
    return np.flatnonzero(non_dominated(np.column_stack([time, vectors])))


def _logarithms(vectors: Floats, rows: Rows) -> tuple[Floats, Floats, Floats]:
    """(r, M) logarithms; (M,) the front's least; (M,) its range, 1 where it has none.

    An objective of 0, which has no logarithm, counts as the least that is more.
    """
    positive = np.where(vectors > 0.0, vectors, np.inf)
    least = np.where(np.isfinite(positive.min(axis=0)), positive.min(axis=0), 1.0)
    logarithms = np.log(np.maximum(vectors, least))
    low = logarithms[rows].min(axis=0)
    span = logarithms[rows].max(axis=0) - low
    return logarithms, low, np.where(span > 0.0, span, 1.0)


def _extremes(vectors: Floats, normalised: Floats, rows: Rows) -> Rows:
    """(M,) row of the best in each objective."""
    sums = normalised[rows].sum(axis=1)
    best = [np.lexsort((sums, vectors[rows, m]))[0] for m in range(vectors.shape[1])]
    return rows[best]


def _winner(vectors: Floats, rows: Rows, row: int) -> FrontWinner:
    own, front = vectors[row], vectors[rows]
    no_worse = (front <= own).all(axis=1)
    equal = (front == own).all(axis=1)
    dominating = front[no_worse & ~equal]
    if not len(dominating):
        return FrontWinner(row, on_front=True, dominated_by=0, behind=0.0)
    # 0 where both are 0.
    ratios = np.divide(dominating, own, out=np.ones_like(dominating), where=own > 0.0)
    behind = 1.0 - float(ratios.max(axis=1).min())
    return FrontWinner(row, on_front=False, dominated_by=len(dominating), behind=behind)


def _over_iterations(
    iteration: NDArray[np.int64], normalised: Floats, came: Rows
) -> tuple[NDArray[np.int64], Floats, float]:
    """(k,) iterations; (k,) hypervolume after each; standard error of the last.

    iteration: (r,); normalised: (r, M); came: rows that no earlier one dominates.
    """
    curve: HypervolumeCurve = hypervolume_curve(normalised[came] / (1.0 + BEYOND_NADIR))
    iterations = np.unique(iteration)
    counts = np.searchsorted(iteration[came], iterations, side="right")
    return iterations, np.concatenate([[0.0], curve.values])[counts], curve.standard_error
