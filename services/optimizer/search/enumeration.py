"""An optimizer that enumerates positions without learning."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, NonNegativeInt

from gaitswarm.services.optimizer.search.optimizer import checked_fitness, parse_state

Floats = NDArray[np.float64]


class _CountedState(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)

    optimizer: str
    schema_version: Literal[1]
    iteration: NonNegativeInt
    evaluations: NonNegativeInt
    asked: NonNegativeInt


class Enumeration:
    """An optimizer that ignores its feedback: position k is a function of k.

    Its state is the number of positions so far.
    """

    def __init__(self, name: str, particles: int, positions: Callable[[int, int], Floats]) -> None:
        """Create an optimizer before its first ask."""
        self._name = name
        self._particles = particles
        self._positions = positions
        self.iteration = 0
        self.evaluations = 0
        self._asked = 0

    def start_from(self, positions: Floats) -> None:
        """Reject start positions."""
        if len(positions):
            raise ValueError(f"start_from(): {self._name} does not accept start positions")

    def ask(self, most: int | None = None) -> Floats:
        """Return the positions to evaluate next; the same ones until their fitness is known."""
        if not self._asked:
            self._asked = self._particles if most is None else min(most, self._particles)
        return self._positions(self.evaluations, self.evaluations + self._asked)

    def tell(self, fitness: Floats) -> None:
        """Proceed to the next positions."""
        self.evaluations += len(checked_fitness(fitness, self._asked))
        self.iteration += 1
        self._asked = 0

    def dump(self) -> dict[str, Any]:
        """Return the complete state."""
        return {
            "optimizer": self._name,
            "schema_version": 1,
            "iteration": self.iteration,
            "evaluations": self.evaluations,
            "asked": self._asked,
        }

    def load(self, state: dict[str, Any]) -> None:
        """Restore a state."""
        dumped = parse_state(state, self._name, _CountedState)
        if dumped.optimizer != self._name:
            raise ValueError(f"not a state of {self._name}: optimizer: {dumped.optimizer}")
        if dumped.asked > self._particles:
            raise ValueError(f"asked: {dumped.asked} positions, more than {self._name} asks for")
        self.iteration, self._asked = dumped.iteration, dumped.asked
        self.evaluations = dumped.evaluations
