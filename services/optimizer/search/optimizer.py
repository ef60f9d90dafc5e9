"""Search methods: ask, tell, dump and load; methods that learn from generations; generators."""

from __future__ import annotations

import inspect
import json
import math
import threading
from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from typing import (
    Annotated,
    Any,
    ClassVar,
    Final,
    Generic,
    NamedTuple,
    Protocol,
    TypeVar,
    runtime_checkable,
)

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    NonNegativeInt,
    PlainSerializer,
    PlainValidator,
    PositiveInt,
    ValidationError,
    ValidationInfo,
)

from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.input import Data, message_of


class SearchSettings(Data):
    """Settings that every method has."""

    name: str
    particles: int = Field(default=25, ge=1, le=10_000)
    """Designs of one iteration, at most."""


class Optimizer(Protocol):
    """A batch optimizer over a box, independent of storage, simulation and processes.

    call    state before    state after     returns
    ask()   idle at k       asked at k      positions (n, d), 1 <= n <= particles
    ask()   asked at k      asked at k      the same positions again
    tell(f) asked at k      idle at k + 1   -
    dump()  any             unchanged       JSON-compatible state, exact to the bit

    `start_from`, if it is called at all, precedes all other calls.

    An optimizer is a function of its settings, space, budget, seed, start and feedback: equal
    states have equal futures. Its path does not depend on the sizes of the asks: positions that are
    asked for in pieces are learned from when they are complete. It never ends by itself; a method
    that has converged restarts elsewhere. A fitness of +inf (a failed evaluation) never becomes a
    best.
    """

    @property
    def iteration(self) -> int:
        """Number of completed tells."""

    @property
    def evaluations(self) -> int:
        """Number of positions evaluated so far."""

    def start_from(self, positions: Floats) -> None:
        """Begin with known good positions: they are the first that are asked for.

        Args:
            positions: (k, d), in the variables' own units; k = 0 changes nothing.

        Raises:
            ValueError: A position is outside the bounds or has another dimension, or positions have
                already been asked for.
        """

    def ask(self, most: int | None = None) -> Floats:
        """Return the positions to evaluate next; the same ones until their fitness is known.

        Args:
            most: Largest number of positions, >= 1; positions already asked for stay. Default and
                upper limit: the settings' `particles`.

        Returns:
            (n, d), inside the bounds, in the variables' own units.
        """

    def tell(self, fitness: Floats) -> None:
        """Receive the fitness of the positions that were asked for last.

        Args:
            fitness: (n,), minimized; +inf for a failed evaluation. A multi-objective method (see
                `Method`) receives (n, M) objective vectors, each number minimized; a vector with
                any +inf belongs to a failed evaluation.

        Raises:
            ValueError: Nothing was asked for, the shape differs, or a value is NaN or -inf.
        """

    def dump(self) -> dict[str, Any]:
        """Return the complete state.

        Returns:
            JSON-compatible values with a schema version, from which `load` restores the future.
        """

    def load(self, state: dict[str, Any]) -> None:
        """Restore a state.

        Args:
            state: Result of `dump` for the same settings, space, budget, seed and start.

        Raises:
            ValueError: The state is of another method, version or shape, or outside the bounds; the
                previous state is kept.
        """


@runtime_checkable
class Rejudging(Optimizer, Protocol):
    """A method that can rebuild its memory from another fitness of the same positions.

    It keeps its current positions and continues by the other fitness.
    """

    def rejudge(self, generations: Sequence[tuple[Floats, Floats]]) -> None:
        """Replace the fitness of all positions evaluated so far.

        generations: (n, d) positions and (n,) fitness, +inf for a failed evaluation, of all
        evaluations, in order. Raises ValueError if some are missing or a generation is incomplete.
        """


def stored_state(search: Optimizer) -> dict[str, Any]:
    """Return the dump as the store will return it; raise at once if JSON cannot represent it."""
    stored: dict[str, Any] = json.loads(json.dumps(search.dump(), allow_nan=False))
    return stored


def checked_fitness(fitness: Floats, asked: int, objectives: int | None = None) -> Floats:
    """Return a copy of the argument of `Optimizer.tell`; raises ValueError.

    asked: number of positions asked for last; objectives: length of an objective vector.
    """
    if not asked:
        raise ValueError("tell() before ask(): no positions are waiting for a fitness")
    shape = (asked,) if objectives is None else (asked, objectives)
    if fitness.shape != shape:
        raise ValueError(
            f"fitness has shape {fitness.shape}, not {shape}; {asked} positions were asked for"
        )
    if np.isnan(fitness).any() or np.isneginf(fitness).any():
        raise ValueError("fitness must be finite, or +inf for a failed evaluation")
    return np.array(fitness, dtype=np.float64)


def checked_start(positions: Floats, space: Space, *, begun: bool) -> Floats:
    """Return a copy of the argument of `Optimizer.start_from`; raises ValueError."""
    if begun:
        raise ValueError("start_from() after ask(): the search has already begun")
    if positions.ndim != 2 or positions.shape[1] != space.dimension:
        raise ValueError(f"start: shape {positions.shape}, not (k, {space.dimension})")
    if not ((positions >= space.low) & (positions <= space.high)).all():
        raise ValueError("start: outside the bounds of this job")
    return np.array(positions, dtype=np.float64)


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


Numbers = Annotated[Floats, PlainValidator(_numbers), PlainSerializer(np.ndarray.tolist)]
"""An array of any shape."""

Points = Annotated[Floats, PlainValidator(_points), PlainSerializer(np.ndarray.tolist)]
"""(n, d) positions, inside the bounds."""

