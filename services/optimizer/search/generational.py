"""Base class of methods that learn from whole generations."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, ClassVar, Final, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, FiniteFloat, NonNegativeInt

from gaitswarm.services.optimizer.search.optimizer import (
    SearchSettings,
    checked_fitness,
    checked_start,
    matrix,
    parse_state,
)
from gaitswarm.services.optimizer.search.space import Space

Floats = NDArray[np.float64]

S = TypeVar("S", bound=SearchSettings)

Row = list[FiniteFloat]
Worth = list[FiniteFloat | None]
"""Fitness values; None stands for +inf."""


class GenerationState(BaseModel):
    """The state that `Generational.dump` writes; a method adds its memory.

    Attributes:
        iteration: Completed tells.
        evaluations: Positions evaluated so far.
        generations: Generations learned from.
        positions: The current generation, empty before the first.
        fitness: Fitness of its first positions, as far as it is known.
        asked: Number of the following positions that are asked for.
    """

    model_config = ConfigDict(extra="forbid", strict=True)

    optimizer: str
    schema_version: int
    iteration: NonNegativeInt
    evaluations: NonNegativeInt
    generations: NonNegativeInt
    positions: list[Row]
    fitness: Worth
    asked: NonNegativeInt


G = TypeVar("G", bound=GenerationState)


class Generational(ABC, Generic[S, G]):
    """A search that asks for a generation, whole or in pieces, and then learns from it.

    Attributes:
        budget: Evaluations of the planned run.
        generations: Number of generations learned from.
        positions: (n, d) the current generation, (0, d) before the first.

    Subclasses define the generations and what is kept of one. Their random numbers are indexed by
    generation, so that they do not depend on the pieces.

    Start positions replace the first members of the first generation. If there are more start
    positions than members, all are evaluated, and the best become the generation.
    """

    state_model: ClassVar[type[GenerationState]]
    schema_version: ClassVar[int] = 1

    def __init__(self, settings: S, space: Space, budget: int, seed: int) -> None:
        """Create a search before its first ask."""
        self.settings: Final = settings
        self.space: Final = space
        self.budget: Final = budget
        self.seed: Final = seed
        self._iteration = 0
        self._evaluations = 0
        self.generations = 0
        self.positions: Floats = np.empty((0, space.dimension))
        self._fitness: Floats = np.empty(0)
        self._asked = 0
        self._start: Floats = np.empty((0, space.dimension))

    @property
    def first_size(self) -> int:
        """Size of the first generation if there are more start positions."""
        return self.settings.particles

    @property
    def iteration(self) -> int:
        """Number of completed tells."""
        return self._iteration

    @property
    def evaluations(self) -> int:
        """Number of positions evaluated so far."""
        return self._evaluations

    def start_from(self, positions: Floats) -> None:
        """Replace the first members by positions."""
        begun = bool(self._evaluations or len(self.positions))
        self._start = checked_start(positions, self.space, begun=begun)

    def ask(self, most: int | None = None) -> Floats:
        """Return the positions to evaluate next; the same ones until their fitness is known."""
        done = len(self._fitness)
        if not self._asked:
            if done == len(self.positions):
                self.positions = self.propose() if self.generations else self._first()
                self._fitness, done = np.empty(0), 0
            limit = self.settings.particles if most is None else min(most, self.settings.particles)
            self._asked = min(limit, len(self.positions) - done)
        return self.positions[done : done + self._asked].copy()

    def tell(self, fitness: Floats) -> None:
        """Receive the fitness of the positions asked for last."""
        values = self.checked(fitness, self._asked)
        self._fitness = np.concatenate([self._fitness, values]) if len(self._fitness) else values
        self._iteration += 1
        self._evaluations += self._asked
        self._asked = 0
        if len(self._fitness) == len(self.positions):
            if not self.generations and len(self._start) > self.first_size:
                self._keep_the_best()
            self.learn(self.positions, self._fitness)
            self.generations += 1

    def dump(self) -> dict[str, Any]:
        """Return the complete state."""
        return {
            "optimizer": self.settings.name,
            "schema_version": self.schema_version,
            "iteration": self._iteration,
            "evaluations": self._evaluations,
            "generations": self.generations,
            "positions": self.positions.tolist(),
            "fitness": self.written(self._fitness),
            "asked": self._asked,
            **self.memory(),
        }

    def load(self, state: dict[str, Any]) -> None:
        """Restore a state."""
        name = self.settings.name
        dumped = parse_state(state, name, self.state_model)
        for field, expected in (("optimizer", name), ("schema_version", self.schema_version)):
            if getattr(dumped, field) != expected:
                raise ValueError(
                    f"not a state of {name}: {field}: {getattr(dumped, field)}, not {expected}"
                )
        shape = (len(dumped.positions), self.space.dimension)
        positions = self.inside(matrix(dumped.positions, shape, "positions"), "positions")
        if len(dumped.fitness) + dumped.asked > len(positions):
            raise ValueError("asked: more than the remaining positions")
        fitness = self.read(dumped.fitness)
        self.recall(dumped)  # type: ignore[arg-type]
        self._iteration, self._evaluations = dumped.iteration, dumped.evaluations
        self.generations, self._asked = dumped.generations, dumped.asked
        self.positions, self._fitness = positions, fitness

    def _first(self) -> Floats:
        """Return the first generation, including the start positions."""
        proposed = self.propose()
        return np.vstack([self._start, proposed[len(self._start) :]])

    def _keep_the_best(self) -> None:
        """Reduce the start positions to the best; of equal ones the earlier."""
        best = np.sort(self.best(self._fitness, self.first_size))
        self.positions, self._fitness = self.positions[best], self._fitness[best]

    def inside(self, positions: Floats, name: str) -> Floats:
        """Check positions of a dumped state."""
        if (positions < self.space.low).any() or (positions > self.space.high).any():
            raise ValueError(f"{name}: outside the bounds of this job")
        return positions

    def checked(self, fitness: Floats, asked: int) -> Floats:
        """Check the feedback."""
        return checked_fitness(fitness, asked)

    def best(self, fitness: Floats, count: int) -> NDArray[np.intp]:
        """Return the indices of the best start positions."""
        return np.argsort(fitness, kind="stable")[:count]

    def written(self, fitness: Floats) -> list[Any]:
        """Convert feedback to JSON."""
        return worth(fitness)

    def read(self, values: list[Any]) -> Floats:
        """Convert feedback from JSON."""
        return of_worth(values)

    @abstractmethod
    def propose(self) -> Floats:
        """Return the next generation, of any size >= 1.

        It may depend on settings, space, budget, seed, `generations` and the memory.
        """

    @abstractmethod
    def learn(self, positions: Floats, fitness: Floats) -> None:
        """Learn from a whole generation."""

    @abstractmethod
    def memory(self) -> dict[str, Any]:
        """Return the additional fields of the state, JSON-compatible."""

    @abstractmethod
    def recall(self, state: G) -> None:
        """Check and restore the additional fields of a state."""


def worth(fitness: Floats | list[float]) -> Worth:
    """Convert fitness values to JSON."""
    return [f if math.isfinite(f) else None for f in map(float, fitness)]


def of_worth(values: Worth) -> Floats:
    """Convert fitness values from JSON."""
    return np.array([math.inf if f is None else f for f in values], dtype=np.float64)
