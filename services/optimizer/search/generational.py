"""The template of a method that learns from whole generations."""

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
    """What `Generational.dump` writes, to which a method adds its own memory.

    Attributes:
        optimizer: Name of the method.
        schema_version: Of the method's state.
        iteration: Completed tells.
        evaluations: Positions told, in all.
        generations: Generations that were learned from.
        positions: The generation under way, empty before the first.
        fitness: Of those of its positions that were told, in order.
        asked: How many of the next ones are asked for.
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
        settings: Of the method.
        space: The box that is searched.
        budget: Evaluations of the planned run.
        seed: Of all random numbers.
        generations: How many were learned from.
        positions: (n, d) the generation under way, (0, d) before the first.

    A method says what its first and next generation are and what it keeps of one; its random
    numbers are counted by generation, so that they do not depend on the pieces.

    Start positions take the places of the first members of the first generation. Where there are
    more of them than members, all are asked for, and the best are the generation.
    """

    state_model: ClassVar[type[GenerationState]]
    schema_version: ClassVar[int] = 1

    def __init__(self, settings: S, space: Space, budget: int, seed: int) -> None:
        """Create a search that has not been asked yet."""
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
        """Size of the first generation, where start positions are more than that."""
        return self.settings.particles

    @property
    def iteration(self) -> int:
        """Number of completed tells."""
        return self._iteration

    @property
    def evaluations(self) -> int:
        """Number of positions that were told, in all."""
        return self._evaluations

    def start_from(self, positions: Floats) -> None:
        """Put positions in the places of the first members."""
        begun = bool(self._evaluations or len(self.positions))
        self._start = checked_start(positions, self.space, begun=begun)

    def ask(self, most: int | None = None) -> Floats:
        """Give the positions to evaluate next; the same ones again until they are told."""
        told = len(self._fitness)
        if not self._asked:
            if told == len(self.positions):
                self.positions = self.propose() if self.generations else self._first()
                self._fitness, told = np.empty(0), 0
            limit = self.settings.particles if most is None else min(most, self.settings.particles)
            self._asked = min(limit, len(self.positions) - told)
        return self.positions[told : told + self._asked].copy()

    def tell(self, fitness: Floats) -> None:
        """Take what the positions last asked for are worth."""
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
        """Give the whole state."""
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
        """Take on a state."""
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
            raise ValueError("asked: more than what is left of the positions")
        fitness = self.read(dumped.fitness)
        self.recall(dumped)  # type: ignore[arg-type]
        self._iteration, self._evaluations = dumped.iteration, dumped.evaluations
        self.generations, self._asked = dumped.generations, dumped.asked
        self.positions, self._fitness = positions, fitness

    def _first(self) -> Floats:
        """The first generation with the start positions in it."""
        proposed = self.propose()
        return np.vstack([self._start, proposed[len(self._start) :]])

    def _keep_the_best(self) -> None:
        """Of more start positions than members; the earlier of equals, in their order."""
        kept = np.sort(self.best(self._fitness, self.first_size))
        self.positions, self._fitness = self.positions[kept], self._fitness[kept]

    def inside(self, positions: Floats, name: str) -> Floats:
        """Check positions of a dumped state."""
        if (positions < self.space.low).any() or (positions > self.space.high).any():
            raise ValueError(f"{name}: outside the bounds of this job")
        return positions

    def checked(self, fitness: Floats, asked: int) -> Floats:
        """Check what is told."""
        return checked_fitness(fitness, asked)

    def best(self, fitness: Floats, count: int) -> NDArray[np.intp]:
        """Choose the best of more start positions than there are members."""
        return np.argsort(fitness, kind="stable")[:count]

    def written(self, fitness: Floats) -> list[Any]:
        """Write what was told as JSON takes it."""
        return worth(fitness)

    def read(self, values: list[Any]) -> Floats:
        """Read back what `written` gave."""
        return of_worth(values)

    @abstractmethod
    def propose(self) -> Floats:
        """Make the next generation, of any size >= 1.

        It may depend on settings, space, budget, seed, `generations` and the method's memory.
        """

    @abstractmethod
    def learn(self, positions: Floats, fitness: Floats) -> None:
        """Take a whole generation into the method's memory."""

    @abstractmethod
    def memory(self) -> dict[str, Any]:
        """Give the method's own fields of its state, JSON-able."""

    @abstractmethod
    def recall(self, state: G) -> None:
        """Check and take on the method's own fields of a state."""


def worth(fitness: Floats | list[float]) -> Worth:
    """Write fitness values as JSON takes them."""
    return [f if math.isfinite(f) else None for f in map(float, fitness)]


def of_worth(values: Worth) -> Floats:
    """Read fitness values back."""
    return np.array([math.inf if f is None else f for f in values], dtype=np.float64)
