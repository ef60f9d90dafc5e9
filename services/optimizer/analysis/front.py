"""Pareto fronts and their hypervolume"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.evaluations import ObjectiveView
from gaitswarm.services.optimizer.analysis.utilities import NAMED, PreferenceOwner, fitness_by
from gaitswarm.services.optimizer.jobs.constraints import Constraints
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import WEIGHED, WEIGHED_NAMES
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.views import (
    DesignValues,
    Finite,
    IterationIndex,
    Particle,
    Request,
    View,
)
from gaitswarm.sim.arrays import Floats

Rows = NDArray[np.intp]

_BLOCK: Final = 1024
"""Points compared at a time."""


def non_dominated(points: Floats) -> NDArray[np.bool_]:
    """Return the (r,) mask of the points (r, M) that no other dominates; minimized."""
    finite = np.isfinite(points).all(axis=1)
    # Sorted lexicographically: no point is dominated by a later one.
    distinct, inverse = np.unique(points[finite], axis=0, return_inverse=True)
    selected = np.zeros(len(distinct), dtype=np.bool_)
    better: list[Floats] = []
    for first in range(0, len(distinct), _BLOCK):
        rows = np.arange(first, min(first + _BLOCK, len(distinct)))
        for block in better:
            rows = rows[_no_worse(block, distinct[rows]) == 0]
        # Each is no worse than itself.
        rows = rows[_no_worse(distinct[rows], distinct[rows]) == 1]
        selected[rows] = True
        better.append(distinct[rows])
    front = np.zeros(len(points), dtype=np.bool_)
    front[finite] = selected[inverse.reshape(-1)]
    return front


def _no_worse(judges: Floats, points: Floats) -> NDArray[np.intp]:
    """(n,): how many judges are no worse than each point (n, M) in every objective."""
    result = np.ones((len(judges), len(points)), dtype=np.bool_)
    for judge, point in zip(judges.T, points.T, strict=True):
        result &= judge[:, None] <= point
    return np.asarray(result.sum(axis=0))


_MOST_SAMPLES: Final = 100_000

_COMPARISONS: Final = 1_000_000_000
"""Limit on compared pairs: more points reduce the sample."""

_DRAW: Final = 0xA7EA

_AT_ONCE: Final = 4_000_000
"""Comparisons held in memory at a time."""


def hypervolume_curve(points: Floats) -> tuple[Floats, float]:
    """Estimate the (n,) hypervolumes after each of (n, M) points, minimized, in their order."""
    size = points.shape[1]
    samples = min(_MOST_SAMPLES, _COMPARISONS // len(points))
    left = RandomNumbers(0, _DRAW).uniform(samples, size)
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
    return values, math.sqrt(last * (1.0 - last) / samples)


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

FRONT_DESIGNS: Final = 1000
"""Designs of a front that are listed by default."""

MOST_FRONT_DESIGNS: Final = 10_000
"""Limit on the designs of a front that are listed."""

_EXAMPLE: Final = {
    "torque": 8.7,
    "acceleration": 1.8,
    "angular_acceleration": 16.1,
    "energy": 42.0,
    "reciprocal_speed": 6.4,
}
OwnFitness = Annotated[
    Finite, Field(description="By the job's own preference, minimized [1].", examples=[20.87])
]


class TradeOffDesignView(View):
    """A design of a job, by its objectives over all scenarios."""

    iteration: IterationIndex
    particle: Particle
    design: DesignValues
    objectives: dict[str, float] = Field(examples=[_EXAMPLE])
    """Each objective's geometric mean over the scenarios, minimized; units are in the front's
    `objectives`."""
    fitness: OwnFitness


class NormalisedDesignView(TradeOffDesignView):
    """A design of a job with respect to the job's front."""

    normalised: dict[str, float] = Field(examples=[dict.fromkeys(_EXAMPLE, 0.25)])
    """Logarithm of each objective, 0 at the front's ideal and 1 at its nadir [1]."""


class FrontDesignView(NormalisedDesignView):
    """A design that no other of its job dominates."""

    marks: list[str]
    """Labels: `knee 1`, `least energy`, `best under A`, `best of the job` and so on."""


class KneeView(NormalisedDesignView):
    """A design that is nearer to the ideal than those around it."""

    distance: float
    """From the plane of equal intercepts through the mean of the extremes, in normalised objectives
    [1]."""


class ExtremeView(NormalisedDesignView):
    """The best design in one objective."""

    objective: str = Field(description="Its name.", examples=["energy"])


class FrontWinnerView(NormalisedDesignView):
    """The best design of the job under a preference, which need not be on the front.

    The effect of biases differs from scenario to scenario, so that a dominated design can win.
    """

    preference: PreferenceOwner = Field(description="A, B or C of table 4.5, or the job's own.")
    on_front: bool = Field(description="Whether no design of the job dominates it.")
    dominated_by: int = Field(description="Designs of the front that dominate it.")
    behind: float = Field(description="Share by which one of these is better in all objectives.")