Fitness = Annotated[
    Floats,
    PlainValidator(lambda value: _numbers(_infinities(value))),
    PlainSerializer(lambda array: np.where(np.isfinite(array), array, None).tolist()),
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


Proposals = Generator[Floats, Floats, None]
"""Yields positions (n, d) inside the bounds, n >= 1; receives their fitness (n,). Never ends."""

Search = Callable[[S, Space, int, RandomNumbers], Proposals]
"""(settings, space, budget [evaluations], random numbers) -> proposals.

A method uses no other input, so that the same feedback reproduces it. A method that uses start
positions has a fifth parameter `start` of type `Start | None`, None by default.
"""


class Start(NamedTuple):
    """Positions evaluated before a method begins.

    Attributes:
        positions: (k, d), inside the bounds, k >= 1.
        fitness: (k,), +inf for a failed evaluation.
    """

    positions: Floats
    fitness: Floats

    @property
    def best_first(self) -> tuple[Floats, Floats]:
        """Positions and fitness of the successful evaluations, the best first."""
        order = np.argsort(self.fitness, kind="stable")
        order = order[np.isfinite(self.fitness[order])]
        return self.positions[order], self.fitness[order]


_SEARCH: Final = 3
"""Purpose of random streams: never renumbered, or stored jobs would change their future."""

_CACHED: Final = 32
"""Running searches that a process caches, so that continuing does not replay them."""


class _FeedbackState(SearchState):
    """State of a replayed search: the feedback on all proposals."""

    budget: PositiveInt
    told: Fitness  # codespell:ignore told


@dataclass(slots=True)
class _Course:
    """A generator with its current proposal and the feedback on it."""

    proposals: Proposals
    positions: Floats
    fitness: list[float]

    def tell(self, values: Floats) -> None:
        """Add feedback; when the proposal is complete, continue with the next one."""
        for value in values.tolist():
            self.fitness.append(value)
            if len(self.fitness) == len(self.positions):
                self.positions = _proposal(self.proposals.send(np.array(self.fitness)))
                self.fitness = []


class Replayed(Stateful[_FeedbackState]):
    """An optimizer over a generator. Loading a state replays the feedback.

    The budget of the first run stays part of the state, also in a job that is extended, because
    the feedback belongs to the proposals that this budget led to.

    A process caches the generators of its running searches, and continues one whose feedback equals
    that of the state to load; the path is the same either way.
    """

    def __init__(
        self, search: Search[S], settings: S, space: Space, budget: int, seed: int
    ) -> None:
        state = _FeedbackState(
            optimizer=settings.name,
            schema_version=1,
            iteration=0,
            asked=0,
            budget=budget,
            told=np.empty(0),  # codespell:ignore told
        )
        super().__init__(settings.particles, state)
        self._search: Final[Search[S]] = search
        self._settings: Final = settings
        self.space: Space = space
        self._seed: Final = seed
        self._start = np.empty((0, space.dimension))
        self._course: _Course | None = None

    @property
    def evaluations(self) -> int:
        return len(self._feedback)

    @property
    def _feedback(self) -> Floats:
        return self.state.told  # codespell:ignore told

    def start_from(self, positions: Floats) -> None:
        """Evaluate positions before the method begins."""
        begun = bool(len(self._feedback) or self.state.asked)
        self._start = checked_start(positions, self.space, begun=begun)
        self._course = None

    def dump(self) -> dict[str, Any]:
        if self._course is not None:
            with _LOCK:
                _COURSES[self._key()] = self._course
                if len(_COURSES) > _CACHED:
                    _COURSES.popitem(last=False)
            self._course = None
        return super().dump()

    def load(self, state: dict[str, Any]) -> None:
        super().load(state)
        self._course = None

    def _waiting(self) -> Floats:
        course = self._running()
        return course.positions[len(course.fitness) :]

    def _answer(self, fitness: Floats) -> None:
        self._running().tell(fitness)
        feedback = np.concatenate([self._feedback, fitness])
        self.state.told = feedback  # codespell:ignore told

    def _running(self) -> _Course:
        if self._course is None:
            with _LOCK:
                # Removed, so that it has one user at a time.
                self._course = _COURSES.pop(self._key(), None)
        if self._course is None:
            proposals = self._proposals(self._start, self.state.budget)
            self._course = _Course(proposals, _proposal(next(proposals)), [])
            self._course.tell(self._feedback)
        return self._course

    def _proposals(self, start: Floats, budget: int) -> Proposals:
        """Evaluate the start positions, then run the method."""
        search: Callable[..., Proposals] = self._search
        options = {}
        if len(start):
            fitness, budget = (yield start), max(budget - len(start), 1)
            if "start" in inspect.signature(search).parameters:
                options["start"] = Start(start, fitness)
        random = RandomNumbers(self._seed, _SEARCH)
        yield from search(self._settings, self.space, budget, random, **options)

    def _key(self) -> bytes:
        name, axes = self._settings.model_dump_json(), self.space.axes
        place = repr((name, axes, self._seed, self.state.budget, len(self._start)))
        key = place.encode() + self._start.tobytes() + self._feedback.tobytes()
        return blake2b(key, digest_size=16).digest()


_COURSES: Final = OrderedDict[bytes, _Course]()
_LOCK: Final = threading.Lock()


def _proposal(positions: Floats) -> Floats:
    if positions.ndim != 2 or not len(positions):
        raise ValueError(f"a search proposed positions of shape {positions.shape}")
    return positions
