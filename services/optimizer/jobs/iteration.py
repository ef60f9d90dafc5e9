"""Iterations of a job: what is asked, and what its designs come to."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import Outcome


@dataclass(frozen=True, slots=True, eq=False)
class Reevaluation:
    """A design of a search in single precision, evaluated anew in double.

    Attributes:
        particle: of the swarm of its iteration, from 0.
        objectives: (K, m) raw objectives by case, as in `Evaluation`.
        statuses: (K,) values of `gaitswarm.sim.outcome.Status`.
        fitness: as `Job.spec.judge` has it, minimized, +inf if any case failed.
    """

    particle: int
    objectives: NDArray[np.float64]
    statuses: NDArray[np.uint8]
    fitness: float


@dataclass(frozen=True, slots=True)
class Evaluation:
    """One design, judged in every case of its job.

    Attributes:
        iteration: index of the iteration, from 0.
        particle: of the swarm, from 0.
        design: (v,) values of `Job.spec.design_space().names`, in the variables' units.
        objectives: (K, m) raw objectives by case, columns as in `Job.spec.objectives`, in their
            units, NaN where there is none.
        statuses: (K,) values of `gaitswarm.sim.outcome.Status`.
        fitness: as `Job.spec.judge` has it, minimized, +inf if any case failed.
        reevaluation: of the same design, with a job's best where the search is in single
            precision; None otherwise.
    """

    iteration: int
    particle: int
    design: NDArray[np.float64]
    objectives: NDArray[np.float64]
    statuses: NDArray[np.uint8]
    fitness: float
    reevaluation: Reevaluation | None = None


@dataclass(frozen=True, slots=True)
class Iteration:
    """One committed iteration, as it is listed: no particles.

    Attributes:
        index: from 0.
        designs: how many were judged in it.
        best: least fitness of the swarm, None if every design failed; `mean`, `median` and `worst`
            likewise, over the finite values.
        best_so_far: least fitness of this and all earlier iterations.
        failed: designs that failed in at least one case.
        evaluate_seconds: time that its evaluation took [s].
        committed_at: when it was committed, UTC.
        digest: of it and all before it, see `jobs.chain`.
    """

    index: int
    designs: int
    best: float | None
    mean: float | None
    median: float | None
    worst: float | None
    best_so_far: float | None
    failed: int
    evaluate_seconds: float
    committed_at: datetime
    digest: str | None = None


@dataclass(frozen=True, slots=True)
class Ask:
    """An iteration that is to be evaluated: stored before it is sent out.

    Positions and state are stored as standard JSON, so every number in them is finite.

    Attributes:
        iteration: index of the iteration, from 0.
        positions: (particles, d) as the optimizer gave them, in the variables' units.
        state: the optimizer's dump after the ask.
    """

    iteration: int
    positions: NDArray[np.float64]
    state: dict[str, Any]


@dataclass(frozen=True, slots=True, eq=False)
class Answered:
    """A committed ask, from which the next one follows.

    Attributes:
        ask: what was asked.
        columns: what its designs came to.
    """

    ask: Ask
    columns: EvaluationColumns


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """What a design came to in all cases of some job.

    Attributes:
        objectives: (K, m) raw objectives by case, NaN where there is none.
        statuses: (K,) values of `gaitswarm.sim.outcome.Status`.
    """

    objectives: NDArray[np.float64]
    statuses: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class CompletedIteration:
    """All that one transaction commits of an iteration.

    Attributes:
        iteration: index of the iteration, from 0.
        designs: (n, v) values of `Job.spec.design_space().names`, in the variables' units.
        outcomes: K, one per case, of the n designs each.
        fitness: (n,) of the designs, +inf for one that failed.
        evaluate_seconds: time that the evaluation took [s].
        precision: of the search.
        reevaluation: of its best design, where the search is in single precision and no earlier
            design is as good.
        keys: n, as `walk_keys` has them, None for a design whose outcome was known without a walk;
            or none at all, of an iteration that is not to be found again.
    """

    iteration: int
    designs: NDArray[np.float64]
    outcomes: tuple[Outcome, ...]
    fitness: NDArray[np.float64]
    evaluate_seconds: float
    precision: Precision = "double"
    reevaluation: Reevaluation | None = None
    keys: tuple[bytes | None, ...] = ()

    @property
    def saved(self) -> int:
        """Designs whose outcome was known without a walk."""
        return self.keys.count(None)

    @property
    def best(self) -> tuple[int, float] | None:
        """Particle and fitness of its best design, in double precision; None if there is none."""
        if self.precision == "double":
            particle = best_particle(self.fitness)
            return None if particle is None else (particle, float(self.fitness[particle]))
        anew = self.reevaluation
        return (anew.particle, anew.fitness) if anew and math.isfinite(anew.fitness) else None


def best_particle(fitness: NDArray[np.float64]) -> int | None:
    """Find the best of a swarm."""
    finite = np.isfinite(fitness)
    return int(np.argmin(np.where(finite, fitness, np.inf))) if finite.any() else None
