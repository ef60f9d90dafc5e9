"""Evaluations of a job as columns of arrays"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.outcome import Status

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class EvaluationColumns:
    """Evaluations, one per row, ordered by iteration and particle; read-only."""

    iteration: NDArray[np.int64]  # (r,) from 0
    particle: NDArray[np.int64]  # (r,) from 0
    designs: Floats  # (r, v) values of `Spec.design_space().names`, in the variables' units
    # (r, K, m) raw objectives, cases and objectives in the spec's order, NaN if missing
    objectives: Floats
    statuses: NDArray[np.uint8]  # (r, K) values of `gaitswarm.sim.outcome.Status`
    fitness: Floats  # (r,) by the job's own measure, minimized, +inf if a case failed

    def __len__(self) -> int:
        return len(self.fitness)

    @property
    def arrays(self) -> tuple[NDArray[np.generic], ...]:
        """All columns, in the order of the constructor."""
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
        return EvaluationColumns(*(array[chosen] for array in self.arrays))  # type: ignore[arg-type]

    def of_iteration(self, iteration: int) -> EvaluationColumns:
        return self.rows(slice(*np.searchsorted(self.iteration, [iteration, iteration + 1])))

    def after(self, iteration: int | None) -> EvaluationColumns:
        """Return the rows of the iterations after one; all for None."""
        if iteration is None:
            return self
        return self.rows(slice(int(np.searchsorted(self.iteration, iteration, "right")), None))
