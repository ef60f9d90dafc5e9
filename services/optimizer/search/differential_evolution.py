"""L-SHADE: differential evolution with success-history adaptation and a shrinking population."""

from __future__ import annotations

import math
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeInt, model_validator

from gaitswarm.services.optimizer.search import optimizer as base
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim.arrays import Floats

_EVOLVE: Final = 4
"""Purpose of random streams: never renumbered, or stored jobs would change their future."""

_SPREAD: Final = 0.1
"""Spread of scale and crossover around remembered values (Tanabe and Fukunaga 2014)."""

_DRAWS: Final = 6
"""Number of scales drawn; the first positive one is used."""

_CONVERGED: Final = 1e-9
"""Extent of a population, as a share of each variable's range, below which it restarts."""


class DeSettings(base.SearchSettings):
    """Settings of differential evolution."""

    name: Literal["de"] = "de"
    population: int = Field(default=25, ge=4, le=10_000)
    """Members of the population at the start."""
    population_end: int = Field(default=4, ge=4, le=10_000)
    """Members at the end of the budget; their number falls linearly."""
    best_share: float = Field(default=0.1, gt=0.0, le=1.0)
    """Share of the best members that a member moves towards."""
    archive: float = Field(default=1.0, ge=0.0, le=10.0)
    """Size of the archive of replaced members, in populations."""
    adaptation: Literal["success-history", "none"] = "success-history"
    """Whether scale and crossover are learned from successful trials."""
    memory: int = Field(default=10, ge=1, le=1_000)
    """Successful generations that are remembered."""
    scale: float = Field(default=0.5, gt=0.0, le=1.0)
    """Initial scale of differences, F."""
    crossover: float = Field(default=0.9, ge=0.0, le=1.0)
    """Initial probability of a variable to be changed, CR."""

    @model_validator(mode="after")
    def _population_falls(self) -> DeSettings:
        if self.population_end > self.population:
            raise ValueError("population_end must not exceed population: it never grows")
        return self


class _PopulationState(base.GenerationState):
    """State of a population, which is empty before its first generation is evaluated."""

    began: NonNegativeInt
    """Evaluations before this population."""
    members: base.Points
    member_fitness: base.Fitness
    archive: base.Points
    """Positions that were replaced."""
    scales: base.Numbers
    crossovers: base.Numbers
    successes: NonNegativeInt
    """Number of successful generations."""


class DifferentialEvolution(base.Generational[DeSettings, _PopulationState]):
    """A population in which each member is replaced by its trial if that is no worse.

    L-SHADE (Tanabe and Fukunaga, CEC 2014): current-to-pbest/1 with an archive, binomial crossover,
    success-history adaptation, and a population that shrinks over the budget so that it converges.

    Members are real in integer variables, too. A trial whose design the population or another trial
    already has gets one random variable. A population that has converged is replaced by a new one.
    """

    state_model = _PopulationState

    @property
    def first_size(self) -> int:
        return self.settings.population

    def begin(self) -> None:
        settings, state, d = self.settings, self.state, self.space.dimension
        state.began = state.evaluations
        state.members, state.member_fitness = np.empty((0, d)), np.empty(0)
        state.archive = np.empty((0, d))
        state.scales = np.full(settings.memory, settings.scale)
        state.crossovers = np.full(settings.memory, settings.crossover)
        state.successes = 0

    def propose(self) -> Floats:
        random, members = self._random(), self.state.members
        if not len(members):
            return latin_hypercube(self.space, self.settings.population, random)
        scale, crossover = self._parameters(random)
        trials = crossed(members, self._mutants(random, scale), crossover, random)
        return without_duplicates(self.space, members, trials, random)

    def learn(self, positions: Floats, fitness: Floats) -> None:
        state = self.state
        if len(state.members):
            self._select(positions, fitness)
        else:
            state.members, state.member_fitness = positions.copy(), fitness.copy()
        self._shrink()
        if has_converged(self.space, state.members):
            self.begin()

    def _check(self, state: _PopulationState) -> None:
        super()._check(state)
        settings, size = self.settings, len(state.members)
        least = settings.population_end if size else 0
        if not least <= size <= settings.population:
            raise ValueError(f"members: {size} of them, not {least} to {settings.population}")
        lengths = {"member_fitness": size, "scales": settings.memory, "crossovers": settings.memory}
        for name, length in lengths.items():
            if getattr(state, name).shape != (length,):
                raise ValueError(f"{name}: expected {length} of them")
        judged, asked = len(state.fitness), len(state.positions)
        whole = {size or settings.population}
        if not state.generations:
            # It may be of more start positions than there are members.
            whole.add(len(self._start))
        if judged < asked and asked not in whole:
            raise ValueError(f"positions: {asked} of them under way for {size} members")

    def _random(self) -> RandomNumbers:
        """Return the random numbers of this generation."""
        return RandomNumbers(self.seed, _EVOLVE, iteration=self.state.generations)

    def _parameters(self, random: RandomNumbers) -> tuple[Floats, Floats]:
        """Draw (n,) scales and (n,) crossovers; the first numbers of a generation."""
        n = len(self.state.members)
        chosen = indices(random.uniform(n), self.settings.memory)
        scales, crossovers = self.state.scales[chosen], self.state.crossovers[chosen]
        if self.settings.adaptation == "none":
            return scales, crossovers
        crossover = np.clip(crossovers + _SPREAD * random.normal(n), 0.0, 1.0)
        # The ratio of two normal numbers is Cauchy distributed.
        cauchy = random.normal(n, _DRAWS) / random.normal(n, _DRAWS)
        drawn = scales[:, np.newaxis] + _SPREAD * cauchy
        scale = drawn[np.arange(n), np.argmax(drawn > 0.0, axis=1)]
        return np.minimum(np.where(scale > 0.0, scale, scales), 1.0), crossover

    def _mutants(self, random: RandomNumbers, scale: Floats) -> Floats:
        """Move members towards one of the best and by a difference of two others."""
        space, members = self.space, self.state.members
        n, me = len(members), np.arange(len(members))
        order = np.argsort(self.state.member_fitness, kind="stable")
        best_count = min(n, max(2, round(self.settings.best_share * n)))
        best = members[order[indices(random.uniform(n), best_count)]]
        one = (me + 1 + indices(random.uniform(n), n - 1)) % n
        pool = np.concatenate([members, self.state.archive])
        other = indices(random.uniform(n), len(pool) - 2)
        # Excludes the member itself and the first of the two.
        other += other >= np.minimum(me, one)
        other += other >= np.maximum(me, one)
        first, second = members[one], pool[other]
        factor = scale[:, np.newaxis]
        mutants = members + factor * (best - members) + factor * (first - second)
        mutants = np.where(mutants < space.low, 0.5 * (space.low + members), mutants)
        mutants = np.where(mutants > space.high, 0.5 * (space.high + members), mutants)
        return with_choices(space, mutants, (best, first, second), random)

    def _select(self, trials: Floats, fitness: Floats) -> None:
        """Replace members by trials that are no worse."""
        state = self.state
        before, better = state.member_fitness, fitness < state.member_fitness
        if better.any():
            state.archive = np.concatenate([state.archive, state.members[better]])
            self._remember(better, gains(before, fitness))
        taken = fitness <= before
        state.members = np.where(taken[:, np.newaxis], trials, state.members)
        state.member_fitness = np.where(taken, fitness, before)

    def _remember(self, better: NDArray[np.bool_], gain: Floats) -> None:
        """Replace the oldest memory by successful values, weighted by their gains."""
        if self.settings.adaptation == "none":
            return
        state = self.state
        scale, crossover = self._parameters(self._random())
        place = state.successes % self.settings.memory
        state.scales[place] = lehmer_mean(scale[better], gain[better])
        state.crossovers[place] = lehmer_mean(crossover[better], gain[better])
        state.successes += 1

    def _shrink(self) -> None:
        """Remove the worst members, and the oldest of the archive."""
        settings, state = self.settings, self.state
        done = (state.evaluations - state.began) / max(1, self.budget - state.began)
        fall = settings.population - settings.population_end
        planned = settings.population - round(fall * min(1.0, done))
        kept = np.sort(np.argsort(state.member_fitness, kind="stable")[:planned])
        state.members, state.member_fitness = state.members[kept], state.member_fitness[kept]
        room = round(settings.archive * len(kept))
        state.archive = state.archive[max(0, len(state.archive) - room) :]