class FrontIterationView(View):
    """Hypervolume of the front at an iteration."""

    index: IterationIndex
    hypervolume: float = Field(description="Of the front up to this iteration [1].")


class FrontRequest(Request):
    """Constraints of the designs on a front, and how many to list."""

    most: int = Field(default=FRONT_DESIGNS, ge=1, le=MOST_FRONT_DESIGNS)
    """Maximum number of designs to list."""
    constraints: Constraints | None = Field(default=None, examples=[["speed>=0.05"]])
    """Limits that a design must keep, as in a spec; null: those of the job, an empty list: none."""


class FrontView(View):
    """The Pareto front of a job, without simulation."""

    objectives: list[ObjectiveView] = Field(description="f1 to f5 of table 4.1, in order.")
    designs_judged: int
    """Designs of the job that succeed in all scenarios and keep the constraints."""
    failed: int = Field(description="Designs that fail in a scenario.")
    infeasible: int = Field(description="Others, which violate a constraint.")
    size: int = Field(description="Nondominated designs; of equal ones the earliest.")
    ideal: dict[str, float] = Field(description="Least of the front in each objective.")
    nadir: dict[str, float] = Field(description="Greatest of the front in each objective.")
    reference: dict[str, float]
    """Reference point of the hypervolume: a tenth of the front's range beyond the nadir, in
    logarithms."""
    hypervolume: float = Field(examples=[0.63])
    """Share of the box between ideal and reference that the front dominates, in logarithms [1]."""
    hypervolume_error: float
    """Its standard error [1]: it is estimated from random points."""
    iterations: list[FrontIterationView]
    """Hypervolume by iteration, in the same box; it never falls."""
    knees: list[KneeView]
    """At most five, the most pronounced first: nearer to the ideal than all designs that differ by
    less than a quarter of the front's range in each objective."""
    extremes: list[ExtremeView] = Field(description="The best design in each objective.")
    winners: list[FrontWinnerView]
    """The best designs under A, B and C and under the job's own preference."""
    designs: list[FrontDesignView]
    """Designs of the front, in the order in which they were tried. Of a front of more than
    requested: labelled designs, and others that cover it evenly."""


def pareto_front(
    columns: EvaluationColumns, vectors: Floats, spec: JobSpec, *, most: int, infeasible: int = 0
) -> FrontView:
    """Find the front of (r, M) objective vectors, at least one row finite."""
    # Rows without any earlier one that is as good in all objectives.
    time = np.arange(len(vectors), dtype=np.float64)
    records = np.flatnonzero(non_dominated(np.column_stack([time, vectors])))
    rows = records[non_dominated(vectors[records])]
    logarithms, low, span = _logarithms(vectors, rows)
    normalised = (logarithms - low) / span
    with np.errstate(over="ignore"):
        reference = np.exp(low + (1.0 + BEYOND_NADIR) * span)
    volumes, error = hypervolume_curve(normalised[records] / (1.0 + BEYOND_NADIR))
    iterations = np.unique(columns.iteration)
    counts = np.searchsorted(columns.iteration[records], iterations, side="right")
    hypervolume = np.concatenate([[0.0], volumes])[counts].tolist()
    # Of equal ones the nearest to the ideal.
    sums = normalised[rows].sum(axis=1)
    extremes = rows[[np.lexsort((sums, values))[0] for values in vectors[rows].T]]
    knees = front_knees(normalised, rows, extremes)
    candidates = (
        np.flatnonzero(np.isfinite(vectors[:, 0])) if infeasible else np.arange(len(vectors))
    )
    among = columns.rows(candidates)
    winners: dict[PreferenceOwner, int] = {
        name: int(candidates[fitness_by(among, other, aggregation=spec.aggregation).argmin()])
        for name, other in NAMED.items()
    }
    winners["job"] = int(candidates[among.fitness.argmin()])

    marks: dict[int, list[str]] = {}
    for number, (row, _) in enumerate(knees, start=1):
        marks.setdefault(row, []).append(f"knee {number}")
    for name, row in zip(WEIGHED_NAMES, extremes.tolist(), strict=True):
        marks.setdefault(row, []).append(f"least {name}")
    for name, row in winners.items():
        label = "best of the job" if name == "job" else f"best under {name}"
        marks.setdefault(row, []).append(label)

    def fields(row: int) -> dict[str, Any]:
        normal = by_objective(normalised[row])
        return {**design_fields(columns, vectors, spec, row), "normalised": normal}

    judged = int(np.isfinite(vectors[:, 0]).sum())
    return FrontView(
        objectives=[ObjectiveView.model_validate(f) for f in WEIGHED],
        designs_judged=judged,
        failed=len(columns) - judged - infeasible,
        infeasible=infeasible,
        size=len(rows),
        ideal=by_objective(vectors[rows].min(axis=0)),
        nadir=by_objective(vectors[rows].max(axis=0)),
        reference=by_objective(reference),
        hypervolume=hypervolume[-1],
        hypervolume_error=error,
        iterations=[
            FrontIterationView(index=index, hypervolume=value)
            for index, value in zip(iterations.tolist(), hypervolume, strict=True)
        ],
        knees=[KneeView(**fields(row), distance=distance) for row, distance in knees],
        extremes=[
            ExtremeView(**fields(row), objective=name)
            for name, row in zip(WEIGHED_NAMES, extremes.tolist(), strict=True)
        ],
        winners=[
            FrontWinnerView(**fields(row), preference=name, **_dominance(vectors, rows, row))
            for name, row in winners.items()
        ],
        designs=[
            FrontDesignView(**fields(row), marks=marks.get(row, []))
            for row in _spread(normalised, rows, list(marks), most).tolist()
        ],
    )


