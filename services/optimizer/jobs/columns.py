"""Evaluations of a job as columns, for arithmetic over thousands of them at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.outcome import Status

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class EvaluationColumns:
    """One row per evaluation, in order of iteration and particle. r rows; never written to.

    iteration, particle: (r,) int64. designs: (r, v), columns `Spec.design_space().names`.
    objectives: (r, K, m), cases and objectives in the spec's order, NaN where there is none.
    statuses: (r, K) uint8, values of `sim.outcome.Status`. fitness: (r,), +inf if a case failed.
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
        """Some of the rows: views for a slice, copies for indices."""
        return EvaluationColumns(
            self.iteration[chosen],
            self.particle[chosen],
            self.designs[chosen],
            self.objectives[chosen],
            self.statuses[chosen],
            self.fitness[chosen],
        )

    def after(self, iteration: int | None) -> EvaluationColumns:
        """Rows of the iterations with a greater index; all for None."""
        if iteration is None:
            return self
        return self.rows(slice(int(np.searchsorted(self.iteration, iteration, "right")), None))

    def row_of(self, iteration: int, particle: int) -> int | None:
        """Index of one evaluation's row; None if it is not here."""
        first, last = np.searchsorted(self.iteration, [iteration, iteration + 1])
        (found,) = np.nonzero(self.particle[first:last] == particle)
        return int(first + found[0]) if len(found) else None
