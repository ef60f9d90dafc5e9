"""Pareto fronts and their hypervolume"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.preference_winners import NAMED
from gaitswarm.services.optimizer.analysis.ranking import fitness_by
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import TuningWorlds
from gaitswarm.services.optimizer.search.random_stream import uniform

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

_LEAF: Final = 1 << 15
"""Pairs of points compared without further division."""


def non_dominated(points: Floats) -> NDArray[np.bool_]:
    """Return the (r,) mask of the points (r, M) that no other dominates; minimized.

    A point dominates another if it is no worse in any objective and better in one; equal points do
    not dominate each other. Points that are not finite are never on the front.
    """
    finite = np.isfinite(points).all(axis=1)
    front = np.zeros(len(points), dtype=np.bool_)
    if not finite.any():
        return front
    # Sorted lexicographically: no point is dominated by a later one.
    distinct, inverse = np.unique(points[finite], axis=0, return_inverse=True)
    selected = np.zeros(len(distinct), dtype=np.bool_)
    selected[_front(distinct, np.arange(len(distinct)))] = True
    front[finite] = selected[inverse.reshape(-1)]
    return front


def _front(points: Floats, rows: Rows) -> Rows:
    if len(rows) ** 2 <= _LEAF:
        return rows[~_any_below(points[rows], points[rows], itself=True)]
    half = len(rows) // 2
    better, worse = _front(points, rows[:half]), _front(points, rows[half:])
    # The first objective is already sorted.
    return np.concatenate([better, _left(points, better, worse, 1)])


def _left(points: Floats, judges: Rows, rows: Rows, first: int) -> Rows:
    """Return the rows, in order, that no judge is as good as in all objectives from `first` on.

    Judges are as good as all rows in the objectives before, and none equals a row in all.
    """
    if not len(judges) or not len(rows):
        return rows
    objectives = points.shape[1]
    if first >= objectives:
        return rows[:0]
    if first == objectives - 1:
        best = float(points[judges, first].min())
        return np.asarray(rows[points[rows, first] < best])
    if len(judges) * len(rows) <= _LEAF:
        return rows[~_any_below(points[judges, first:], points[rows, first:])]
    if first == objectives - 2:
        return rows[~_swept(points[judges, first:], points[rows, first:])]
    values, others = points[rows, first], points[judges, first]
    pivot = np.median(np.concatenate([values, others]))
    low, judge_low = values < pivot, others < pivot
    if not (low.any() or judge_low.any()):
        # Nothing is below the pivot: most equal it.
        low, judge_low = values <= pivot, others <= pivot
        if low.all() and judge_low.all():
            return _left(points, judges, rows, first + 1)
    good = _left(points, judges[judge_low], rows[low], first)
    bad = _left(points, judges[judge_low], rows[~low], first + 1)
    return np.sort(np.concatenate([good, _left(points, judges[~judge_low], bad, first)]))


def _any_below(judges: Floats, points: Floats, *, itself: bool = False) -> NDArray[np.bool_]:
    """(n,): whether any judge, except itself with `itself`, is as good in every objective."""
    below = np.ones((len(judges), len(points)), dtype=np.bool_)
    for m in range(points.shape[1]):
        below &= judges[:, m, None] <= points[None, :, m]
    if itself:
        np.fill_diagonal(below, val=False)
    return np.asarray(below.any(axis=0))


def _swept(judges: Floats, points: Floats) -> NDArray[np.bool_]:
    """As `_any_below`, for two objectives, by sweeping along the first."""
    order = np.argsort(judges[:, 0], kind="stable")
    least = np.minimum.accumulate(judges[order, 1])
    before = np.searchsorted(judges[order, 0], points[:, 0], side="right")
    return np.asarray((before > 0) & (least[np.maximum(before, 1) - 1] <= points[:, 1]))


MOST_BOUNDS: Final = 250_000
"""Number of local upper bounds up to which a hypervolume is computed exactly."""

_MOST_SAMPLES: Final = 100_000
"""Limit on the sample size of an estimate."""

_COMPARISONS: Final = 1_000_000_000
"""Limit on compared pairs of an estimate: more points reduce the sample."""

_DRAW: Final = 0xA7EA

_AT_ONCE: Final = 4_000_000
"""Comparisons held in memory at a time."""


@dataclass(frozen=True, slots=True, eq=False)
class HypervolumeCurve:
    """Hypervolume after each point of a sequence.

    Attributes:
        values: (n,) share of the unit box dominated by the first 1, 2, ... points.
        standard_error: of the last value for estimates; 0 for exact values.
    """

    values: Floats
    standard_error: float


def hypervolume_curve(points: Floats, *, most_bounds: int = MOST_BOUNDS) -> HypervolumeCurve:
    """Return the hypervolume after each of (n, M) points, minimized, in their order.

    The box is the unit box with the reference point at 1; values below 0 count as 0.
    """
    clipped = np.maximum(points, 0.0)
    exact = _exact(clipped, most_bounds)
    return _estimated(clipped) if exact is None else HypervolumeCurve(exact, 0.0)


def _exact(points: Floats, most_bounds: int) -> Floats | None:
    """(n,) values; None beyond the limit on bounds."""
    undominated = _Undominated.of(points)
    values = np.empty(len(points))
    for row in range(len(points)):
        undominated.insert(row)
        if undominated.count > most_bounds:
            return None
        values[row] = undominated.volume
    return np.maximum.accumulate(np.clip(1.0 - values, 0.0, 1.0))


@dataclass(slots=True, eq=False)
class _Undominated:
    """The part of the unit box that no point dominates, as a union of [0, bound).

    A bound's coordinate j is that of the point defining[j], or 1 where that is -1; the point is
    below the bound in all other coordinates. Of equal coordinates the later point's counts as
    greater, so that no two are equal.

    points: (n, M); bounds: (M, room), used up to `count`; defining: (M, room) rows of points;
    volumes: (room,) of the disjoint boxes; volume: their sum.
    """

    points: Floats
    bounds: Floats
    defining: Rows
    volumes: Floats
    count: int
    volume: float

    @classmethod
    def of(cls, points: Floats) -> _Undominated:
        size = points.shape[1]
        return cls(
            # The last row belongs to -1: the sides of the box.
            np.vstack([points, np.zeros(size)]),
            np.ones((size, 1024)),
            np.full((size, 1024), -1, dtype=np.intp),
            np.ones(1024),
            count=1,
            volume=1.0,
        )

    def insert(self, row: int) -> None:
        point, size = self.points[row], self.points.shape[1]
        above = self.bounds[0, : self.count] > point[0]
        for j in range(1, size):
            above &= self.bounds[j, : self.count] > point[j]
        split = np.flatnonzero(above)
        if not len(split):
            return
        bounds, defining = self.bounds[:, split], self.defining[:, split]
        new_bounds, new_defining = [], []
        for j in range(size):
            others = self.points[np.delete(defining, j, axis=0), j]
            selected = point[j] >= others.max(axis=0, initial=0.0)
            new = bounds[:, selected]
            new[j] = point[j]
            by = defining[:, selected]
            by[j] = row
            new_bounds.append(new)
            new_defining.append(by)
        self._replace(split, np.concatenate(new_bounds, 1), np.concatenate(new_defining, 1))

    def _replace(self, old: Rows, bounds: Floats, defining: Rows) -> None:
        volumes = self._volumes(bounds, defining)
        self.volume += math.fsum(volumes) - math.fsum(self.volumes[old])
        added = max(0, len(volumes) - len(old))
        self._reserve(self.count + added)
        places = np.concatenate([old, np.arange(self.count, self.count + added)])
        places, empty = places[: len(volumes)], places[len(volumes) :]
        self.bounds[:, places], self.defining[:, places] = bounds, defining
        self.volumes[places] = volumes
        # No point is below these.
        self.bounds[:, empty], self.volumes[empty] = 0.0, 0.0
        self.count += added

    def _volumes(self, bounds: Floats, defining: Rows) -> Floats:
        """Volumes of the boxes: in coordinate j, above the points that define earlier ones."""
        volumes: Floats = bounds[0].copy()
        for j in range(1, len(bounds)):
            volumes *= np.maximum(bounds[j] - self.points[defining[:j], j].max(axis=0), 0.0)
        return volumes

    def _reserve(self, count: int) -> None:
        room = self.bounds.shape[1]
        if count > room:
            more = max(count, 2 * room) - room
            self.bounds = np.pad(self.bounds, ((0, 0), (0, more)))
            self.defining = np.pad(self.defining, ((0, 0), (0, more)))
            self.volumes = np.pad(self.volumes, (0, more))


def _estimated(points: Floats) -> HypervolumeCurve:
    size = points.shape[1]
    samples = min(_MOST_SAMPLES, _COMPARISONS // len(points))
    drawn = uniform(0, _DRAW, iteration=0, particle=0, count=samples * size)
    left = drawn.reshape(samples, size)
    hits = np.zeros(len(points), dtype=np.int64)
    first, step = 0, 1
    while first < len(points) and len(left):
        chunk = points[first : first + step]
        when = _first_below(chunk, left)
        dominated = when < len(chunk)
        hits[first : first + len(chunk)] = np.bincount(when[dominated], minlength=len(chunk))
        left = left[~dominated]
        first += len(chunk)
        step = max(1, _AT_ONCE // max(1, len(left)))
    values = np.cumsum(hits) / samples
    last = float(values[-1])
    return HypervolumeCurve(values, math.sqrt(last * (1.0 - last) / samples))


def _first_below(points: Floats, samples: Floats) -> Rows:
    """(s,) index of the first point that dominates each sample; n for none."""
    below = np.ones((len(samples), len(points) + 1), dtype=np.bool_)
    for m in range(points.shape[1]):
        below[:, :-1] &= points[None, :, m] <= samples[:, m, None]
    return np.asarray(below.argmax(axis=1))


BEYOND_NADIR: Final = 0.1
"""Distance of the reference point from the nadir, as a share of the front's range."""

