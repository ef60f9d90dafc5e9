"""HypE: a population selected for the hypervolume it dominates (Bader and Zitzler 2011)."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from gaitswarm.services.optimizer.search import differential_evolution as de
from gaitswarm.services.optimizer.search import optimizer as base
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.sim.arrays import Floats

Indices = NDArray[np.intp]

_VARY: Final = 7
_SAMPLE: Final = 8
"""Purposes of random streams: never renumbered, or stored jobs would change their future."""


class HypeSettings(base.SearchSettings):
    """Settings of HypE."""

    name: Literal["hype"] = "hype"
    population: int = Field(default=40, ge=4, le=500, description="Members of the population.")
    offspring: int = Field(default=25, ge=1, le=500, description="New designs of each generation.")
    scale_least: float = Field(default=0.4, gt=0.0, le=1.0)
    """Least scale of differences, F."""
    scale_most: float = Field(default=0.9, gt=0.0, le=1.0)
    """Greatest scale of differences, F."""
    crossover: float = Field(default=0.9, ge=0.0, le=1.0)
    """Chance of each variable to be changed, CR."""
    samples: int = Field(default=4_000, ge=100, le=20_000)
    """Random points by which hypervolumes are estimated."""

    @model_validator(mode="after")
    def _scales_are_in_order(self) -> HypeSettings:
        if self.scale_least > self.scale_most:
            raise ValueError("scale_least must not exceed scale_most")
        return self


class _PopulationState(base.GenerationState):
    """State of a population, which is empty before its first generation is evaluated."""

    members: base.Points
    vectors: base.Fitness
    """Objective vectors of the members."""


class Hype(base.Generational[HypeSettings, _PopulationState]):
    """A population whose members together dominate the largest hypervolume.

    Selection is that of HypE (Bader and Zitzler 2011): of members and trials together, complete
    Pareto fronts survive as long as there is room; of the next front, the designs with the largest
    hypervolume survive. Variation is that of differential evolution, current-to-best/1: the winner
    of a tournament moves towards another winner and by a difference of two members.

    The fitness that `Generational` handles is (n, M) objective vectors here; a vector with any +inf
    belongs to a failed evaluation.
    """

    state_model = _PopulationState

    @property
    def first_size(self) -> int:
        return self.settings.population

    def begin(self) -> None:
        state = self.state
        state.members, state.vectors = np.empty((0, self.space.dimension)), np.empty((0, 0))

    def _checked(self, fitness: Floats) -> Floats:
        known = self.state.vectors if len(self.state.vectors) else self.state.fitness
        first = known if len(known) else fitness
        objectives = first.shape[1] if first.ndim > 1 else 1
        return base.checked_fitness(fitness, self.state.asked, max(1, objectives))

    def propose(self) -> Floats:
        random = RandomNumbers(self.seed, _VARY, iteration=self.state.generations)
        if not len(self.state.members):
            return de.latin_hypercube(self.space, self.settings.population, random)
        return self._trials(random)

    def learn(self, positions: Floats, fitness: Floats) -> None:
        """Select the next population from members and trials."""
        state = self.state
        pool = np.concatenate([state.members, positions])
        vectors = np.concatenate([state.vectors, fitness]) if len(state.vectors) else fitness
        kept = self.best(vectors, min(len(pool), self.settings.population))
        state.members, state.vectors = pool[kept], vectors[kept]
        if de.has_converged(self.space, state.members):
            self.begin()

    def best(self, fitness: Floats, count: int) -> Indices:
        """Choose complete fronts, and of the next one the largest hypervolume."""
        ranks = pareto_ranks(fitness)
        kept = np.empty(0, dtype=np.intp)
        for rank in range(int(ranks.max()) + 1):
            front = np.flatnonzero(ranks == rank)
            room = count - len(kept)
            if len(front) > room and np.isfinite(fitness[front]).all():
                front = front[self._hypervolume(fitness[front]).chosen(room)]
            kept = np.concatenate([kept, front[:room]])
        return np.sort(kept)

    def _check(self, state: _PopulationState) -> None:
        super()._check(state)
        size, most = len(state.members), self.settings.population
        if size > most:
            raise ValueError(f"members: {size} of them, more than {most}")
        if len(state.vectors) != size:
            raise ValueError(f"vectors: {len(state.vectors)} of them, not {size}")
        for name, vectors in (("vectors", state.vectors), ("fitness", state.fitness)):
            if len(vectors) and (vectors.ndim != 2 or not vectors.size):
                raise ValueError(f"{name}: vectors were expected")
        if size and len(state.fitness) and state.fitness.shape[1] != state.vectors.shape[1]:
            raise ValueError(f"fitness: expected vectors of {state.vectors.shape[1]} numbers")

    def _hypervolume(self, front: Floats) -> SampledHypervolume:
        random = RandomNumbers(self.seed, _SAMPLE, iteration=self.state.generations)
        return SampledHypervolume(front, self.settings.samples, random)

    def _trials(self, random: RandomNumbers) -> Floats:
        """Move winners of tournaments towards others and by differences of any two members."""
        settings, space, members = self.settings, self.space, self.state.members
        n, m = settings.offspring, len(members)
        places = self._places()
        own, towards = (self._winners(places, random) for _ in range(2))
        one, other = (members[de.indices(random.uniform(n), m)] for _ in range(2))
        least, most = settings.scale_least, settings.scale_most
        scale = least + (most - least) * random.uniform(n, 1)
        parents, best = members[own], members[towards]
        # Clipped to the bounds: the best designs often lie at some.
        moved = parents + scale * (best - parents) + scale * (one - other)
        mutants = np.clip(moved, space.low, space.high)
        mutants = de.with_choices(space, mutants, (best, one, other), random)
        trials = de.crossed(parents, mutants, np.full(n, settings.crossover), random)
        return de.without_duplicates(space, members, trials, random)

    def _places(self) -> Indices:
        """Return (m,) places of the members, 0 the best: by front, then by share of it."""
        ranks = pareto_ranks(self.state.vectors)
        shares = np.zeros(len(ranks), dtype=np.int64)
        for rank in range(int(ranks.max()) + 1):
            front = ranks == rank
            if np.isfinite(self.state.vectors[front]).all():
                shares[front] = self._hypervolume(self.state.vectors[front]).shares()
        return np.argsort(np.lexsort((-shares, ranks)))

    def _winners(self, places: Indices, random: RandomNumbers) -> Indices:
        """Return (offspring,) winners of two random members each."""
        n, m = self.settings.offspring, len(places)
        one, other = de.indices(random.uniform(n), m), de.indices(random.uniform(n), m)
        return np.where(places[one] <= places[other], one, other)


_BEYOND: Final = 0.1
"""Distance of the reference point from the nadir, as a share of the range of a front."""

_UNIT: Final = 2.0**32
"""Weight of a sample, as a whole number."""


def pareto_ranks(vectors: Floats) -> Indices:
    """Sort objective vectors into fronts (Deb et al. 2002), all objectives minimized."""
    ranks = np.full(len(vectors), -1, dtype=np.intp)
    left = np.isfinite(vectors).all(axis=1)
    no_worse = np.ones((len(vectors), len(vectors)), dtype=np.bool_)
    for column in vectors.T:
        no_worse &= column[:, np.newaxis] <= column
    dominates = no_worse & ~no_worse.T
    rank = 0
    while left.any():
        front = left & ~dominates[left].any(axis=0)
        ranks[front] = rank
        left &= ~front
        rank += 1
    ranks[ranks < 0] = rank
    return ranks


class SampledHypervolume:
    """The hypervolume that a front dominates, estimated from random points in its scaled box."""

    def __init__(self, front: Floats, samples: int, random: RandomNumbers) -> None:
        low = front.min(axis=0)
        span = front.max(axis=0) - low
        scaled = (front - low) / np.where(span > 0.0, span, 1.0)
        points = random.uniform(samples, front.shape[1]) * (1.0 + _BEYOND)
        covers = np.ones((len(front), samples), dtype=np.bool_)
        for objective, point in zip(scaled.T, points.T, strict=True):
            covers &= objective[:, np.newaxis] <= point
        self._covers: Final = covers

    def shares(self) -> NDArray[np.int64]:
        """Return how many points each vector alone dominates."""
        alone = self._covers.sum(axis=0) == 1
        return np.asarray((self._covers & alone).sum(axis=1), dtype=np.int64)

    def chosen(self, count: int) -> Indices:
        """Choose the vectors that together dominate the largest hypervolume.

        Vectors are removed one by one, always the one with the least expected loss if the other
        vectors to remove were drawn at random (HypE, equations 12 and 13).
        """
        kept = np.arange(len(self._covers))
        covered = self._covers.sum(axis=0)
        while len(kept) > count:
            weights = _weights(len(kept), len(kept) - count)[covered]
            losses = (self._covers[kept] * weights).sum(axis=1)
            gone = int(losses.argmin())
            covered -= self._covers[kept[gone]]
            kept = np.delete(kept, gone)
        return kept


def _weights(size: int, going: int) -> NDArray[np.int64]:
    """Return (size + 1,) weights of a point by the number of vectors that dominate it."""
    weights, chance = np.zeros(size + 1), 1.0
    for others in range(min(size, going)):
        weights[others + 1] = chance / (others + 1)
        chance *= (going - others - 1) / max(1, size - others - 1)
    return np.asarray(np.rint(weights * _UNIT), dtype=np.int64)
