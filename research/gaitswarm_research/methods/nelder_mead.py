"""The simplex of Nelder and Mead (1965), with the coefficients of Gao and Han (2012)."""

from __future__ import annotations

import math
from typing import Literal

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
    judged,
    known_points,
    mixed,
    sampled,
)

Floats = NDArray[np.float64]


class NelderMeadSettings(SearchSettings):
    """Settings of the Nelder-Mead simplex with restarts."""

    name: Literal["nelder-mead"] = "nelder-mead"
    sample: int = Field(
        default=10,
        ge=1,
        le=10_000,
        description="Random designs before each start, which begins at the best of them.",
    )
    simplex: float = Field(
        default=0.25,
        gt=0,
        le=0.5,
        description="Edge of the first simplex, share of each range.",
    )
    tolerance: float = Field(
        default=1e-4,
        ge=0,
        lt=1,
        description="A simplex has converged when its fitness values differ by at most this share"
        " of the best.",
    )


def nelder_mead(
    settings: NelderMeadSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Search by a simplex with restarts, first around its minimum, then from random samples.

    The first simplex and a shrunken one are evaluated as one batch; all other steps are single
    designs, because evaluating reflection, expansion and contractions together would use at most
    two of four. A converged simplex is restarted around its best vertex (Kelley 1999: it may have
    collapsed into a subspace) until that brings no gain; then from the best of a new random sample.

    Integers with few values and categorical variables are held constant by the simplex and polled
    before and after it. In an integer with many values, a simplex spans at least one. Bounds are
    kept by projection.
    """
    first = known_points(space, start)[:1]
    return evaluated_once(space, _restarted(settings, Axes(space), random, first), start)


def _restarted(
    settings: NelderMeadSettings, axes: Axes, random: RandomNumbers, first: list[Point]
) -> Endless:
    def search(start: Point, scale: float) -> Walk:
        return simplex_search(start, axes, settings.simplex * scale, settings.tolerance)

    while True:
        here = first.pop() if first else (yield from sampled(axes, random, settings.sample))[0]
        while True:
            minimum = yield from mixed(here, axes, search)
            if not gains(minimum, here, settings.tolerance):
                break
            here = minimum


def simplex_search(
    start: Point, axes: Axes, edge: float, tolerance: float, least: float = 1e-9
) -> Walk:
    """Move a simplex over the smooth variables until it converges."""
    smooth = axes.smooth
    n = len(smooth)
    # Gao and Han (2012), equation 4.1; in one dimension the simplex would shrink to a point.
    m = max(n, 2)
    expansion, contraction, shrinkage = 1.0 + 2.0 / m, 0.75 - 0.5 / m, 1.0 - 1.0 / m
    smallest = np.maximum(least, axes.least[smooth])

    vertices = np.vstack([start.unit] * (n + 1))
    edges = np.maximum(edge, axes.least[smooth])
    inwards = np.where(start.unit[smooth] + edges <= 1.0, edges, -edges)
    vertices[np.arange(1, n + 1), smooth] += inwards
    vertices = np.clip(vertices, 0.0, 1.0)
    fitness = np.concatenate([[start.fitness], (yield vertices[1:])])

    for _ in range(200 * n):
        order = np.argsort(fitness, kind="stable")
        vertices, fitness = vertices[order], fitness[order]
        worst, best = float(fitness[-1]), float(fitness[0])
        is_flat = math.isinf(best) or worst - best <= tolerance * abs(best)
        if is_flat or (np.ptp(vertices[:, smooth], axis=0) <= smallest).all():
            break
        centroid = vertices[:-1].sum(axis=0) / n
        away = centroid - vertices[-1]

        reflected = yield from judged(centroid + away)
        if reflected.fitness < fitness[0]:
            expanded = yield from judged(centroid + expansion * away)
            accepted = expanded if expanded.fitness < reflected.fitness else reflected
        elif reflected.fitness < fitness[-2]:
            accepted = reflected
        else:
            outside = reflected.fitness < fitness[-1]
            trial = centroid + (contraction if outside else -contraction) * away
            accepted = yield from judged(trial)
            if not accepted.fitness < min(reflected.fitness, fitness[-1]):
                vertices[1:] = vertices[0] + shrinkage * (vertices[1:] - vertices[0])
                fitness[1:] = yield vertices[1:].copy()
                continue
        vertices[-1], fitness[-1] = accepted.unit, accepted.fitness
    k = int(np.argmin(fitness))
    return Point(vertices[k], float(fitness[k]))


METHOD = from_generator(
    NelderMeadSettings,
    "Simplex of Nelder and Mead (1965), adaptive coefficients (Gao and Han 2012), restarts",
    nelder_mead,
)