MOST_KNEES: Final = 5
"""Limit on the number of knees."""

KNEE_DISTANCE: Final = 0.25
"""Share of the front's range by which two knees differ in at least one objective."""


@dataclass(frozen=True, slots=True)
class Knee:
    """A design of the front that is closer to the ideal than its neighborhood.

    Attributes:
        distance: from the plane through the mean of the extremes, in normalised objectives.
    """

    row: int
    distance: float


@dataclass(frozen=True, slots=True)
class FrontWinner:
    """The job's best design by a preference, relative to the front.

    Attributes:
        on_front: whether it belongs to the front, or equals a design of it.
        dominated_by: number of designs of the front that dominate it.
        behind: share by which one of them is better in every objective; 0 on the front.
    """

    row: int
    on_front: bool
    dominated_by: int
    behind: float


@dataclass(frozen=True, slots=True, eq=False)
class Front:
    """Trade-off between a job's designs: five objectives over all scenarios.

    Normalised objectives are logarithms, 0 at the ideal and 1 at the nadir.

    Attributes:
        vectors: (r, M) objectives of all designs, see `objective_vectors`.
        rows: (f,) rows of the front, ascending; of equal designs the earliest.
        ideal: (M,) minimum of the front.
        nadir: (M,) maximum of the front.
        normalised: (r, M) objectives of all designs.
        reference: (M,) reference point of the hypervolume.
        extremes: (M,) row of the best in each objective; of equal ones the nearest to the ideal.
        knees: most pronounced first.
        winners: best designs by A, B and C, and by the job's own preference as `job`.
        iterations: (k,) iterations with evaluations.
        hypervolume: (k,) share of the box between ideal and reference dominated up to each
            iteration.
        standard_error: of the last hypervolume if estimated, else 0.
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
        """Return rows that cover the front: named designs, then repeatedly the farthest one."""
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
    """Find the front of (r, M) objective vectors, at least one row finite."""
    record_rows = _best_at_their_time(vectors)
    rows = record_rows[non_dominated(vectors[record_rows])]
    ideal, nadir = vectors[rows].min(axis=0), vectors[rows].max(axis=0)
    logarithms, low, span = _logarithms(vectors, rows)
    normalised = (logarithms - low) / span
    iterations, hypervolume, error = _over_iterations(columns.iteration, normalised, record_rows)
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

    A design's distance is that from the plane of equal intercepts through the mean of the extremes,
    towards the ideal (Das 1999). A knee has the greatest distance among all designs that differ
    from it by less than `KNEE_DISTANCE` in each objective (Zhang, Tian and Jin 2015).
    """
    plane = normalised[extremes].sum(axis=1).mean()
    distances = (plane - normalised[rows].sum(axis=1)) / math.sqrt(normalised.shape[1])
    order = np.argsort(-distances, kind="stable")
    points, free = normalised[rows[order]], distances[order] > 0.0
    result: list[Knee] = []
    while len(result) < MOST_KNEES and free.any():
        place = int(free.argmax())
        near = (np.abs(points - points[place]) < KNEE_DISTANCE).all(axis=1)
        if not near[:place].any():
            result.append(Knee(int(rows[order[place]]), float(distances[order[place]])))
        # It is the farthest of the remaining designs, so its neighbors are no knees.
        free &= ~near
    return tuple(result)


