"""CMA-ES with diagonal acceleration and a margin for integers and choices, with restarts."""

from __future__ import annotations

import math
import statistics
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeInt

from gaitswarm.services.optimizer.search.evolution.normal_distribution import (
    DistributionState,
    NormalDistribution,
)
from gaitswarm.services.optimizer.search.generational import (
    Generational,
    GenerationState,
    Worth,
    of_worth,
)
from gaitswarm.services.optimizer.search.generational import worth as as_json
from gaitswarm.services.optimizer.search.optimizer import SearchSettings
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.space import Space

Floats = NDArray[np.float64]

_SAMPLE: Final = 5
_RESTART: Final = 6
"""Purposes of random streams: never renumbered, or stored jobs would change their future."""

_LARGEST_POPULATION: Final = 10_000

_FLAT: Final = 1e-4
"""Share of the fitness that generations gain, at most, if they gain nothing that counts."""


class CmaEsSettings(SearchSettings):
    """Settings of CMA-ES."""

    name: Literal["cma-es"] = "cma-es"
    population: int | None = Field(
        default=None,
        ge=4,
        le=_LARGEST_POPULATION,
        description="Designs of a generation. Default: 4 + 3 ln d, for d variables.",
    )
    sigma: float = Field(
        default=0.25,
        gt=0.0,
        le=1.0,
        description="Standard deviation at the start, as a share of each variable's range.",
    )
    growth: float = Field(
        default=2.0,
        ge=1.0,
        le=10.0,
        description="Factor of the population at each restart: 2 is IPOP, 1 keeps it.",
    )


class _CmaEsState(GenerationState):
    """What `dump` writes.

    Attributes:
        restarts: How often a new distribution was begun.
        bests: Least fitness of the latest generations.
        distribution: That is sampled.
    """

    restarts: NonNegativeInt
    bests: Worth
    distribution: DistributionState


class CmaEs(Generational[CmaEsSettings, _CmaEsState]):
    """A normal distribution that adapts to where the better half of its samples is.

    dd-CMA-ES (Akimoto and Hansen 2020): the scale of each variable is learned beside, and faster
    than, how they go together. Only the order of fitness values counts; failures are the last.

    The first distribution is about the box's middle, or about the best of the start positions,
    which are judged before. One that has converged, or stagnates, is given up for another at a
    random place, of a larger population (IPOP, Auger and Hansen 2005), which keeps nothing.
    """

    state_model = _CmaEsState

    def __init__(self, settings: CmaEsSettings, space: Space, budget: int, seed: int) -> None:
        """Create a search that has not been asked yet."""
        super().__init__(settings, space, budget, seed)
        self._restarts = 0
        self._bests: list[float] = []
        self._distribution = self._about(np.full(space.dimension, 0.5))

    @property
    def population(self) -> int:
        """Size of the generations until the next restart."""
        first = self.settings.population or 4 + math.floor(3.0 * math.log(self.space.dimension))
        return min(_LARGEST_POPULATION, math.ceil(first * self.settings.growth**self._restarts))

    @property
    def first_size(self) -> int:
        """Start positions that are learned from, at most."""
        return self.population

    def propose(self) -> Floats:
        """Sample the distribution; before that, judge the start positions."""
        if not self.generations and len(self._start):
            return np.empty((0, self.space.dimension))
        return self._distribution.sample(self._random())

    def learn(self, positions: Floats, fitness: Floats) -> None:
        """Adapt to the samples' order, or begin about the best start position."""
        if not self.generations and len(self._start):
            best = positions[np.argmin(fitness)]
            self._distribution = self._about(self.space.to_unit(best[np.newaxis])[0])
            return
        self._distribution.learn(self._random(), np.argsort(fitness, kind="stable"))
        patience = 10 + math.ceil(30 * self.space.dimension / self.population)
        self._bests = [*self._bests, float(fitness.min())][-patience:]
        if self._distribution.has_converged() or (
            len(self._bests) == patience and self._stagnates()
        ):
            self._restarts += 1
            random = RandomNumbers(self.seed, _RESTART, iteration=self._restarts)
            self._distribution = self._about(random.uniform(self.space.dimension))
            self._bests = []

    def memory(self) -> dict[str, Any]:
        """Give the distribution and what led to it."""
        return {
            "restarts": self._restarts,
            "bests": as_json(self._bests),
            "distribution": self._distribution.dump(),
        }

    def recall(self, state: _CmaEsState) -> None:
        """Take on a distribution."""
        before, self._restarts = self._restarts, state.restarts
        try:
            distribution = self._about(np.full(self.space.dimension, 0.5))
            distribution.load(state.distribution)
        except ValueError:
            self._restarts = before
            raise
        self._distribution, self._bests = distribution, of_worth(state.bests).tolist()

    def _about(self, mean: Floats) -> NormalDistribution:
        """A new distribution about a unit position."""
        return NormalDistribution(self.space, self.population, mean, self.settings.sigma)

    def _random(self) -> RandomNumbers:
        """Numbers of this generation, from the first on."""
        return RandomNumbers(self.seed, _SAMPLE, iteration=self.generations)

    def _stagnates(self) -> bool:
        """Whether the latest third of the generations looked at is no better than the first.

        Neither in its best nor in its median, as in Hansen's tutorial (2016, B.3), which looks at
        more generations. They need not be alike: steps of a surface make them differ for ever.
        """
        third = len(self._bests) // 3
        before, after = self._bests[:third], self._bests[-third:]
        return not any(_gains(of(before), of(after)) for of in (min, statistics.median_high))


def _gains(before: float, after: float) -> bool:
    """Whether one fitness is less than another by what counts."""
    if not math.isfinite(after):
        return False
    return not math.isfinite(before) or before - after > _FLAT * abs(after)
