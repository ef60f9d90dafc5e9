"""Methods written as generators, whose state is the feedback they received."""

from __future__ import annotations

import inspect
import threading
from collections import OrderedDict
from collections.abc import Callable, Generator
from dataclasses import dataclass
from hashlib import blake2b
from typing import Any, Final, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, NonNegativeInt, PositiveInt

from gaitswarm.services.optimizer.search.generational import Worth, of_worth, worth
from gaitswarm.services.optimizer.search.optimizer import (
    SearchSettings,
    checked_fitness,
    checked_start,
    parse_state,
)
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.space import Space

Floats = NDArray[np.float64]

Proposals = Generator[Floats, Floats, None]
"""Yields positions (n, d) inside the bounds, n >= 1; receives their fitness (n,). Never ends."""

S = TypeVar("S", bound=SearchSettings)

Search = Callable[[S, Space, int, RandomNumbers], Proposals]
"""(settings, space, budget [evaluations], random numbers) -> proposals.

A method uses no other input, so that the same feedback reproduces it. A method that uses start
positions has a fifth parameter `start` of type `Start | None`, None by default.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
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


class _FeedbackState(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)

    optimizer: str
    schema_version: Literal[1]
    iteration: NonNegativeInt
    asked: NonNegativeInt
    budget: PositiveInt
    told: Worth  # codespell:ignore told


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


class Replayed:
    """An optimizer over a generator. Loading a state replays the feedback.

    The budget of the first run stays part of the state, also in a job that is extended, because
    the feedback belongs to the proposals that this budget led to.

    A process caches the generators of its running searches, and continues one whose feedback equals
    that of the state to load; the path is the same either way.
    """

    def __init__(
        self, search: Search[S], settings: S, space: Space, budget: int, seed: int
    ) -> None:
        """Create a search before its first ask."""

        def begin(budget: int, start: Floats) -> Proposals:
            random = RandomNumbers(seed, _SEARCH)
            if len(start):
                return _after(start, search, settings, space, budget, random)
            return search(settings, space, budget, random)

        self._begin: Final[Callable[[int, Floats], Proposals]] = begin
        self._settings: Final = settings
        self._space: Final = space
        self._place: Final = repr((settings.model_dump_json(), space.axes, seed))
        self._start = np.empty((0, space.dimension))
        self._budget = budget
        self.iteration = 0
        self._asked = 0
        self._feedback: list[float] = []
        self._course: _Course | None = None

    @property
    def evaluations(self) -> int:
        """Number of positions evaluated so far."""
        return len(self._feedback)

    def start_from(self, positions: Floats) -> None:
        """Evaluate positions before the method begins."""
        begun = bool(self._feedback or self._asked)
        self._start = checked_start(positions, self._space, begun=begun)
        self._course = None

    def ask(self, most: int | None = None) -> Floats:
        """Return the positions to evaluate next; the same ones until their fitness is known."""
        course = self._running()
        done = len(course.fitness)
        if not self._asked:
            limit = self._settings.particles
            limit = limit if most is None else min(most, limit)
            self._asked = min(limit, len(course.positions) - done)
        return course.positions[done : done + self._asked].copy()

    def tell(self, fitness: Floats) -> None:
        """Receive the fitness of the positions asked for last."""
        values = checked_fitness(fitness, self._asked)
        self._running().tell(values)
        self._feedback.extend(values.tolist())
        self.iteration += 1
        self._asked = 0

    def dump(self) -> dict[str, Any]:
        """Return the complete state."""
        if self._course is not None:
            _COURSES.put(self._key(), self._course)
            self._course = None
        return {
            "optimizer": self._settings.name,
            "schema_version": 1,
            "iteration": self.iteration,
            "asked": self._asked,
            "budget": self._budget,
            "told": worth(self._feedback),  # codespell:ignore told
        }

    def load(self, state: dict[str, Any]) -> None:
        """Restore a state."""
        name = self._settings.name
        dumped = parse_state(state, name, _FeedbackState)
        if dumped.optimizer != name:
            raise ValueError(f"not a state of {name}: optimizer: {dumped.optimizer}")
        if dumped.asked > self._settings.particles:
            raise ValueError(f"asked: {dumped.asked} positions, more than {name} asks for at once")
        self._course = None
        self.iteration, self._asked = dumped.iteration, dumped.asked
        self._budget = dumped.budget
        self._feedback = of_worth(dumped.told).tolist()  # codespell:ignore told

    def _running(self) -> _Course:
        if self._course is None:
            self._course = _COURSES.take(self._key()) or self._replay()
        return self._course

    def _replay(self) -> _Course:
        proposals = self._begin(self._budget, self._start)
        course = _Course(proposals, _proposal(next(proposals)), [])
        course.tell(np.array(self._feedback))
        return course

    def _key(self) -> bytes:
        place = f"{self._place} {self._budget} {len(self._start)}".encode()
        feedback = np.array(self._feedback).tobytes()
        return blake2b(place + self._start.tobytes() + feedback, digest_size=16).digest()


class _CourseCache:
    """Courses by search and feedback; drops the least recently cached ones."""

    def __init__(self) -> None:
        self._courses: OrderedDict[bytes, _Course] = OrderedDict()
        self._lock = threading.Lock()

    def put(self, key: bytes, course: _Course) -> None:
        with self._lock:
            self._courses[key] = course
            self._courses.move_to_end(key)
            while len(self._courses) > _CACHED:
                self._courses.popitem(last=False)

    def take(self, key: bytes) -> _Course | None:
        """Remove and return a course, so that it has one user at a time."""
        with self._lock:
            return self._courses.pop(key, None)


_COURSES: Final = _CourseCache()


def _after(
    start: Floats,
    search: Callable[..., Proposals],
    settings: SearchSettings,
    space: Space,
    budget: int,
    random: RandomNumbers,
) -> Proposals:
    """Evaluate the start positions, then run the method."""
    fitness = yield start
    remaining = max(budget - len(start), 1)
    if "start" in inspect.signature(search).parameters:
        yield from search(settings, space, remaining, random, start=Start(start, fitness))
    else:
        yield from search(settings, space, remaining, random)


def _proposal(positions: Floats) -> Floats:
    if positions.ndim != 2 or not len(positions):
        raise ValueError(f"a search proposed positions of shape {positions.shape}")
    return positions