def _best_at_their_time(vectors: Floats) -> Rows:
    """Rows without any earlier one that is as good in all objectives."""
    time = np.arange(len(vectors), dtype=np.float64)
    return np.flatnonzero(non_dominated(np.column_stack([time, vectors])))


def _logarithms(vectors: Floats, rows: Rows) -> tuple[Floats, Floats, Floats]:
    """(r, M) logarithms; (M,) the front's minimum; (M,) its range, 1 if there is none.

    An objective of 0, which has no logarithm, counts as the least positive one.
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
    vector, front = vectors[row], vectors[rows]
    no_worse = (front <= vector).all(axis=1)
    equal = (front == vector).all(axis=1)
    dominating = front[no_worse & ~equal]
    if not len(dominating):
        return FrontWinner(row, on_front=True, dominated_by=0, behind=0.0)
    # 0 where both are 0.
    ratios = np.divide(dominating, vector, out=np.ones_like(dominating), where=vector > 0.0)
    behind = 1.0 - float(ratios.max(axis=1).min())
    return FrontWinner(row, on_front=False, dominated_by=len(dominating), behind=behind)


def _over_iterations(
    iteration: NDArray[np.int64], normalised: Floats, record_rows: Rows
) -> tuple[NDArray[np.int64], Floats, float]:
    """(k,) iterations; (k,) hypervolume after each; standard error of the last.

    iteration: (r,); normalised: (r, M); record_rows: rows that no earlier one dominates.
    """
    curve: HypervolumeCurve = hypervolume_curve(normalised[record_rows] / (1.0 + BEYOND_NADIR))
    iterations = np.unique(iteration)
    counts = np.searchsorted(iteration[record_rows], iterations, side="right")
    return iterations, np.concatenate([[0.0], curve.values])[counts], curve.standard_error
