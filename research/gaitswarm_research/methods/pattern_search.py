"""Generalized pattern search from random designs (Torczon 1997; Audet and Dennis 2003)."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from gaitswarm.plugins import (
    Judged,
    PollSettings,
    Proposals,
    RandomNumbers,
    Space,
    Start,
    from_generator,
    polls,
)

Floats = NDArray[np.float64]

_DRAWS: Final = 20
"""Random starts drawn, at most, before one that was already evaluated is used."""


class PatternSearchSettings(PollSettings):
    """Settings of pattern search."""

    name: Literal["ps"] = "ps"


def pattern_search(
    settings: PatternSearchSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Search by polling around the best design on a mesh that grows and shrinks.

    A poll has the 2d coordinate directions, as Matlab's patternsearch has by default. A search
    begins at a random design. When its mesh is below the tolerance and no neighbour in the integers
    and choices is better, it restarts at another design and keeps nothing. A random design that
    fails is abandoned at once.
    """
    judged = Judged(space)
    if start is not None:
        judged.new(space.designs(start.positions))
        positions, fitness = start.best_first
        for centre in space.designs(positions[:1]):
            yield from polls(settings, space, centre, float(fitness[0]), judged, random)
    while True:
        designs = _random_design(space, random, judged)
        fitness = yield space.positions(designs)
        if np.isfinite(fitness[0]):
            yield from polls(settings, space, designs[0], float(fitness[0]), judged, random)


def _random_design(space: Space, random: RandomNumbers, judged: Judged) -> Floats:
    """Draw (1, d) a design that was not evaluated yet, if one is found soon."""
    design = space.designs(space.evenly(random.uniform(1, space.dimension)))
    for _ in range(_DRAWS - 1):
        if judged.new(design)[0]:
            break
        design = space.designs(space.evenly(random.uniform(1, space.dimension)))
    return design


METHOD = from_generator(
    PatternSearchSettings,
    "Generalized pattern search on a mesh (Torczon 1997; Audet and Dennis 2003)",
    pattern_search,
)
