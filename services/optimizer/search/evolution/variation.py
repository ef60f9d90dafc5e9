"""How populations that move by differences are begun and varied."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.space import Space

Floats = NDArray[np.float64]

_ANY_CHOICE: Final = 0.1
"""Chance that a changed categorical variable takes any of its choices, not another member's."""


def latin_hypercube(space: Space, count: int, random: RandomNumbers) -> Floats:
    """Scatter positions so that each variable has one in each of `count` equal parts."""
    d = space.dimension
    cells = np.array([random.permutation(count) for _ in range(d)], dtype=np.float64).T
    return space.evenly((cells + random.uniform(count, d)) / count)


def with_choices(
    space: Space, mutants: Floats, givers: tuple[Floats, Floats, Floats], random: RandomNumbers
) -> Floats:
    """Give mutants their choices, which have no differences: a giver's, or now and then any."""
    lot, share = random.uniform(*mutants.shape), (1.0 - _ANY_CHOICE) / 3.0
    conditions = [lot < share, lot < 2.0 * share, lot < 3.0 * share]
    anything = space.from_unit((lot - 3.0 * share) / _ANY_CHOICE)
    return np.where(space.categorical, np.select(conditions, list(givers), anything), mutants)


def crossed(parents: Floats, mutants: Floats, crossover: Floats, random: RandomNumbers) -> Floats:
    """Binomial crossover: of the mutant, at least one variable."""
    n, d = mutants.shape
    changed = random.uniform(n, d) < crossover[:, np.newaxis]
    changed[np.arange(n), indices(random.uniform(n), d)] = True
    return np.where(changed, mutants, parents)


def without_duplicates(
    space: Space, members: Floats, trials: Floats, random: RandomNumbers
) -> Floats:
    """Draw one variable anew of a trial whose design is a member's or another trial's, too."""
    n, d = trials.shape
    variable, anything = indices(random.uniform(n), d), space.evenly(random.uniform(n, d))
    seen = {design.tobytes() for design in space.designs(members)}
    for i, design in enumerate(space.designs(trials)):
        if design.tobytes() in seen:
            trials[i, variable[i]] = anything[i, variable[i]]
        seen.add(space.designs(trials[i : i + 1]).tobytes())
    return trials


def indices(uniform: Floats, count: int) -> NDArray[np.intp]:
    """Choose from `count` things."""
    return (uniform * count).astype(np.intp)
