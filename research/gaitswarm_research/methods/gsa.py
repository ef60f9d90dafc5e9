"""Gravitational search algorithm (Rashedi, Nezamabadi-pour and Saryazdi 2009)."""

from __future__ import annotations

import math
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.plugins import Proposals, RandomNumbers, SearchSettings, Space, from_generator

Floats = NDArray[np.float64]

_RANGE: Final = 2.0
"""Range of every variable in units of the search, as in the thesis's test functions."""

_EPSILON: Final = 2.0**-52
"""Avoids a zero distance between two masses at one place."""


class GsaSettings(SearchSettings):
    """Settings of the gravitational search algorithm, with the source's defaults."""

    name: Literal["gsa"] = "gsa"
    particles: int = Field(default=25, ge=1, le=10_000, description="Masses.")
    gravity: float = Field(
        default=100.0,
        gt=0.0,
        le=1e6,
        description="G0, the gravitational constant at the start; a variable's range is 2.",
    )
    decay: float = Field(
        default=20.0,
        ge=0.0,
        le=100.0,
        description="alpha: the constant falls by exp(-alpha) over the budget.",
    )
    attracting_end: float = Field(
        default=0.02,
        ge=0.0,
        le=1.0,
        description="Share of the masses that attract at the end (Kbest), at least one; all attract"
        " at the start.",
    )


def gsa(settings: GsaSettings, space: Space, budget: int, random: RandomNumbers) -> Proposals:
    """Search by masses that attract each other, better ones being heavier.

    Masses follow eq. 14 and 15 of the source, the attraction by the Kbest heaviest ones eq. 7 to 10
    and 21, the motion eq. 11 and 12, the decay of the gravitational constant eq. 28. As in the
    source, the attraction falls with the distance rather than with its square. A variable that
    leaves the box is redrawn, as in the authors' program. A failed evaluation has no mass.

    The source measures distances in the variables' own units; here every variable is scaled to a
    range of 2, which nearly all have in the thesis's test functions.

    The schedule lasts for the budget; then the method restarts and keeps nothing.
    """
    shape = settings.particles, space.dimension
    iterations = max(math.ceil(budget / settings.particles), 1)
    while True:
        places = _RANGE * random.uniform(*shape)
        velocities = np.zeros(shape)
        for iteration in range(1, iterations + 1):
            fitness = yield space.from_unit(places / _RANGE)
            share = iteration / iterations
            gravity = settings.gravity * math.exp(-settings.decay * share)
            attracting = settings.attracting_end + (1.0 - settings.attracting_end) * (1.0 - share)
            count = max(round(attracting * settings.particles), 1)
            pull = accelerations(places, masses(fitness), count, random)
            velocities = random.uniform(*shape) * velocities + gravity * pull
            places = places + velocities
            outside = (places < 0.0) | (places > _RANGE)
            places = np.where(outside, _RANGE * random.uniform(*shape), places)


def masses(fitness: Floats) -> Floats:
    """Return the masses of fitness values (eq. 14, 15)."""
    alive = np.isfinite(fitness)
    if not alive.any():
        return np.full(len(fitness), 1.0 / len(fitness))
    best, worst = fitness[alive].min(), fitness[alive].max()
    if best == worst:
        return np.where(alive, 1.0 / np.count_nonzero(alive), 0.0)
    mass: Floats = np.where(alive, (worst - np.where(alive, fitness, worst)) / (worst - best), 0.0)
    mass /= mass.sum()
    return mass


def accelerations(places: Floats, mass: Floats, attracting: int, random: RandomNumbers) -> Floats:
    """Return the accelerations by the heaviest masses for G = 1 (eq. 7 to 10, 21).

    A mass cancels in its own acceleration, so that one without mass moves, too.
    """
    n, d = places.shape
    pull = np.zeros((n, d))
    for j in np.argsort(-mass, kind="stable")[:attracting].tolist():
        away = places[j] - places
        distance = np.sqrt(np.square(away).sum(axis=1, keepdims=True))
        pull += random.uniform(n, d) * mass[j] * away / (distance + _EPSILON)
    return pull


METHOD = from_generator(
    GsaSettings,
    "Gravitational search algorithm (Rashedi, Nezamabadi-pour and Saryazdi 2009)",
    gsa,
)
