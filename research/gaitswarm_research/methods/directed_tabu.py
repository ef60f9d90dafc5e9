"""Directed tabu search (Hedar and Fukushima 2006), with adaptive pattern search."""

from __future__ import annotations

import math
from collections.abc import Generator
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.plugins import Proposals, RandomNumbers, SearchSettings, Space, Start, from_generator
from gaitswarm_research.methods.local_search import (
    Axes,
    Endless,
    Point,
    Walk,
    evaluated_once,
    gains,
    known_points,
    mixed,
    sampled,
)
from gaitswarm_research.methods.nelder_mead import simplex_search

Floats = NDArray[np.float64]

_CANDIDATES: Final = 50
"""Random candidates for the start of the next exploration."""


class DirectedTabuSettings(SearchSettings):
    """Settings of directed tabu search."""

    name: Literal["dts"] = "dts"
    step: float = Field(
        default=0.2, gt=0, le=0.5, description="First step of an exploration, share of each range."
    )
    patience: int = Field(
        default=4,
        ge=1,
        le=1_000,
        description="Iterations in a row without a new best that end an exploration.",
    )
    tabu_list: int = Field(
        default=7, ge=1, le=1_000, description="Number of points whose neighbourhoods are tabu."
    )
    tabu_radius: float = Field(
        default=0.02, gt=0, le=0.5, description="Radius of a tabu region, as a share of each range."
    )
    semi_tabu_radius: float = Field(
        default=0.1,
        gt=0,
        le=1,
        description="Radius of the semi-tabu region, in which steps are directed outwards.",
    )
    region_radius: float = Field(
        default=0.2,
        gt=0,
        le=1,
        description="Radius of a visited region; explorations begin outside of these.",
    )
    tolerance: float = Field(
        default=1e-4,
        ge=0,
        lt=1,
        description="Convergence tolerance of an intensification, as a share of the best fitness.",
    )


