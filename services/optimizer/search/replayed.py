"""Methods written as generators, whose state is what they were told."""

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
"""Yields positions (n, d) inside the bounds, n >= 1; is sent their fitness (n,). Never ends."""

S = TypeVar("S", bound=SearchSettings)

Search = Callable[[S, Space, int, RandomNumbers], Proposals]
"""A method: (settings, space, budget [evaluations], random numbers) -> proposals.

It draws on nothing else, so that what it was told makes it the same again. A method that makes use
of start positions has a fifth argument `start`, of type `Start | None`, None by default.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Positions that were evaluated before a method begins.

    Attributes:
        positions: (k, d), inside the bounds, k >= 1.
        fitness: (k,) of each, +inf for a failed evaluation.
    """

    positions: Floats
    fitness: Floats

    @property
    def best_first(self) -> tuple[Floats, Floats]:
        """Positions and fitness of those that did not fail, the best first."""
        order = np.argsort(self.fitness, kind="stable")
        order = order[np.isfinite(self.fitness[order])]
        return self.positions[order], self.fitness[order]


_SEARCH: Final = 3
"""Purpose of random streams: never renumbered, or stored jobs would change their future."""

_KEPT: Final = 32
"""Searches under way that a process keeps, so that going on does not replay them."""


class _ToldState(BaseModel):
    """What `dump` writes."""

    model_config = ConfigDict(extra="forbid", strict=True)

    optimizer: str
    schema_version: Literal[1]
    iteration: NonNegativeInt
    asked: NonNegativeInt
    budget: PositiveInt
    told: Worth


@dataclass(slots=True)
class _Course:
    """A generator with what it proposes now, and what of that was told."""

    proposals: Proposals
    positions: Floats
    fitness: list[float]

    def tell(self, values: Floats) -> None:
        """Take values; when the proposal is told as a whole, move on to the next one."""
        for value in values.tolist():
            self.fitness.append(value)
            if len(self.fitness) == len(self.positions):
                self.positions = _proposal(self.proposals.send(np.array(self.fitness)))
                self.fitness = []


class Replayed:
    """An optimizer over a generator. Loading a state tells the generator all of it again.

    A method that plans by its budget keeps the plan that it began with, also in a job that is
    extended: what it was told belongs to what that plan proposed.

    A process keeps the generators of the searches that it has under way, and takes one up again
    where the state to load is where it stands; the path is the same either way.
    """

    def __init__(
        self, search: Search[S], settings: S, space: Space, budget: int, seed: int
    ) -> None:
        """Create a search that has not been asked yet."""

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
        self._iteration = 0
        self._asked = 0
        self._told: list[float] = []
        self._course: _Course | None = None

    @property
    def iteration(self) -> int:
        """Number of completed tells."""
        return self._iteration

    @property
    def evaluations(self) -> int:
        """Number of positions that were told, in all."""
        return len(self._told)

    def start_from(self, positions: Floats) -> None:
        """Ask for these before the method begins."""
        begun = bool(self._told or self._asked)
        self._start = checked_start(positions, self._space, begun=begun)
        self._course = None

    def ask(self, most: int | None = None) -> Floats:
        """Give the positions to evaluate next; the same ones again until they are told."""
        course = self._under_way()
        told = len(course.fitness)
        if not self._asked:
            limit = self._settings.particles
            limit = limit if most is None else min(most, limit)
            self._asked = min(limit, len(course.positions) - told)
        return course.positions[told : told + self._asked].copy()

    def tell(self, fitness: Floats) -> None:
        """Take what the positions last asked for are worth."""
        values = checked_fitness(fitness, self._asked)
        self._under_way().tell(values)
        self._told.extend(values.tolist())
        self._iteration += 1
        self._asked = 0

    def dump(self) -> dict[str, Any]:
        """Give the whole state."""
        if self._course is not None:
            _UNDER_WAY.keep(self._key(), self._course)
            self._course = None
        return {
            "optimizer": self._settings.name,
            "schema_version": 1,
            "iteration": self._iteration,
            "asked": self._asked,
            "budget": self._budget,
            "told": worth(self._told),
        }

    def load(self, state: dict[str, Any]) -> None:
        """Take on a state."""
        name = self._settings.name
        dumped = parse_state(state, name, _ToldState)
        if dumped.optimizer != name:
            raise ValueError(f"not a state of {name}: optimizer: {dumped.optimizer}")
        if dumped.asked > self._settings.particles:
            raise ValueError(f"asked: {dumped.asked} positions, more than {name} gives")
        self._course = None
        self._iteration, self._asked = dumped.iteration, dumped.asked
        self._budget, self._told = dumped.budget, of_worth(dumped.told).tolist()

    def _under_way(self) -> _Course:
        if self._course is None:
            self._course = _UNDER_WAY.take(self._key()) or self._replay()
        return self._course

    def _replay(self) -> _Course:
        proposals = self._begin(self._budget, self._start)
        course = _Course(proposals, _proposal(next(proposals)), [])
        course.tell(np.array(self._told))
        return course

    def _key(self) -> bytes:
        place = f"{self._place} {self._budget} {len(self._start)}".encode()
        told = np.array(self._told).tobytes()
        return blake2b(place + self._start.tobytes() + told, digest_size=16).digest()


class _UnderWay:
    """Courses by what they are of and were told; the least recently kept ones are dropped."""

    def __init__(self) -> None:
        self._courses: OrderedDict[bytes, _Course] = OrderedDict()
        self._lock = threading.Lock()

    def keep(self, key: bytes, course: _Course) -> None:
        with self._lock:
            self._courses[key] = course
            self._courses.move_to_end(key)
            while len(self._courses) > _KEPT:
                self._courses.popitem(last=False)

    def take(self, key: bytes) -> _Course | None:
        """Each course has one user: whoever takes it, has it alone."""
        with self._lock:
            return self._courses.pop(key, None)


_UNDER_WAY: Final = _UnderWay()


def uses_start(search: Callable[..., Proposals]) -> bool:
    """Whether a method makes use of start positions, or goes on as if there had been none."""
    return "start" in inspect.signature(search).parameters


def _after(
    start: Floats,
    search: Callable[..., Proposals],
    settings: SearchSettings,
    space: Space,
    budget: int,
    random: RandomNumbers,
) -> Proposals:
    """Start positions, and then the method."""
    fitness = yield start
    left = max(budget - len(start), 1)
    known = {"start": Start(start, fitness)} if uses_start(search) else {}
    yield from search(settings, space, left, random, **known)


def _proposal(positions: Floats) -> Floats:
    if positions.ndim != 2 or not len(positions):
        raise ValueError(f"a search proposed positions of shape {positions.shape}")
    return positions
