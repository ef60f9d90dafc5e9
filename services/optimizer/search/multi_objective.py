"""The template of a method that learns from objective vectors, in whole generations."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.generational import (
    Generational,
    GenerationState,
    Worth,
    of_worth,
    worth,
)
from gaitswarm.services.optimizer.search.optimizer import SearchSettings, checked_fitness

Floats = NDArray[np.float64]

S = TypeVar("S", bound=SearchSettings)


class VectorState(GenerationState):
    """What `dump` writes, with the objective vectors of the generation under way as `fitness`."""

    fitness: list[Worth]  # type: ignore[assignment]


V = TypeVar("V", bound=VectorState)


class MultiObjective(Generational[S, V]):
    """A search that is told (n, M) objective vectors in place of (n,) fitness values.

    M is that of the first vectors that it is told. What `Generational` calls fitness is vectors
    here; a vector of which any number is +inf is that of a failed evaluation.
    """

    @property
    def objectives(self) -> int | None:
        """M; None before the first vectors are told."""
        return self._fitness.shape[1] if len(self._fitness) else None

    def checked(self, fitness: Floats, asked: int) -> Floats:
        """Check what is told."""
        first = fitness.shape[1] if fitness.ndim > 1 else 0
        return checked_fitness(fitness, asked, self.objectives or max(1, first))

    def written(self, fitness: Floats) -> list[Any]:
        """Write objective vectors as JSON takes them."""
        return [worth(row) for row in fitness.tolist()]

    def read(self, values: list[Any]) -> Floats:
        """Read back what `written` gave."""
        return vectors_of(values, "fitness")


def vectors_of(rows: list[Worth], name: str) -> Floats:
    """Read objective vectors of a dumped state."""
    if len({len(row) for row in rows}) > 1 or any(not row for row in rows):
        raise ValueError(f"{name}: vectors of one length were expected")
    return np.array([of_worth(row) for row in rows], dtype=np.float64)