def directed_tabu(
    settings: DirectedTabuSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Explore by a tabu search whose trial points are directed, then intensify, then diversify.

    Each iteration of an exploration evaluates one neighbour per variable, as one batch, and then
    points along the approximate descent direction that these define. It moves to the best of them
    even if that is worse than the current point, but never into a tabu region (the neighbourhood of
    a recent point). Inside a semi-tabu region, neighbours are on the side that leads out. Steps are
    halved when no point was better. The exploration ends after `patience` iterations without a new
    best; if its best is the best so far, a Nelder-Mead simplex intensifies the search there. The
    next exploration begins outside the visited regions, whose radii grow with the number of visits.

    Integers move by at least one. The neighbour of a categorical value is a random other value;
    categorical variables do not contribute to descent directions.
    """
    first = known_points(space, start)[:1]
    return evaluated_once(space, _explorations(settings, Axes(space), random, first), start)


def _explorations(
    settings: DirectedTabuSettings, axes: Axes, random: RandomNumbers, first: list[Point]
) -> Endless:
    """Explore, intensify and diversify, endlessly."""

    def search(start: Point, scale: float) -> Walk:
        return simplex_search(start, axes, 0.25 * settings.step * scale, settings.tolerance)

    visited = VisitedRegions(axes.space.dimension, settings.region_radius)
    if not first:
        first = yield from sampled(axes, random, axes.space.dimension + 1)
    best = first[0]
    start = best
    while True:
        found = yield from explore(start, axes, settings, visited, random)
        if found.fitness <= best.fitness:
            best = yield from mixed(found, axes, search)
            visited.visit(best.unit)
        unit = visited.farthest(axes.random(random, _CANDIDATES))
        fitness = yield unit[None]
        start = Point(unit, float(fitness[0]))


def explore(
    start: Point,
    axes: Axes,
    settings: DirectedTabuSettings,
    visited: VisitedRegions,
    random: RandomNumbers,
) -> Walk:
    """Explore from a point until `patience` iterations bring no new best."""
    here, best, step, failures = start, start, settings.step, 0
    tabu = TabuList(settings.tabu_list, settings.tabu_radius, settings.semi_tabu_radius)
    while failures < settings.patience:
        visited.visit(here.unit)
        tabu.visit(here.unit)
        near = neighbours(here.unit, axes, step, tabu, random)
        trials = yield from _evaluated_unless_tabu(near, tabu)
        direction = descent_direction(here, trials, axes)
        if direction.any():
            ahead = np.clip(here.unit + step * direction, 0.0, 1.0)
            trials += yield from _evaluated_unless_tabu(ahead[None], tabu)
            if min(trials, key=_fitness) is trials[-1]:
                farther = np.clip(here.unit + 2.0 * step * direction, 0.0, 1.0)
                trials += yield from _evaluated_unless_tabu(farther[None], tabu)
        if not trials:
            break
        there = min(trials, key=_fitness)
        if not there.fitness < here.fitness:
            step *= 0.5
        here = there
        failures = 0 if gains(here, best, settings.tolerance) else failures + 1
        best = min(best, here, key=_fitness)
    return best


def _evaluated_unless_tabu(unit: Floats, tabu: TabuList) -> Generator[Floats, Floats, list[Point]]:
    """Evaluate positions (n, d) outside of tabu regions."""
    allowed = unit[[not tabu.is_tabu(row) for row in unit]]
    if not len(allowed):
        return []
    fitness = yield allowed
    return [Point(row, f) for row, f in zip(allowed, fitness.tolist(), strict=True)]


def neighbours(
    unit: Floats, axes: Axes, step: float, tabu: TabuList, random: RandomNumbers
) -> Floats:
    """Return a neighbour in each variable, on the side that leads out of semi-tabu regions."""
    d, space = len(unit), axes.space
    away, draws = tabu.way_out(unit), random.uniform(d)
    sides = np.where(away == 0.0, np.where(draws < 0.5, -1.0, 1.0), np.sign(away))
    steps = np.maximum(step, axes.least)
    # On the other side if a bound is nearer than half of the step.
    sides = np.where(
        np.abs(np.clip(unit + sides * steps, 0, 1) - unit) < 0.5 * steps, -sides, sides
    )
    near = np.clip(np.tile(unit, (d, 1)) + np.diag(sides * steps), 0.0, 1.0)
    for j in np.flatnonzero(space.categorical).tolist():
        design = axes.design(unit)
        choices = space.high[j] + 1.0
        design[j] = (design[j] + 1.0 + math.floor(draws[j] * space.high[j])) % choices
        near[j, j] = space.to_unit(space.positions(design[None]))[0, j]
    return near


def descent_direction(here: Point, trials: list[Point], axes: Axes) -> Floats:
    """Return the approximate descent direction from neighbours (Hedar and Fukushima 2004)."""
    direction = np.zeros(len(here.unit))
    for trial in trials:
        away = np.where(axes.space.categorical, 0.0, here.unit - trial.unit)
        distance = math.sqrt(float((away * away).sum()))
        if distance > 0.0 and math.isfinite(trial.fitness) and math.isfinite(here.fitness):
            direction += (trial.fitness - here.fitness) * away / distance
    length = math.sqrt(float((direction * direction).sum()))
    return direction / length if length > 0.0 else direction


class TabuList:
    """Most recent points, with the regions around them."""

    def __init__(self, length: int, radius: float, semi_radius: float) -> None:
        self._length: Final = length
        self._radius: Final = radius
        self._semi_radius: Final = semi_radius
        self._points: list[Floats] = []

    def visit(self, unit: Floats) -> None:
        """Add a point; drop the oldest beyond the list's length."""
        self._points = [*self._points, unit][-self._length :]

    def is_tabu(self, unit: Floats) -> bool:
        """Return whether a position lies in a tabu region."""
        return any(float(np.abs(unit - point).max()) < self._radius for point in self._points)

    def way_out(self, unit: Floats) -> Floats:
        """Return the direction out of semi-tabu regions, zero outside of them."""
        near = [p for p in self._points if float(np.abs(unit - p).max()) < self._semi_radius]
        return unit - np.array(near).sum(axis=0) / len(near) if near else np.zeros(len(unit))


class VisitedRegions:
    """Explored regions with their number of visits."""

    def __init__(self, dimension: int, radius: float) -> None:
        self._radius: Final = radius
        self._centres: Floats = np.empty((0, dimension))
        self._visits: Floats = np.empty(0)

    def visit(self, unit: Floats) -> None:
        """Count a visit to the nearest region; outside of all, add a region."""
        distances = np.abs(self._centres - unit).max(axis=1)
        if (distances < self._radius).any():
            self._visits[int(np.argmin(distances))] += 1.0
        else:
            self._centres = np.vstack([self._centres, unit])
            self._visits = np.append(self._visits, 1.0)

    def farthest(self, candidates: Floats) -> Floats:
        """Return the first candidate outside of all regions, or the least visited one."""
        # frexp instead of log2: the same on every processor.
        doublings = np.frexp(self._visits)[1] - 1
        radii = self._radius * (1.0 + 0.5 * doublings)
        clear = [
            float((np.abs(self._centres - candidate).max(axis=1) / radii).min(initial=math.inf))
            for candidate in candidates
        ]
        outside = [k for k, distance in enumerate(clear) if distance >= 1.0]
        chosen: Floats = candidates[outside[0] if outside else clear.index(max(clear))]
        return chosen


def _fitness(point: Point) -> float:
    return point.fitness


METHOD = from_generator(
    DirectedTabuSettings,
    "Directed tabu search (Hedar and Fukushima 2006): explores, intensifies, diversifies",
    directed_tabu,
)
