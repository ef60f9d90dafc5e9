"""Evaluations of a job as columns, for arithmetic over thousands of them at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.outcome import Status

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class EvaluationColumns:
    """Evaluations, one row each, in order of iteration and particle; never written to.

    Attributes:
        iteration: (r,) index of the iteration, from 0.
        particle: (r,) particle of the swarm, from 0.
        designs: (r, v) values of `Spec.design_space().names`, in the variables' units.
        objectives: (r, K, m) raw objectives, cases and objectives in the spec's order, in their
            units, NaN where there is none.
        statuses: (r, K) values of `gaitswarm.sim.outcome.Status`.
        fitness: (r,) by the job's own measure, minimized, +inf if a case failed.
    """

    iteration: NDArray[np.int64]
    particle: NDArray[np.int64]
    designs: Floats
    objectives: Floats
    statuses: NDArray[np.uint8]
    fitness: Floats

    def __len__(self) -> int:
        return len(self.fitness)

    @property
    def arrays(self) -> tuple[NDArray[np.generic], ...]:
        """All columns, in the order of the constructor's arguments."""
        return (
            self.iteration,
            self.particle,
            self.designs,
            self.objectives,
            self.statuses,
            self.fitness,
        )

    @property
    def failed(self) -> NDArray[np.bool_]:
        """(r, K): cases without a result."""
        return np.asarray(self.statuses != Status.OK)

    def rows(self, chosen: slice | NDArray[np.intp]) -> EvaluationColumns:
        """Choose rows."""
        return EvaluationColumns(
            self.iteration[chosen],
            self.particle[chosen],
            self.designs[chosen],
            self.objectives[chosen],
            self.statuses[chosen],
            self.fitness[chosen],
        )

    def of_iteration(self, iteration: int) -> EvaluationColumns:
        """Choose one iteration."""
        return self.rows(slice(*np.searchsorted(self.iteration, [iteration, iteration + 1])))

    def after(self, iteration: int | None) -> EvaluationColumns:
        """Leave out the first iterations."""
        if iteration is None:
            return self
        return self.rows(slice(int(np.searchsorted(self.iteration, iteration, "right")), None))
