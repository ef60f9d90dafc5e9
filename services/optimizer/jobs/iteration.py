"""Iterations of a job: asks, evaluations and their results"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from datetime import datetime
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.outcome import Outcome, Status

SUMMARY: Final = (
    *("best", "mean", "median", "worst", "best_so_far", "failed", "infeasible", "least_violation"),
)
"""Columns of an iteration computed from its fitness and violations."""


@dataclass(frozen=True, slots=True, eq=False)
class EvaluationColumns:
    """Evaluations, one per row, ordered by iteration and particle; read-only."""

    iteration: NDArray[np.int64]  # (r,) from 0
    particle: NDArray[np.int64]  # (r,) from 0
    designs: Floats  # (r, v) values of `Spec.design_space().names`, in the variables' units
    # (r, K, m) raw results: cases and `Spec.columns` in order, NaN if missing
    objectives: Floats
    statuses: NDArray[np.uint8]  # (r, K) values of `gaitswarm.sim.outcome.Status`
    fitness: Floats  # (r,) by the job's own measure, minimized, +inf if a case failed

    def __len__(self) -> int:
        return len(self.fitness)

    @property
    def arrays(self) -> tuple[NDArray[np.generic], ...]:
        """All columns, in the order of the constructor."""
        return tuple(getattr(self, column.name) for column in fields(self))

    @property
    def failed(self) -> NDArray[np.bool_]:
        """(r, K): cases without a result."""
        return np.asarray(self.statuses != Status.OK)

    def rows(self, chosen: slice | NDArray[np.intp]) -> EvaluationColumns:
        return EvaluationColumns(*(array[chosen] for array in self.arrays))  # type: ignore[arg-type]

    def of_iteration(self, iteration: int) -> EvaluationColumns:
        return self.rows(slice(*np.searchsorted(self.iteration, [iteration, iteration + 1])))

    def after(self, iteration: int | None) -> EvaluationColumns:
        """Return the rows of the iterations after one; all for None."""
        if iteration is None:
            return self
        return self.rows(slice(int(np.searchsorted(self.iteration, iteration, "right")), None))


class Reevaluation(NamedTuple):
    """A design of a single-precision search, reevaluated in double precision."""

    particle: int
    objectives: Floats  # (K, m) raw objectives by case, as in `Evaluation`
    statuses: NDArray[np.uint8]  # (K,) values of `gaitswarm.sim.outcome.Status`
    fitness: float  # minimized, +inf if any case failed


class Evaluation(NamedTuple):
    """A design's results in all cases of its job."""

    iteration: int
    particle: int
    design: Floats  # (v,) values of `Job.spec.design_space().names`
    # (K, m) raw results by case, columns as in `Spec.columns`, NaN if missing
    objectives: Floats
    statuses: NDArray[np.uint8]  # (K,) values of `gaitswarm.sim.outcome.Status`
    fitness: float  # minimized, +inf if any case failed
    # for a job's best design if the search uses single precision
    reevaluation: Reevaluation | None = None


def evaluations_of(columns: EvaluationColumns) -> tuple[Evaluation, ...]:
    rows = (columns.designs, columns.objectives, columns.statuses, columns.fitness.tolist())
    places = (columns.iteration.tolist(), columns.particle.tolist())
    return tuple(Evaluation(*row) for row in zip(*places, *rows, strict=True))


@dataclass(frozen=True, slots=True)
class Iteration:
    """A committed iteration as listed, without its designs."""

    index: int
    designs: int
    # least fitness, None if every design failed; `mean`, `median` and `worst` likewise, over finite
    # values
    best: float | None
    mean: float | None
    median: float | None
    worst: float | None
    best_so_far: float | None  # least fitness of this and all earlier iterations
    failed: int  # number of designs that failed in at least one case
    infeasible: int  # number of other designs that violate a constraint
    # of all its designs, 0 for a feasible one; None without constraints or if all failed
    least_violation: float | None
    evaluate_seconds: float  # duration of the evaluation [s]
    committed_at: datetime  # UTC
    digest: str | None = None


