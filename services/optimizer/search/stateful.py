"""Searches whose state is a model: what they know between ask and tell, dumped as JSON."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Annotated, Any, ClassVar, Final, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BaseModel,
    ConfigDict,
    NonNegativeInt,
    PlainSerializer,
    PlainValidator,
    ValidationError,
    ValidationInfo,
)

from gaitswarm.services.optimizer.search.optimizer import (
    SearchSettings,
    checked_fitness,
    checked_start,
)
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.input import message_of


def _numbers(value: Any) -> Floats:
    """Convert nested lists of a dumped state to an array."""
    if isinstance(value, np.ndarray):
        return value
    try:
        numbers = np.array(value)
    except ValueError:
        raise ValueError("rows of one length were expected") from None
    if not isinstance(value, list) or (numbers.size and numbers.dtype.kind not in "fi"):
        raise ValueError("must be a list of numbers")
    if np.isnan(numbers).any():
        raise ValueError("must be numbers")
    return numbers.astype(np.float64)


def _points(value: Any, info: ValidationInfo) -> Floats:
    points, space = _numbers(value), info.context
    if not isinstance(space, Space):
        return points
    if not len(points):
        return np.empty((0, space.dimension))
    if points.shape[1:] != (space.dimension,):
        raise ValueError(f"expected rows of {space.dimension} numbers")
    if (points < space.low).any() or (points > space.high).any():
        raise ValueError("outside the bounds of this job")
    return points


def _infinities(value: Any) -> Any:
    """Replace null by +inf, which JSON does not have."""
    if isinstance(value, list):
        return [_infinities(item) for item in value]
    return math.inf if value is None else value


def _nulls(value: Any) -> Any:
    if isinstance(value, list):
        return [_nulls(item) for item in value]
    return value if math.isfinite(value) else None


Numbers = Annotated[Floats, PlainValidator(_numbers), PlainSerializer(np.ndarray.tolist)]
"""An array of any shape."""

Points = Annotated[Floats, PlainValidator(_points), PlainSerializer(np.ndarray.tolist)]
"""(n, d) positions, inside the bounds."""

Fitness = Annotated[
    Floats,
    PlainValidator(lambda value: _numbers(_infinities(value))),
    PlainSerializer(lambda array: _nulls(array.tolist())),
]
"""(n,) fitness values or (n, M) objective vectors; null stands for +inf."""


class SearchState(BaseModel):
    """State of a search; asked: number of positions that wait for their fitness."""

    model_config = ConfigDict(extra="forbid", strict=True, defer_build=True)

    optimizer: str
    schema_version: int
    iteration: NonNegativeInt
    asked: NonNegativeInt


T = TypeVar("T", bound=SearchState)


class Stateful(ABC, Generic[T]):
    """An `Optimizer` that asks for proposed positions, whole or in pieces.

    Subclasses define what is proposed and what is learned; all that they know is in `state`.
    """

    space: Space | None = None

    def __init__(self, particles: int, state: T) -> None:
        self.state = state
        self._particles: Final = particles

    @property
    def iteration(self) -> int:
        return self.state.iteration

    def ask(self, most: int | None = None) -> Floats:
        waiting = self._waiting()
        if not self.state.asked:
            limit = self._particles if most is None else min(most, self._particles)
            self.state.asked = min(limit, len(waiting))
        return waiting[: self.state.asked].copy()

    def tell(self, fitness: Floats) -> None:
        values = self._checked(fitness)
        self.state.iteration += 1
        self.state.asked = 0
        self._answer(values)

    def dump(self) -> dict[str, Any]:
        return self.state.model_dump()

    def load(self, state: dict[str, Any]) -> None:
        name = self.state.optimizer
        try:
            dumped = type(self.state).model_validate(state, context=self.space)
        except ValidationError as error:
            first = error.errors(include_url=False, include_input=False)[0]
            field = ".".join(str(part) for part in first["loc"])
            raise ValueError(f"not a state of {name}: {field}: {message_of(first)}") from error
        for field in ("optimizer", "schema_version"):
            if getattr(dumped, field) != getattr(self.state, field):
                raise ValueError(f"not a state of {name}: {field}: {getattr(dumped, field)}")
        self._check(dumped)
        if dumped.asked > self._particles:
            raise ValueError(f"asked: {dumped.asked} positions, more than {name} asks for")
        self.state = dumped

    def _checked(self, fitness: Floats) -> Floats:
        return checked_fitness(fitness, self.state.asked)

    def _check(self, state: T) -> None:
        """Check whether a valid state fits the settings. Raises ValueError."""

    @abstractmethod
    def _waiting(self) -> Floats:
        """Return the positions without fitness, first those that were asked for; propose more."""

    @abstractmethod
    def _answer(self, fitness: Floats) -> None:
        """Receive the fitness of the first positions that wait."""


class CountedState(SearchState):
    """A state with the number of positions evaluated so far."""

    evaluations: NonNegativeInt


class GenerationState(CountedState):
    """State of a `Generational` search; a method adds its memory.

    positions: the current generation, empty before the first; fitness: of its first positions.
    """

    generations: NonNegativeInt
    positions: Points
    fitness: Fitness


S = TypeVar("S", bound=SearchSettings)
G = TypeVar("G", bound=GenerationState)


class Generational(Stateful[G], Generic[S, G]):
    """A search that learns from whole generations.

    Random numbers are indexed by generation, so that they do not depend on the pieces.

    Start positions replace the first members of the first generation. If there are more start
    positions than members, all are evaluated, and the best become the generation.

    In the methods `positions` is (n, d), `fitness` is (n,) and `count` is a number of positions.
    """

    space: Space
    state_model: ClassVar[type[Any]]
    schema_version: ClassVar[int] = 1

    def __init__(self, settings: S, space: Space, budget: int, seed: int) -> None:
        self.settings: Final = settings
        self.space = space
        self.budget: Final = budget
        self.seed: Final = seed
        self._start: Floats = np.empty((0, space.dimension))
        state = self.state_model.model_construct(
            optimizer=settings.name,
            schema_version=self.schema_version,
            iteration=0,
            asked=0,
            evaluations=0,
            generations=0,
            positions=np.empty((0, space.dimension)),
            fitness=np.empty(0),
        )
        super().__init__(settings.particles, state)
        self.begin()

    @property
    def evaluations(self) -> int:
        return self.state.evaluations

    @property
    def first_size(self) -> int:
        """Size of the first generation if there are more start positions."""
        return self.settings.particles

    def start_from(self, positions: Floats) -> None:
        begun = bool(self.evaluations or len(self.state.positions))
        self._start = checked_start(positions, self.space, begun=begun)

    def _waiting(self) -> Floats:
        state = self.state
        if len(state.fitness) == len(state.positions):
            proposed = self.propose()
            if not state.generations:
                proposed = np.vstack([self._start, proposed[len(self._start) :]])
            state.positions, state.fitness = proposed, np.empty(0)
        return state.positions[len(state.fitness) :]

    def _answer(self, fitness: Floats) -> None:
        state = self.state
        known = state.fitness
        state.fitness = np.concatenate([known, fitness]) if len(known) else fitness
        state.evaluations += len(fitness)
        if len(state.fitness) == len(state.positions):
            if not state.generations and len(self._start) > self.first_size:
                best = np.sort(self.best(state.fitness, self.first_size))
                state.positions, state.fitness = state.positions[best], state.fitness[best]
            self.learn(state.positions, state.fitness)
            state.generations += 1

    def _check(self, state: G) -> None:
        if len(state.fitness) + state.asked > len(state.positions):
            raise ValueError("asked: more than the remaining positions")

    def best(self, fitness: Floats, count: int) -> NDArray[np.intp]:
        """Return the indices of the best start positions; of equal ones the earlier."""
        return np.argsort(fitness, kind="stable")[:count]

    @abstractmethod
    def begin(self) -> None:
        """Set the memory to that of a search that knows nothing."""

    @abstractmethod
    def propose(self) -> Floats:
        """Return the next generation, of any size >= 1.

        It may depend on settings, space, budget, seed, `generations` and the memory.
        """

    @abstractmethod
    def learn(self, positions: Floats, fitness: Floats) -> None:
        """Learn from a whole generation."""
