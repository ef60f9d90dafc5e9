"""Building blocks of local searches: unit positions, polls of discrete variables, memory.

A local search is a generator over unit positions: it yields an array (n, d), receives the fitness
(n,), and returns its last point. Methods are composed by `yield from`.

Variables are of two sorts. *Smooth* ones take steps of any size: continuous variables, and integers
with many values (at least one per step). *Polled* ones are categorical, or integers with few
values: a local search holds them constant, and their neighbours are polled before and after it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.plugins import Proposals, RandomNumbers, Space, Start

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

FEW_VALUES: Final = 32
"""Integer variables with at most this number of values are polled."""

_RESUMED: Final = 0.25
"""Scale of the first steps of a local search that is resumed after a poll."""

_PATIENCE: Final = 16
"""Proposals in a row without a new design before one is evaluated again; halved each time until
there is a new one."""


@dataclass(frozen=True, slots=True)
class Point:
    """An evaluated position.

    Attributes:
        unit: (d,) unit position.
        fitness: minimized; +inf for a failed evaluation.
    """

    unit: Floats
    fitness: float


Walk = Generator[Floats, Floats, Point]
"""Yields unit positions (n, d), receives their fitness (n,), returns the last point."""

Endless = Generator[Floats, Floats, None]
"""The same, without end."""

LocalSearch = Callable[[Point, float], Walk]
"""(start, scale of the first steps) -> a search over the smooth variables."""


class Axes:
    """Step rules of the variables of a space.

    Attributes:
        smooth: (m,) indices of smooth variables.
        polled: (d - m,) indices of polled variables.
        least: (d,) smallest step [unit] that may change a design: one for an integer, else 0.
    """

    def __init__(self, space: Space) -> None:
        few = space.categorical | (space.integer & (space.span < FEW_VALUES))
        self.space: Final = space
        self.smooth: Final[Indices] = np.flatnonzero(~few)
        self.polled: Final[Indices] = np.flatnonzero(few)
        self.least: Final[Floats] = np.where(space.integer, 1.0 / space.span, 0.0)

    def design(self, unit: Floats) -> Floats:
        """Return the design at a unit position."""
        design: Floats = self.space.designs(self.space.from_unit(unit[None]))[0]
        return design

    def neighbours(self, unit: Floats) -> Floats:
        """Return unit positions with one polled variable changed (an integer by one)."""
        here = self.design(unit)
        positions = []
        for j in self.polled.tolist():
            if self.space.categorical[j]:
                values = [v for v in range(int(self.space.high[j]) + 1) if v != here[j]]
            else:
                inside = self.space.low[j], self.space.high[j]
                values = [v for v in (here[j] - 1, here[j] + 1) if inside[0] <= v <= inside[1]]
            for value in values:
                design = here.copy()
                design[j] = value
                there = unit.copy()
                there[j] = self.space.to_unit(self.space.positions(design[None]))[0, j]
                positions.append(there)
        return np.array(positions, dtype=np.float64).reshape(-1, self.space.dimension)

    def random(self, random: RandomNumbers, count: int) -> Floats:
        """Draw unit positions of designs that are uniform in the box."""
        unit = random.uniform(count, self.space.dimension)
        return self.space.to_unit(self.space.evenly(unit))


def gains(new: Point, old: Point, tolerance: float) -> bool:
    """Return whether a point is better than another one by more than a tolerance."""
    if not math.isfinite(old.fitness):
        return new.fitness < old.fitness
    return new.fitness < old.fitness - tolerance * abs(old.fitness)


def sampled(
    axes: Axes, random: RandomNumbers, count: int
) -> Generator[Floats, Floats, list[Point]]:
    """Evaluate random positions as one batch; best first."""
    unit = axes.random(random, count)
    fitness = yield unit
    order = np.argsort(fitness, kind="stable")
    return [Point(unit[k], float(fitness[k])) for k in order]


def judged(unit: Floats) -> Walk:
    """Evaluate one position, clipped to the box."""
    inside = np.clip(unit, 0.0, 1.0)
    fitness = yield inside[None]
    return Point(inside, float(fitness[0]))


def known_points(space: Space, start: Start | None) -> list[Point]:
    """Return the points that were evaluated before the search, best first."""
    if start is None:
        return []
    positions, fitness = start.best_first
    units = space.to_unit(positions)
    return [Point(unit, f) for unit, f in zip(units, fitness.tolist(), strict=True)]


def poll(start: Point, axes: Axes) -> Walk:
    """Move to the best neighbour in the polled variables while it is better."""
    here = start
    while True:
        near = axes.neighbours(here.unit)
        if not len(near):
            return here
        fitness = yield near
        best = int(np.argmin(fitness))
        if not fitness[best] < here.fitness:
            return here
        here = Point(near[best], float(fitness[best]))


def mixed(start: Point, axes: Axes, search: LocalSearch) -> Walk:
    """Alternate a local search over smooth variables and polls of the others."""
    here, scale = (yield from poll(start, axes)), 1.0
    if not len(axes.smooth):
        return here
    while True:
        minimum = yield from search(here, scale)
        here = yield from poll(minimum, axes)
        if here is minimum:
            return here
        scale = _RESUMED


def evaluated_once(space: Space, search: Endless, start: Start | None = None) -> Proposals:
    """Run a search in unit coordinates that evaluates no design twice.

    Repeated designs are answered from memory. When no new design is proposed for some time, as in a
    space of few designs, one is evaluated again, because a search never ends.
    """
    cached: dict[bytes, float] = {}
    if start is not None:
        # 0.0 and -0.0 are one value, but not the same bytes.
        designs = space.designs(start.positions) + 0.0
        cached = {k.tobytes(): f for k, f in zip(designs, start.fitness.tolist(), strict=True)}
    unit, idle, patience = next(search), 0, _PATIENCE
    while True:
        positions = space.from_unit(unit)
        keys = [row.tobytes() for row in space.designs(positions) + 0.0]
        new = {key: k for k, key in reversed(list(enumerate(keys))) if key not in cached}
        if new:
            idle, patience = 0, _PATIENCE
        elif idle >= patience:
            new, idle, patience = {keys[0]: 0}, 0, patience // 2
        else:
            idle += 1
        if new:
            rows = sorted(new.values())
            fitness = yield positions[rows]
            cached.update(zip([keys[k] for k in rows], fitness.tolist(), strict=True))
        unit = search.send(np.array([cached[key] for key in keys]))