class Ask(NamedTuple):
    """An iteration to be evaluated, stored before evaluation; every number in it is finite."""

    iteration: int
    positions: Floats  # (particles, d) in the variables' units
    state: dict[str, Any]  # the optimizer's dump after the ask


class Answered(NamedTuple):
    """A committed ask, from which the next one follows."""

    ask: Ask
    columns: EvaluationColumns


class JournalEntry(NamedTuple):
    """Outcomes of a task of an iteration that is not committed yet."""

    case: int  # index of the case
    keys: tuple[bytes, ...]  # of the designs, see `walk_keys`
    outcome: Outcome  # of these designs in the case


class CompletedIteration(NamedTuple):
    """All that one transaction commits of an iteration."""

    iteration: int
    designs: Floats  # (n, v) values of `Job.spec.design_space().names`
    outcomes: tuple[Outcome, ...]  # K, one per case, of n designs each
    fitness: Floats  # (n,), +inf for a failed design
    evaluate_seconds: float  # duration of the evaluation [s]
    precision: Precision = "double"
    # of the best design, if the search uses single precision and no earlier design is as good
    reevaluation: Reevaluation | None = None
    # n keys of `walk_keys`, None for a design whose outcome was cached; empty for an iteration that
    # is not cached
    keys: tuple[bytes | None, ...] = ()
    evaluated_on: str | None = None  # where it was simulated, for people; None if unknown
    violations: Floats | None = None  # (n,) see `Spec.violations`

    @property
    def columns(self) -> EvaluationColumns:
        """The designs as they are stored."""
        return EvaluationColumns(
            np.full(len(self.fitness), self.iteration),
            np.arange(len(self.fitness)),
            self.designs,
            np.stack([outcome.objectives for outcome in self.outcomes], axis=1),
            np.stack([outcome.statuses for outcome in self.outcomes], axis=1),
            self.fitness,
        )

    @property
    def saved(self) -> int:
        """Number of designs whose outcome was cached."""
        return self.keys.count(None)

    @property
    def best(self) -> tuple[int, float] | None:
        """Particle and fitness of the best design, in double precision; None if there is none."""
        if self.precision == "double":
            particle = best_particle(self.fitness)
            return None if particle is None else (particle, float(self.fitness[particle]))
        reevaluation = self.reevaluation
        return (
            (reevaluation.particle, reevaluation.fitness)
            if reevaluation and math.isfinite(reevaluation.fitness)
            else None
        )


def best_particle(fitness: Floats) -> int | None:
    """Return the index of the least finite fitness."""
    finite = np.isfinite(fitness)
    return int(np.argmin(np.where(finite, fitness, np.inf))) if finite.any() else None


def fitness_summary(
    fitness: Floats,
    best: float | None,
    best_before: float | None,
    violations: Floats | None = None,
) -> dict[str, Any]:
    """Return the columns `SUMMARY`: statistics over finite fitness, None if there is none."""
    finite = fitness[np.isfinite(fitness)]
    summary: dict[str, Any] = dict.fromkeys(SUMMARY)
    summary["infeasible"] = 0
    if violations is not None:
        known = violations[np.isfinite(violations)]
        summary["infeasible"] = int(np.count_nonzero(known))
        summary["least_violation"] = float(known.min()) if len(known) else None
    summary["failed"] = len(fitness) - len(finite) - summary["infeasible"]
    bests = [value for value in (best, best_before) if value is not None]
    summary["best_so_far"] = min(bests, default=None)
    if len(finite):
        # The sum of huge values may overflow; such a mean counts as none.
        with np.errstate(over="ignore"):
            means = {"mean": float(np.mean(finite)), "median": float(np.median(finite))}
        summary |= {name: value for name, value in means.items() if math.isfinite(value)}
        summary |= {"best": float(np.min(finite)), "worst": float(np.max(finite))}
    return summary
