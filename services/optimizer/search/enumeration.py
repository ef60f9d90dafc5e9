"""An optimizer that enumerates positions without learning."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.stateful import CountedState, Stateful

Floats = NDArray[np.float64]


class Enumeration(Stateful[CountedState]):
    """An optimizer that ignores its feedback: position k is a function of k."""

    def __init__(self, name: str, particles: int, positions: Callable[[int, int], Floats]) -> None:
        state = CountedState(optimizer=name, schema_version=1, iteration=0, asked=0, evaluations=0)
        super().__init__(particles, state)
        self._positions = positions

    @property
    def evaluations(self) -> int:
        return self.state.evaluations

    def start_from(self, positions: Floats) -> None:
        if len(positions):
            raise ValueError(
                f"start_from(): {self.state.optimizer} does not accept start positions"
            )

    def _waiting(self) -> Floats:
        first = self.state.evaluations
        return self._positions(first, first + (self.state.asked or self._particles))

    def _answer(self, fitness: Floats) -> None:
        self.state.evaluations += len(fitness)
