"""What local searches are made of: unit positions, polls of discrete variables, known designs.

A local search is a generator over unit positions: it yields (n, d) of them, is sent their fitness
(n,), and returns where it ended. So one method can run another with `yield from`.

Variables are of two sorts. *Smooth* ones are moved by steps of any size: continuous variables, and
integers of many values, which are never moved by less than one. *Polled* ones are categorical, or
integers of few values: a local search holds them, and polls their neighbours where it begins and
where it ends.
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
"""Integer variables of at most so many values are polled."""

_RESUMED: Final = 0.25
"""First steps of a local search that is resumed after a poll, as a share of its usual ones."""

_PATIENCE: Final = 16
"""Proposals in a row of which everything is known, until one is evaluated again. After that half as
many, and so on, until there is something new: a space of a few designs is soon known."""


@dataclass(frozen=True, slots=True)
class Point:
    """A position that was judged.

    Attributes:
        unit: (d,) its unit position.
        fitness: Minimized; +inf for a failed evaluation.
    """

    unit: Floats
    fitness: float


Walk = Generator[Floats, Floats, Point]
"""Yields unit positions (n, d); is sent their fitness (n,); returns where it ended."""

Endless = Generator[Floats, Floats, None]
"""The same, but it never ends."""

LocalSearch = Callable[[Point, float], Walk]
"""(start, scale of its first steps, 1 for the usual ones) -> a walk over smooth variables."""


class Axes:
    """How the variables of a space are moved.

    Attributes:
        space: The box.
        smooth: (m,) indices of variables that are moved by steps of any size.
        polled: (d - m,) indices of the others.
        least: (d,) least step that may change a design [unit]: one for an integer, else 0.
    """

    def __init__(self, space: Space) -> None:
        """Sort the variables."""
        few = space.categorical | (space.integer & (space.span < FEW_VALUES))
        self.space: Final = space
        self.smooth: Final[Indices] = np.flatnonzero(~few)
        self.polled: Final[Indices] = np.flatnonzero(few)
        self.least: Final[Floats] = np.where(space.integer, 1.0 / space.span, 0.0)

    def design(self, unit: Floats) -> Floats:
        """Give what is judged for a unit position."""
        design: Floats = self.space.designs(self.space.from_unit(unit[None]))[0]
        return design

    def neighbours(self, unit: Floats) -> Floats:
        """Unit positions that differ in one polled variable: an integer by one, or a choice."""
        here = self.design(unit)
        found = []
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
                found.append(there)
        return np.array(found, dtype=np.float64).reshape(-1, self.space.dimension)

    def random(self, random: RandomNumbers, count: int) -> Floats:
        """Draw unit positions of designs that are uniform in the box."""
        unit = random.uniform(count, self.space.dimension)
        return self.space.to_unit(self.space.evenly(unit))


def gains(new: Point, old: Point, tolerance: float) -> bool:
    """Tell whether a point is better than another one by more than a tolerance."""
    if not math.isfinite(old.fitness):
        return new.fitness < old.fitness
    return new.fitness < old.fitness - tolerance * abs(old.fitness)


def sampled(
    axes: Axes, random: RandomNumbers, count: int
) -> Generator[Floats, Floats, list[Point]]:
    """Judge random positions, as one batch."""
    unit = axes.random(random, count)
    fitness = yield unit
    order = np.argsort(fitness, kind="stable")
    return [Point(unit[k], float(fitness[k])) for k in order]


def judged(unit: Floats) -> Walk:
    """Judge one position, brought to the nearest face of the box."""
    inside = np.clip(unit, 0.0, 1.0)
    fitness = yield inside[None]
    return Point(inside, float(fitness[0]))


def known_points(space: Space, start: Start | None) -> list[Point]:
    """Give what was judged before a method began."""
    if start is None:
        return []
    positions, fitness = start.best_first
    units = space.to_unit(positions)
    return [Point(unit, f) for unit, f in zip(units, fitness.tolist(), strict=True)]


def poll(start: Point, axes: Axes) -> Walk:
    """Go to the best neighbour in the polled variables as long as it is better."""
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
    """Search smooth variables by a local search and the others by polls, in turn."""
    here, scale = (yield from poll(start, axes)), 1.0
    if not len(axes.smooth):
        return here
    while True:
        found = yield from search(here, scale)
        here = yield from poll(found, axes)
        if here is found:
            return here
        scale = _RESUMED


def evaluated_once(space: Space, search: Endless, start: Start | None = None) -> Proposals:
    """Run a search in unit coordinates, and ask for no design twice.

    A design that was judged is answered from memory. Where there is nothing new to ask for, as in a
    space of a few designs that are all known, one is asked for again from time to time: a method
    never ends.
    """
    known: dict[bytes, float] = {}
    if start is not None:
        # 0.0 and -0.0 are one value, but not the same bytes.
        designs = space.designs(start.positions) + 0.0
        known = {k.tobytes(): f for k, f in zip(designs, start.fitness.tolist(), strict=True)}
    unit, idle, patience = next(search), 0, _PATIENCE
    while True:
        positions = space.from_unit(unit)
        keys = [row.tobytes() for row in space.designs(positions) + 0.0]
        new = {key: k for k, key in reversed(list(enumerate(keys))) if key not in known}
        if new:
            idle, patience = 0, _PATIENCE
        elif idle >= patience:
            new, idle, patience = {keys[0]: 0}, 0, patience // 2
        else:
            idle += 1
        if new:
            asked = sorted(new.values())
            fitness = yield positions[asked]
            known.update(zip([keys[k] for k in asked], fitness.tolist(), strict=True))
        unit = search.send(np.array([known[key] for key in keys]))