def design_fields(
    columns: EvaluationColumns, vectors: Floats, spec: JobSpec, row: int
) -> dict[str, Any]:
    """Return the fields of the `TradeOffDesignView` of one row."""
    return {
        "iteration": int(columns.iteration[row]),
        "particle": int(columns.particle[row]),
        "design": spec.design_space().shown(columns.designs[row].tolist()),
        "objectives": by_objective(vectors[row]),
        "fitness": float(columns.fitness[row]),
    }


def by_objective(values: Floats) -> dict[str, float]:
    return dict(zip(WEIGHED_NAMES, values.tolist(), strict=True))


def front_knees(normalised: Floats, rows: Rows, extremes: Rows) -> list[tuple[int, float]]:
    """Return the rows of a front's knees with their distances, most pronounced first.

    A design's distance is that from the plane of equal intercepts through the mean of the extremes,
    towards the ideal (Das 1999). A knee has the greatest distance among all designs that differ
    from it by less than `KNEE_DISTANCE` in each objective (Zhang, Tian and Jin 2015).
    """
    plane = normalised[extremes].sum(axis=1).mean()
    distances = (plane - normalised[rows].sum(axis=1)) / math.sqrt(normalised.shape[1])
    order = np.argsort(-distances, kind="stable")
    points, free = normalised[rows[order]], distances[order] > 0.0
    result: list[tuple[int, float]] = []
    while len(result) < MOST_KNEES and free.any():
        place = int(free.argmax())
        near = (np.abs(points - points[place]) < KNEE_DISTANCE).all(axis=1)
        if not near[:place].any():
            result.append((int(rows[order[place]]), float(distances[order[place]])))
        # It is the farthest of the remaining designs, so its neighbors are no knees.
        free &= ~near
    return result


def _logarithms(vectors: Floats, rows: Rows) -> tuple[Floats, Floats, Floats]:
    """(r, M) logarithms; (M,) the front's minimum; (M,) its range, 1 if there is none."""
    positive = np.where(vectors > 0.0, vectors, np.inf)
    least = np.where(np.isfinite(positive.min(axis=0)), positive.min(axis=0), 1.0)
    logarithms = np.log(np.maximum(vectors, least))
    low = logarithms[rows].min(axis=0)
    span = logarithms[rows].max(axis=0) - low
    return logarithms, low, np.where(span > 0.0, span, 1.0)


def _dominance(vectors: Floats, rows: Rows, row: int) -> dict[str, Any]:
    """By how many designs of the front (f,) a design is dominated, and by how much."""
    vector, front = vectors[row], vectors[rows]
    equal = (front == vector).all(axis=1)
    dominating = front[(front <= vector).all(axis=1) & ~equal]
    if not len(dominating):
        return {"on_front": True, "dominated_by": 0, "behind": 0.0}
    # 0 where both are 0.
    ratios = np.divide(dominating, vector, out=np.ones_like(dominating), where=vector > 0.0)
    behind = 1.0 - float(ratios.max(axis=1).min())
    return {"on_front": False, "dominated_by": len(dominating), "behind": behind}


def _spread(normalised: Floats, rows: Rows, named: Sequence[int], most: int) -> Rows:
    """Choose rows that cover a front: named designs, then repeatedly the farthest one."""
    if most >= len(rows):
        return rows
    chosen = np.isin(rows, named)
    points = normalised[rows]
    distance = np.full(len(points), np.inf)
    following = np.flatnonzero(chosen).tolist()
    while following or np.count_nonzero(chosen) < most:
        place = following.pop() if following else int(distance.argmax())
        chosen[place] = True
        apart = np.square(points - points[place]).sum(axis=1)
        np.minimum(distance, apart, out=distance)
    return rows[chosen]