def gains(before: Floats, after: Floats) -> Floats:
    """Return by how much trials are better than their members."""
    known = np.isfinite(before) & np.isfinite(after)
    gain = np.where(known, np.where(known, before, 0.0) - np.where(known, after, 0.0), 0.0)
    greatest = float(gain.max()) if (gain > 0.0).any() else 1.0
    return np.where(np.isfinite(after) & ~np.isfinite(before), greatest, gain)


def lehmer_mean(values: Floats, weights: Floats) -> float:
    """Return the weighted Lehmer mean; exact sums make it independent of the order."""
    total = math.fsum(weights * values)
    return math.fsum(weights * values * values) / total if total > 0.0 else 0.0


_ANY_CHOICE: Final = 0.1
"""Probability that a changed categorical variable takes a random choice."""


def has_converged(space: Space, members: Floats) -> bool:
    return bool((np.ptp(space.to_unit(members), axis=0) < _CONVERGED).all())


def latin_hypercube(space: Space, count: int, random: RandomNumbers) -> Floats:
    """Sample positions with one in each of `count` equal parts of every variable."""
    d = space.dimension
    cells = np.array([random.permutation(count) for _ in range(d)], dtype=np.float64).T
    return space.evenly((cells + random.uniform(count, d)) / count)


def with_choices(
    space: Space, mutants: Floats, givers: tuple[Floats, Floats, Floats], random: RandomNumbers
) -> Floats:
    """Set the choices of mutants, which have no differences: a giver's, or a random one."""
    lot, share = random.uniform(*mutants.shape), (1.0 - _ANY_CHOICE) / 3.0
    conditions = [lot < share, lot < 2.0 * share, lot < 3.0 * share]
    anything = space.from_unit((lot - 3.0 * share) / _ANY_CHOICE)
    return np.where(space.categorical, np.select(conditions, list(givers), anything), mutants)


def crossed(parents: Floats, mutants: Floats, crossover: Floats, random: RandomNumbers) -> Floats:
    """Apply binomial crossover with at least one variable of the mutant."""
    n, d = mutants.shape
    changed = random.uniform(n, d) < crossover[:, np.newaxis]
    changed[np.arange(n), indices(random.uniform(n), d)] = True
    return np.where(changed, mutants, parents)


def without_duplicates(
    space: Space, members: Floats, trials: Floats, random: RandomNumbers
) -> Floats:
    """Randomize one variable of each trial whose design a member or another trial has."""
    n, d = trials.shape
    variable, anything = indices(random.uniform(n), d), space.evenly(random.uniform(n, d))
    seen = {design.tobytes() for design in space.designs(members)}
    for i, design in enumerate(space.designs(trials)):
        if design.tobytes() in seen:
            trials[i, variable[i]] = anything[i, variable[i]]
        seen.add(space.designs(trials[i : i + 1]).tobytes())
    return trials


def indices(uniform: Floats, count: int) -> NDArray[np.intp]:
    """Convert uniform numbers to indices below `count`."""
    return (uniform * count).astype(np.intp)
