"""CMA-ES with margin, of the library cmaes, with restarts."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from services.optimizer.search.optimizer import SearchSettings
from services.optimizer.search.random_stream import RandomNumbers
from services.optimizer.search.replayed import Proposals, Start
from services.optimizer.search.space import Space

if TYPE_CHECKING:
    from cmaes import CatCMAwM

Floats = NDArray[np.float64]

_MOST_VALUES: Final = 1_000
"""Values of an integer up to which each is a step of its own; beyond, it is sampled as real."""

_LARGEST_POPULATION: Final = 10_000

_FLAT: Final = 1e-12
"""Share of the fitness by which generations differ in their best that no longer improve."""


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


def cma_es(
    settings: CmaEsSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Search by a normal distribution that adapts to where the better half of its samples is.

    CatCMA with margin (Hamano et al. 2025, arXiv 2504.07884) of the library cmaes: integers and
    choices keep a least chance to change. Only the order of fitness values counts. Where it has
    converged, it starts anew at a random place with a larger population (IPOP, Auger and Hansen
    2005), keeping nothing. Eigenvectors are LAPACK's, so that bits may differ between processors.

    Args:
        settings: Of the method.
        space: The box that is searched.
        budget: Evaluations of the planned run.
        random: Its random numbers.
        start: The first distribution is about the best of these; None: about the box's middle.

    Yields:
        (population, d) positions.
    """
    size = settings.population or 4 + math.floor(3.0 * math.log(space.dimension))
    mean = np.full(space.dimension, 0.5)
    if start is not None and len(start.best_first[0]):
        mean = space.to_unit(start.best_first[0][0])
    while True:
        yield from _descent(_Distribution(space, size, mean, settings.sigma, random.seed()))
        size = min(_LARGEST_POPULATION, math.ceil(size * settings.growth))
        mean = random.uniform(space.dimension)


def _descent(distribution: _Distribution) -> Proposals:
    """Generations until they are all alike, or differ in nothing that counts."""
    bests = deque[float](maxlen=distribution.patience)
    while not distribution.has_converged():
        fitness = yield distribution.sample()
        distribution.learn(fitness)
        bests.append(float(fitness.min()))
        spread = max(bests) - min(bests) if math.isfinite(max(bests)) else math.inf
        if len(bests) == bests.maxlen and spread <= _FLAT * abs(min(bests)):
            return


class _Distribution:
    """CatCMAwM over a box: real, stepped and chosen variables are told apart and put together."""

    def __init__(self, space: Space, size: int, mean: Floats, sigma: float, seed: int) -> None:
        from cmaes import CatCMAwM  # noqa: PLC0415 - an optional extra, and slow to import

        self._space, self._size = space, size
        values = np.where(space.integer, space.span + 1.0, np.inf)
        self._chosen = np.flatnonzero(space.categorical | (values == 2.0))
        self._stepped = np.flatnonzero((values > 2.0) & (values <= _MOST_VALUES))
        others = np.setdiff1d(np.arange(space.dimension), self._chosen)
        self._real = np.setdiff1d(others, self._stepped)
        given: dict[str, Any] = {}
        if len(self._real):
            given["x_space"] = [[0.0, 1.0]] * len(self._real)
        if len(self._stepped):
            given["z_space"] = [np.linspace(0.0, 1.0, round(values[j])) for j in self._stepped]
        if len(self._chosen):
            given["c_space"] = [round(space.span[j]) + 1 for j in self._chosen]
        if len(others):
            order = np.concatenate([self._real, self._stepped])
            given |= {"mean": mean[order], "sigma": sigma, "cov": np.eye(len(others))}
        self._library: CatCMAwM = CatCMAwM(**given, population_size=size, seed=seed)
        self._samples: list[CatCMAwM.Solution] = []

    @property
    def patience(self) -> int:
        """Generations after which one that has not improved gives up (Hansen's TolFun)."""
        return 10 + math.ceil(30 * self._space.dimension / self._size)

    def sample(self) -> Floats:
        """(size, d) positions."""
        space = self._space
        self._samples = [self._library.ask() for _ in range(self._size)]
        unit = np.zeros((self._size, space.dimension))
        for row, sample in zip(unit, self._samples, strict=True):
            if len(self._real):
                row[self._real] = sample.x
            if len(self._stepped):
                row[self._stepped] = sample.z
        designs = space.from_unit(unit)
        for j, column in enumerate(self._chosen):
            # One-hot: which of the choices.
            designs[:, column] = space.low[column] + [np.argmax(s.c[j]) for s in self._samples]
        return space.positions(designs)

    def learn(self, fitness: Floats) -> None:
        """Adapt to the order of the samples' fitness, failed ones last."""
        rank = np.empty(self._size)
        rank[np.argsort(fitness, kind="stable")] = np.arange(self._size, dtype=np.float64)
        self._library.tell(list(zip(self._samples, rank.tolist(), strict=True)))

    def has_converged(self) -> bool:
        """Whether the library would stop; it knows nothing of choices alone."""
        continuous = len(self._real) + len(self._stepped) > 0
        return continuous and bool(self._library.should_stop())
