"""BFGS with finite-difference gradients and bounds (Nocedal and Wright 2006, algorithm 6.1)."""

from __future__ import annotations

import math
from collections.abc import Generator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm_research.methods.local_search import Axes, Point, Walk, gains, judged

Floats = NDArray[np.float64]

_SUFFICIENT: Final = 1e-4
"""Required share of the decrease predicted by the gradient (Armijo)."""

_LONGEST: Final = 0.5
"""Longest step in any variable [unit]."""

_MOST_STEPS: Final = 200
"""Maximum number of steps."""


def bfgs(
    start: Point,
    axes: Axes,
    step: float,
    tolerance: float,
    difference: float,
    least: float = 1e-8,
) -> Walk:
    """Descend by quasi-Newton steps until a step gains less than the tolerance.

    Gradients are forward differences to one neighbour per smooth variable, evaluated as one batch;
    the neighbour of an integer differs by at least one. Variables at a bound with a gradient
    pointing outwards are fixed for the step, and steps are projected onto the bounds (Bertsekas
    1982). Steps are halved, or cut to the minimum of a parabola, until they satisfy Armijo's
    condition.
    """
    here = start
    gradient, nearby = yield from _gradient(here, axes, difference)
    inverse: Floats | None = None
    for _ in range(_MOST_STEPS):
        unit = here.unit[axes.smooth]
        free = ~(((unit <= 0.0) & (gradient > 0.0)) | ((unit >= 1.0) & (gradient < 0.0)))
        slope = np.where(free, gradient, 0.0)
        if not slope.any():
            return nearby
        is_steepest = inverse is None
        if inverse is None:
            direction = -slope * (step / np.abs(slope).max())
        else:
            direction = np.where(free, -_times(inverse, slope), 0.0)
            if _dot(direction, slope) >= 0.0:
                inverse = None
                continue
        direction *= min(1.0, _LONGEST / np.abs(direction).max())
        there = yield from _line_search(here, direction, slope, axes, least)
        if there is None:
            if is_steepest or nearby.fitness < here.fitness:
                return nearby
            inverse = None
            continue
        is_level = not gains(there, here, tolerance)
        after, nearby = yield from _gradient(there, axes, difference)
        moved, turned = there.unit[axes.smooth] - unit, after - gradient
        inverse = _updated(inverse, moved, turned)
        here, gradient = there, after
        if is_level:
            break
    return nearby


def _gradient(
    here: Point, axes: Axes, difference: float
) -> Generator[Floats, Floats, tuple[Floats, Point]]:
    """Return the gradient (m,), and the best of the point and its neighbours."""
    smooth = axes.smooth
    away = np.maximum(difference, axes.least[smooth])
    away = np.where(here.unit[smooth] + away <= 1.0, away, -away)
    near = np.repeat(here.unit[None], len(smooth), axis=0)
    near[np.arange(len(smooth)), smooth] += away
    fitness = yield near
    k = int(np.argmin(fitness))
    best = Point(near[k], float(fitness[k])) if fitness[k] < here.fitness else here
    if not math.isfinite(here.fitness):
        return np.zeros(len(smooth)), best
    # A failed evaluation has no slope.
    rise = np.where(np.isfinite(fitness), fitness, here.fitness) - here.fitness
    return rise / away, best


def _line_search(
    here: Point, direction: Floats, slope: Floats, axes: Axes, least: float
) -> Generator[Floats, Floats, Point | None]:
    """Return a point along a direction (m,) that satisfies Armijo's condition, or None."""
    length, span = 1.0, float(np.abs(direction).max())
    while length * span > least:
        unit = here.unit.copy()
        unit[axes.smooth] = np.clip(unit[axes.smooth] + length * direction, 0.0, 1.0)
        promised = _dot(unit[axes.smooth] - here.unit[axes.smooth], slope)
        there = yield from judged(unit)
        if there.fitness < here.fitness and there.fitness <= here.fitness + _SUFFICIENT * promised:
            return there
        # Minimum of the parabola through both points with the slope at the first.
        bend = there.fitness - here.fitness - promised
        length *= min(0.5, max(0.1, -0.5 * promised / bend)) if bend > 0.0 else 0.5
    return None


def _updated(inverse: Floats | None, moved: Floats, turned: Floats) -> Floats | None:
    """Return the updated inverse Hessian (Nocedal and Wright 2006, eq. 6.17 and 6.20)."""
    bend = _dot(moved, turned)
    if bend <= 1e-12:
        return inverse
    if inverse is None:
        inverse = np.eye(len(moved)) * (bend / _dot(turned, turned))
    image = _times(inverse, turned)
    mixed = np.outer(moved, image)
    weight = (1.0 + _dot(turned, image) / bend) / bend
    updated: Floats = inverse - (mixed + mixed.T) / bend + weight * np.outer(moved, moved)
    return updated


def _times(matrix: Floats, vector: Floats) -> Floats:
    product: Floats = (matrix * vector).sum(axis=1)
    return product


def _dot(a: Floats, b: Floats) -> float:
    return float((a * b).sum())
