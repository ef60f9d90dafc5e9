"""Simulated annealing whose steps adapt in each variable (Corana et al. 1987)."""

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
    evaluated_once,
    known_points,
    sampled,
)

Floats = NDArray[np.float64]

_STEP_CHANGE: Final = 2.0
"""Sensitivity of a step to the share of accepted moves: c of Corana et al."""


class AnnealingSettings(SearchSettings):
    """Settings of simulated annealing."""

    name: Literal["sa"] = "sa"
    chains: int = Field(
        default=1,
        ge=1,
        le=1_000,
        description="Chains that run at once, each with its share of the budget.",
    )
    sample: int = Field(
        default=10,
        ge=2,
        le=10_000,
        description="Random designs before each annealing: their spread determines the first"
        " temperature, and chains begin at the best.",
    )
    acceptance: float = Field(
        default=0.2,
        gt=0,
        lt=1,
        description="Initial probability to accept a rise as large as the median difference in the"
        " sample.",
    )
    cooling: float = Field(
        default=1e-4,
        gt=0,
        lt=1,
        description="Last temperature, as a share of the first: reached at the end of the budget.",
    )
    cycles: int = Field(
        default=3,
        ge=1,
        le=1_000,
        description="Moves in each variable at one temperature, before steps are adapted.",
    )
    step: float = Field(
        default=0.5, gt=0, le=1, description="First step, as a share of each variable's range."
    )


def annealing(
    settings: AnnealingSettings,
    space: Space,
    budget: int,
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Search by moves in one variable at a time, of which worse ones are accepted now and then.

    A move that raises the fitness by r at temperature T is accepted in the share exp(-r/T); a
    failed evaluation never is, unless the chain is at one. After `cycles` moves in each variable,
    steps are adapted so that about half of the moves are accepted, the temperature falls, and the
    chain goes back to its best. The temperature falls by the same factor each time, so that the
    last one is reached at the end of the budget. A search that goes on is annealed again, from the
    best designs of a new sample and of its own chains.

    Integers move by one at least, a choice to any other one. Chains know nothing of each other, and
    their moves are one batch.
    """
    known = known_points(space, start)
    search = _annealings(settings, Axes(space), budget, random, known)
    return evaluated_once(space, search, start)


def _annealings(
    settings: AnnealingSettings,
    axes: Axes,
    budget: int,
    random: RandomNumbers,
    best: list[Point],
) -> Endless:
    """Anneal, again and again; the best is kept."""
    chains = settings.chains
    moves = chains * settings.cycles * axes.space.dimension
    levels = max(2, math.ceil((budget - settings.sample) / moves))
    while True:
        points = yield from sampled(axes, random, settings.sample)
        starts = sorted([*points[:chains], *best], key=lambda point: point.fitness)
        first = initial_temperature([p.fitness for p in points], settings.acceptance)
        temperatures = [first * settings.cooling ** (k / (levels - 1)) for k in range(levels)]
        best = yield from _anneal(
            [Chain(starts[k % len(starts)], axes, settings.step) for k in range(chains)],
            temperatures,
            settings.cycles,
            random,
        )


def _anneal(
    chains: list[Chain], temperatures: list[float], cycles: int, random: RandomNumbers
) -> Generator[Floats, Floats, list[Point]]:
    """Anneal chains in parallel and return the best of each."""
    for temperature in temperatures:
        for _ in range(cycles):
            for j in range(len(chains[0].best.unit)):
                trials = np.array([chain.trial(j, random) for chain in chains])
                fitness = yield trials
                for chain, unit, value in zip(chains, trials, fitness.tolist(), strict=True):
                    chance = float(random.uniform())
                    chain.move(j, Point(unit, value), temperature, chance)
        for chain in chains:
            chain.adapt(cycles)
    return [chain.best for chain in chains]


def initial_temperature(fitness: list[float], acceptance: float) -> float:
    """Return the temperature at which a median rise is accepted with a probability."""
    values = [f for f in fitness if math.isfinite(f)]
    rises = sorted(abs(a - b) for k, a in enumerate(values) for b in values[:k] if abs(a - b) > 0.0)
    return rises[len(rises) // 2] / -math.log(acceptance) if rises else 1.0


class Chain:
    """A chain.

    Attributes:
        here: Current point.
        best: Best point so far.
        steps: (d,) longest step in each variable [unit].
    """

    def __init__(self, start: Point, axes: Axes, step: float) -> None:
        """Start a chain."""
        self.here = start
        self.best = start
        self.steps: Floats = np.maximum(np.full(len(start.unit), step), axes.least)
        self._axes: Final = axes
        self._accepted = np.zeros(len(start.unit))

    def trial(self, j: int, random: RandomNumbers) -> Floats:
        """Propose a move."""
        draw, fallback = random.uniform(2).tolist()
        space, unit = self._axes.space, self.here.unit.copy()
        if space.categorical[j] or space.integer[j]:
            design = self._axes.design(unit)
            if space.categorical[j]:
                design[j] = (design[j] + 1.0 + math.floor(draw * space.high[j])) % (
                    space.high[j] + 1.0
                )
            else:
                way = (2.0 * draw - 1.0) * self.steps[j] * space.span[j]
                way = math.copysign(max(1.0, math.floor(abs(way) + 0.5)), way)
                there = design[j] + way
                # Beyond a bound, move the other way; in a range too narrow for both, to the bound.
                there = there if space.low[j] <= there <= space.high[j] else design[j] - way
                design[j] = min(max(there, space.low[j]), space.high[j])
            unit[j] = space.to_unit(space.positions(design[None]))[0, j]
            return unit
        unit[j] += (2.0 * draw - 1.0) * self.steps[j]
        if not 0.0 <= unit[j] <= 1.0:
            # Corana et al.: a move that leaves the box is replaced by a uniform draw.
            unit[j] = fallback
        return unit

    def move(self, j: int, there: Point, temperature: float, chance: float) -> None:
        """Accept a move, or stay."""
        rise = there.fitness - self.here.fitness if math.isfinite(there.fitness) else math.inf
        accepts = there.fitness <= self.here.fitness
        if accepts or chance < math.exp(-rise / temperature):
            self.here = there
            self._accepted[j] += 1.0
            if there.fitness < self.best.fitness:
                self.best = there

    def adapt(self, cycles: int) -> None:
        """Adapt the steps to the accepted moves, and return to the best."""
        share = self._accepted / cycles
        longer = 1.0 + _STEP_CHANGE * (share - 0.6) / 0.4
        shorter = 1.0 / (1.0 + _STEP_CHANGE * (0.4 - share) / 0.4)
        factor = np.where(share > 0.6, longer, np.where(share < 0.4, shorter, 1.0))
        self.steps = np.clip(self.steps * factor, self._axes.least, 1.0)
        self.here = self.best
        self._accepted[:] = 0.0


METHOD = from_generator(
    AnnealingSettings,
    "Simulated annealing with adapted steps (Corana et al. 1987), cooling over the budget",
    annealing,
)
