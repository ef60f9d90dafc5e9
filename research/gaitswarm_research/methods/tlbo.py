"""Teaching-learning-based optimization (Rao, Savsani and Vakharia 2011)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.plugins import (
    Proposals,
    RandomNumbers,
    SearchSettings,
    Space,
    Start,
    from_generator,
)
from gaitswarm_research.methods.judged import Judged

Floats = NDArray[np.float64]

_DRAWS: Final = 20
"""Largest number of changes of a duplicate; a small space may have no other design."""


class TlboSettings(SearchSettings):
    """Settings of teaching-learning-based optimization."""

    name: Literal["tlbo"] = "tlbo"
    particles: int = Field(default=25, ge=2, le=10_000, description="Learners of the class.")
    collapse: float = Field(
        default=1e-9,
        ge=0.0,
        le=0.1,
        description="Extent, as a share of each variable's range, below which a class is replaced.",
    )


@dataclass(slots=True)
class _Class:
    """Learners and their fitness."""

    positions: Floats
    fitness: Floats

    def learn(self, positions: Floats, fitness: Floats) -> None:
        """Replace learners by better positions."""
        better = fitness < self.fitness
        self.positions[better] = positions[better]
        self.fitness[better] = fitness[better]

    def spread(self, space: Space) -> float:
        """Return the largest extent in any variable, as a share of its range."""
        return float(np.max(np.ptp(space.to_unit(self.positions), axis=0)))


def tlbo(
    settings: TlboSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Search by a class that learns from its teacher and from one another, in phases.

    All learners of a phase are one batch, which uses the class before the phase. A design that was
    already evaluated is changed in random variables first, so duplicates cost no evaluation. A
    class that has collapsed, or in which every evaluation failed, is replaced and nothing is kept.

    Moves are in the variables' own units, as in the source. The teacher phase depends on where a
    variable has its zero.
    """
    judged = Judged(space)
    known, worth = np.empty((0, space.dimension)), np.empty(0)
    if start is not None:
        judged.new(space.designs(start.positions))
        known, worth = (best[: settings.particles] for best in start.best_first)
    while True:
        drawn = space.evenly(random.uniform(settings.particles, space.dimension))[len(known) :]
        if len(drawn):
            drawn = _without_duplicates(drawn, space, judged, random)
            known, worth = np.vstack([known, drawn]), np.concatenate([worth, (yield drawn)])
        group = _Class(known.copy(), worth.copy())
        known, worth = known[:0], worth[:0]
        while np.isfinite(group.fitness).any() and group.spread(space) > settings.collapse:
            for phase in (_taught, _discussed):
                moved = np.clip(phase(group, random), space.low, space.high)
                moved = _without_duplicates(moved, space, judged, random)
                group.learn(moved, (yield moved))


def _taught(group: _Class, random: RandomNumbers) -> Floats:
    """Apply the teacher phase: X + r (teacher - T_F mean), T_F 1 or 2 by learner."""
    n, d = group.positions.shape
    teacher = group.positions[int(np.argmin(group.fitness))]
    factor = 1.0 + np.floor(2.0 * random.uniform(n, 1))
    difference = teacher - factor * group.positions.mean(axis=0)
    moved: Floats = group.positions + random.uniform(n, d) * difference
    return moved


def _discussed(group: _Class, random: RandomNumbers) -> Floats:
    """Apply the learner phase: move away from a worse learner, or to a better one."""
    n, d = group.positions.shape
    others = (np.arange(n) + 1 + np.floor(random.uniform(n) * (n - 1)).astype(np.intp)) % n
    away = group.fitness < group.fitness[others]
    to_other = group.positions[others] - group.positions
    direction = np.where(away[:, np.newaxis], -to_other, to_other)
    moved: Floats = group.positions + random.uniform(n, d) * direction
    return moved


def _without_duplicates(
    positions: Floats, space: Space, judged: Judged, random: RandomNumbers
) -> Floats:
    """Redraw variables of positions whose designs were already evaluated, one by one."""
    for row in positions:
        for _ in range(_DRAWS):
            if judged.new(space.designs(row[np.newaxis]))[0]:
                break
            j = random.index(space.dimension)
            row[j] = space.evenly(random.uniform(1, space.dimension))[0, j]
    return positions


METHOD = from_generator(
    TlboSettings,
    "Teaching-learning-based optimization (Rao, Savsani and Vakharia 2011)",
    tlbo,
)
