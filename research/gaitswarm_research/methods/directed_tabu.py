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
"""Random positions to choose a start from that is far from visited regions."""


class DirectedTabuSettings(SearchSettings):
    """Settings of directed tabu search."""

    name: Literal["dts"] = "dts"
    step: float = Field(
        default=0.2, gt=0, le=0.5, description="First step of an exploration, of each range."
    )
    patience: int = Field(
        default=4,
        ge=1,
        le=1_000,
        description="Iterations in a row without a new best that end an exploration.",
    )
    tabu_list: int = Field(
        default=7, ge=1, le=1_000, description="Visited points whose neighbourhoods are tabu."
    )
    tabu_radius: float = Field(
        default=0.02, gt=0, le=0.5, description="Of a tabu region, as a share of each range."
    )
    semi_tabu_radius: float = Field(
        default=0.1,
        gt=0,
        le=1,
        description="Of a semi-tabu region around it, out of which steps are directed.",
    )
    region_radius: float = Field(
        default=0.2,
        gt=0,
        le=1,
        description="Of a visited region, outside of which an exploration begins.",
    )
    tolerance: float = Field(
        default=1e-4,
        ge=0,
        lt=1,
        description="At which an intensification has converged, as a share of the best fitness.",
    )


def directed_tabu(
    settings: DirectedTabuSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Explore by a tabu search whose trial points are directed, then intensify, then diversify.

    An exploration's iteration judges one neighbour in each variable, as one batch, and then points
    along the approximate descent direction that these give. It goes to the best of all, though that
    may be worse than where it was, but never into a tabu region: the neighbourhood of one of the
    last points that it has been at. From within a semi-tabu region, neighbours are on the side that
    leads out. Steps are halved when nothing was better. After `patience` iterations without a
    new best, the exploration ends; if its best is the best so far, a Nelder-Mead simplex
    intensifies the search there. The next exploration begins outside the regions that were visited,
    the farther the more often they were. The regions and the best are kept.

    Integers move by one at least. A choice's neighbour is another one at random; it has no part in
    descent directions.
    """
    first = known_points(space, start)[:1]
    return evaluated_once(space, _explorations(settings, Axes(space), random, first), start)


def _explorations(
    settings: DirectedTabuSettings, axes: Axes, random: RandomNumbers, first: list[Point]
) -> Endless:
    """Explore, intensify, diversify, for ever."""

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
    """Explore from a point, until there is no new best for a while."""
    here, best, step, failures = start, start, settings.step, 0
    tabu = TabuList(settings.tabu_list, settings.tabu_radius, settings.semi_tabu_radius)
    while failures < settings.patience:
        visited.visit(here.unit)
        tabu.visit(here.unit)
        near = neighbours(here.unit, axes, step, tabu, random)
        trials = yield from _judged_unless_tabu(near, tabu)
        direction = descent_direction(here, trials, axes)
        if direction.any():
            ahead = np.clip(here.unit + step * direction, 0.0, 1.0)
            trials += yield from _judged_unless_tabu(ahead[None], tabu)
            if min(trials, key=_fitness) is trials[-1]:
                farther = np.clip(here.unit + 2.0 * step * direction, 0.0, 1.0)
                trials += yield from _judged_unless_tabu(farther[None], tabu)
        if not trials:
            break
        there = min(trials, key=_fitness)
        if not there.fitness < here.fitness:
            step *= 0.5
        here = there
        failures = 0 if gains(here, best, settings.tolerance) else failures + 1
        best = min(best, here, key=_fitness)
    return best


def _judged_unless_tabu(unit: Floats, tabu: TabuList) -> Generator[Floats, Floats, list[Point]]:
    """Judge positions (n, d), but for those in tabu regions."""
    allowed = unit[[not tabu.is_tabu(row) for row in unit]]
    if not len(allowed):
        return []
    fitness = yield allowed
    return [Point(row, f) for row, f in zip(allowed, fitness.tolist(), strict=True)]


def neighbours(
    unit: Floats, axes: Axes, step: float, tabu: TabuList, random: RandomNumbers
) -> Floats:
    """Give a neighbour in each variable, on the side that leads out of semi-tabu regions."""
    d, space = len(unit), axes.space
    away, draws = tabu.way_out(unit), random.uniform(d)
    sides = np.where(away == 0.0, np.where(draws < 0.5, -1.0, 1.0), np.sign(away))
    steps = np.maximum(step, axes.least)
    # Where a bound is nearer than half of the step, the other side.
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
    """The approximate descent direction that neighbours give (Hedar and Fukushima 2004)."""
    direction = np.zeros(len(here.unit))
    for trial in trials:
        away = np.where(axes.space.categorical, 0.0, here.unit - trial.unit)
        distance = math.sqrt(float((away * away).sum()))
        if distance > 0.0 and math.isfinite(trial.fitness) and math.isfinite(here.fitness):
            direction += (trial.fitness - here.fitness) * away / distance
    length = math.sqrt(float((direction * direction).sum()))
    return direction / length if length > 0.0 else direction


class TabuList:
    """The last points that were visited, with the regions around them."""

    def __init__(self, length: int, radius: float, semi_radius: float) -> None:
        """Begin with no point."""
        self._length: Final = length
        self._radius: Final = radius
        self._semi_radius: Final = semi_radius
        self._points: list[Floats] = []

    def visit(self, unit: Floats) -> None:
        """Remember a point, and forget the oldest beyond the list's length."""
        self._points = [*self._points, unit][-self._length :]

    def is_tabu(self, unit: Floats) -> bool:
        """Tell whether a position lies in a tabu region."""
        return any(float(np.abs(unit - point).max()) < self._radius for point in self._points)

    def way_out(self, unit: Floats) -> Floats:
        """Give the direction out of semi-tabu regions."""
        near = [p for p in self._points if float(np.abs(unit - p).max()) < self._semi_radius]
        return unit - np.array(near).sum(axis=0) / len(near) if near else np.zeros(len(unit))


class VisitedRegions:
    """Regions that were explored, with how often."""

    def __init__(self, dimension: int, radius: float) -> None:
        """Begin with no region."""
        self._radius: Final = radius
        self._centres: Floats = np.empty((0, dimension))
        self._visits: Floats = np.empty(0)

    def visit(self, unit: Floats) -> None:
        """Count a visit to the nearest region; a point outside of all is the centre of a new one"""
        distances = np.abs(self._centres - unit).max(axis=1)
        if (distances < self._radius).any():
            self._visits[int(np.argmin(distances))] += 1.0
        else:
            self._centres = np.vstack([self._centres, unit])
            self._visits = np.append(self._visits, 1.0)

    def farthest(self, candidates: Floats) -> Floats:
        """Choose where to go next."""
        # Their number of digits in base 2 is the same on every processor.
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
