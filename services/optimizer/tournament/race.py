"""One run of a search method on a problem: how it converges."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.space import Space

Floats = NDArray[np.float64]

Evaluate = Callable[[Floats], Floats]
"""(n, d) positions -> (n,) fitness, minimized, +inf for a failed evaluation."""

Search = Callable[[Space, int, int, Evaluate], None]
"""(space, budget, seed, evaluate): searches until `evaluate` raises."""

Stop = Callable[[], bool]

_CHECKPOINTS_PER_DECADE: Final = (10, 13, 16, 20, 25, 32, 40, 50, 63, 80)
"""Preferred numbers of ISO 3, rounded."""


class Problem(Protocol):
    """What methods are compared on."""

    @property
    def space(self) -> Space:
        """The box that is searched."""

    def fitness(self, designs: Floats, *, seed: int, first: int) -> Floats:
        """Judge designs, as the search sees them."""

    def final(self, designs: Floats, fitness: Floats) -> Floats:
        """Judge what a search found, as it is reported."""


@dataclass(frozen=True, slots=True)
class Terms:
    """What a run is given, and when one looks at it.

    Attributes:
        evaluations: Budget.
        checkpoints: (m,) evaluations, ascending, after which the best so far is noted.
        target: Fitness that counts as solved; None if there is none.
        stops_at_target: Whether a run ends when it has reached the target.
    """

    evaluations: int
    checkpoints: tuple[int, ...]
    target: float | None = None
    stops_at_target: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """What a run came to.

    Attributes:
        best: (m,) least fitness after each checkpoint, NaN while every evaluation failed. A run
            that has ended keeps its best.
        to_best: Evaluations until the best design of all was judged; NaN without one.
        to_target: Evaluations until the target was reached; NaN if it was not.
    """

    best: Floats
    to_best: float
    to_target: float


class RunAbandoned(Exception):
    """Nobody waits for a run any more."""


class _Ended(Exception):
    """The budget is spent, or the target reached."""


def default_checkpoints(evaluations: int) -> tuple[int, ...]:
    """Evaluations at which runs are looked at: ten in each decade from 10 on, and the last."""
    found: list[int] = []
    decade = 1
    while decade * 10 < evaluations:
        found += [decade * number for number in _CHECKPOINTS_PER_DECADE]
        decade *= 10
    return (*(number for number in found if number < evaluations), evaluations)


def race(
    search: Search, problem: Problem, terms: Terms, seed: int, should_stop: Stop = lambda: False
) -> Run:
    """Run a method once."""
    record = _Record(problem, terms, seed, should_stop)
    with suppress(_Ended):
        search(problem.space, terms.evaluations, seed, record.evaluate)
    return record.run()


class _Record:
    """Judges what a search asks for, and notes every improvement."""

    def __init__(self, problem: Problem, terms: Terms, seed: int, should_stop: Stop) -> None:
        self._problem = problem
        self._terms = terms
        self._seed = seed
        self._should_stop = should_stop
        self._done = 0
        self._to_target = math.nan
        # Evaluations, fitness and design of each improvement.
        self._improved: list[tuple[int, float, Floats]] = []

    def evaluate(self, positions: Floats) -> Floats:
        if self._should_stop():
            raise RunAbandoned
        left = self._terms.evaluations - self._done
        designs = self._problem.space.designs(positions[:left])
        fitness = self._problem.fitness(designs, seed=self._seed, first=self._done)
        for design, value in zip(designs, fitness.tolist(), strict=True):
            self._note(design, value)
        reached = not math.isnan(self._to_target)
        if len(positions) >= left or (reached and self._terms.stops_at_target):
            raise _Ended
        return fitness

    def _note(self, design: Floats, value: float) -> None:
        self._done += 1
        if value < (self._improved[-1][1] if self._improved else math.inf):
            self._improved.append((self._done, value, design))
        target = self._terms.target
        if target is not None and value <= target and math.isnan(self._to_target):
            self._to_target = float(self._done)

    def run(self) -> Run:
        # Which improvement was the last one at each checkpoint.
        at = [sum(done <= c for done, *_ in self._improved) - 1 for c in self._terms.checkpoints]
        shown = sorted(set(at) - {-1})
        curve = np.full(len(at), np.nan)
        if shown:
            designs = np.array([self._improved[k][2] for k in shown])
            searched = np.array([self._improved[k][1] for k in shown])
            final = dict(zip(shown, self._problem.final(designs, searched).tolist(), strict=True))
            curve = np.array([final.get(k, math.nan) for k in at])
        to_best = float(self._improved[-1][0]) if self._improved else math.nan
        return Run(np.where(np.isfinite(curve), curve, np.nan), to_best, self._to_target)
