"""Methods written as generators, whose state is the feedback they received."""

from __future__ import annotations

import inspect
import threading
from collections import OrderedDict
from collections.abc import Callable, Generator
from dataclasses import dataclass
from hashlib import blake2b
from typing import Any, Final, TypeVar

import numpy as np
from pydantic import PositiveInt

from gaitswarm.services.optimizer.search.optimizer import SearchSettings, checked_start
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.services.optimizer.search.stateful import Fitness, SearchState, Stateful
from gaitswarm.sim.arrays import Floats

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
            _cache(self._key(), self._course)
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
            self._course = _cached(self._key()) or self._replay()
        return self._course

    def _replay(self) -> _Course:
        proposals = self._proposals(RandomNumbers(self._seed, _SEARCH))
        course = _Course(proposals, _proposal(next(proposals)), [])
        course.tell(self._feedback)
        return course

    def _proposals(self, random: RandomNumbers) -> Proposals:
        settings, space, start = self._settings, self.space, self._start
        search: Callable[..., Proposals] = self._search
        if not len(start):
            return search(settings, space, self.state.budget, random)
        return _after(start, search, settings, space, self.state.budget, random)

    def _key(self) -> bytes:
        name, axes = self._settings.model_dump_json(), self.space.axes
        place = repr((name, axes, self._seed, self.state.budget, len(self._start)))
        key = place.encode() + self._start.tobytes() + self._feedback.tobytes()
        return blake2b(key, digest_size=16).digest()


_COURSES: Final = OrderedDict[bytes, _Course]()
_LOCK: Final = threading.Lock()


def _cache(key: bytes, course: _Course) -> None:
    """Cache a course by search and feedback; drop the least recently cached ones."""
    with _LOCK:
        _COURSES[key] = course
        _COURSES.move_to_end(key)
        while len(_COURSES) > _CACHED:
            _COURSES.popitem(last=False)


def _cached(key: bytes) -> _Course | None:
    """Remove and return a course, so that it has one user at a time."""
    with _LOCK:
        return _COURSES.pop(key, None)


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
