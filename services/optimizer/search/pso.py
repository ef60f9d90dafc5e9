"""Particle swarm optimization (thesis 3.4.1, 4.4.1), and its presets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeInt, model_validator

from gaitswarm.services.optimizer.search import optimizer as base
from gaitswarm.services.optimizer.search.random_stream import swarm_uniform
from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim.arrays import Floats

_SCATTER: Final = 1
_MOVE: Final = 2
_INFORM: Final = 4
"""Purposes of random streams: never renumbered, or stored jobs would change their future."""

_INITIAL_VELOCITY: Final = 0.1
"""Share of each variable's range."""


class SwarmSettings(base.SearchSettings):
    """Settings of a swarm's motion, for methods that have a swarm."""

    particles: int = Field(default=25, ge=1, le=10_000, description="Size of the swarm.")
    cognitive: float = Field(default=0.5, ge=0.0, le=10.0, description="Pull to a particle's best.")
    social: float = Field(default=1.5, ge=0.0, le=10.0, description="Pull to the swarm's best.")
    inertia_start: float = Field(default=0.9, ge=0.0, le=2.0, description="Inertia at the start.")
    inertia_end: float = Field(default=0.9, ge=0.0, le=2.0, description="Inertia at the end.")
    velocity_limit: float = Field(default=0.5, gt=0.0, le=1.0)
    """Largest step, as a share of each variable's range."""
    bounds: Literal["absorb", "reflect"] = "reflect"
    """What happens to a particle that leaves the box."""
    topology: Literal["global", "ring", "random"] = "global"
    """Which particles inform a particle: all, both neighbours, or random ones that change when the
    swarm's best does not improve."""
    informants: int = Field(default=3, ge=1, le=100)
    """Particles that each particle informs in the random topology."""

    @model_validator(mode="after")
    def _inertia_falls(self) -> Self:
        if self.inertia_end > self.inertia_start:
            raise ValueError("inertia_end must not exceed inertia_start: inertia never rises")
        return self


class PsoSettings(SwarmSettings):
    """Settings of the particle swarm; the thesis's by default."""

    name: Literal["pso"] = "pso"


class _SwarmState(base.GenerationState):
    """State of a swarm; `best_fitness` is +inf for a particle that has not succeeded yet."""

    velocities: base.Numbers
    best_positions: base.Points
    best_fitness: base.Fitness
    informed_since: NonNegativeInt = 0
    """Generation whose random numbers determine the informants."""


class ParticleSwarm(base.Generational[SwarmSettings, _SwarmState]):
    """A swarm that remembers the best position of each particle.

    It moves in the continuous box, in the variables' own units. Positions stay real in integer
    variables, so that a particle keeps its velocity while it crosses the width of an integer. A
    velocity is the change of position in one iteration. For `rejudge`, `generations` is the list
    of all positions with their fitness, as in `Rejudging`.
    """

    state_model = _SwarmState
    schema_version = 2

    def begin(self) -> None:
        particles, state = self.settings.particles, self.state
        state.velocities = np.zeros((particles, self.space.dimension))
        state.best_positions = np.tile(self.space.low, (particles, 1))
        state.best_fitness = np.full(particles, np.inf)

    def propose(self) -> Floats:
        return self._moved() if self.state.generations else self._scattered()

    def learn(self, positions: Floats, fitness: Floats) -> None:
        self._remember(self.state.generations, positions, fitness)

    def rejudge(self, generations: Sequence[tuple[Floats, Floats]]) -> None:
        """Recompute the best of each particle; positions and velocities stay."""
        state = self.state
        shape = state.best_positions.shape
        whole = all(positions.shape == shape for positions, _ in generations)
        done = state.generations
        if len(generations) != done or state.iteration != done or not whole:
            raise ValueError(f"{self.settings.name} has not received feedback in whole swarms")
        state.best_fitness = np.full(shape[0], np.inf)
        state.informed_since = 0
        for number, (positions, fitness) in enumerate(generations):
            self._remember(number, positions, fitness)

    def _remember(self, generation: int, positions: Floats, fitness: Floats) -> None:
        state = self.state
        if not fitness.min() < state.best_fitness.min():
            state.informed_since = generation + 1
        better = fitness < state.best_fitness
        state.best_positions[better] = positions[better]
        state.best_fitness[better] = fitness[better]

    def dump(self) -> dict[str, Any]:
        unused = set() if self.settings.topology == "random" else {"informed_since"}
        return self.state.model_dump(exclude=unused)

    def _check(self, state: _SwarmState) -> None:
        super()._check(state)
        particles = self.settings.particles
        # The first generation may be of more start positions than there are particles.
        most = particles if state.generations else max(particles, len(self._start))
        if len(state.positions) not in (0, most):
            raise ValueError(f"positions: expected {particles} rows")
        for name in ("velocities", "best_positions", "best_fitness"):
            if getattr(state, name).shape != getattr(self.state, name).shape:
                raise ValueError(f"{name}: expected those of {particles} particles")

    def _scattered(self) -> Floats:
        """Sample uniform positions with small random velocities: fast ones end at walls."""
        draws = self._draw(purpose=_SCATTER)
        space = self.space
        largest = min(_INITIAL_VELOCITY, self.settings.velocity_limit) * space.span
        self.state.velocities = (2.0 * draws[1] - 1.0) * largest
        return space.from_unit(draws[0])

    def _moved(self) -> Floats:
        own, swarm = self._draw(purpose=_MOVE)
        settings, space, state = self.settings, self.space, self.state
        positions = state.positions
        velocities = self._inertia() * state.velocities
        known = np.isfinite(state.best_fitness)
        to_own_best = np.where(known[:, np.newaxis], state.best_positions - positions, 0.0)
        velocities += settings.cognitive * own * to_own_best
        leader = self._leaders()
        to_leader = state.best_positions[leader] - positions
        velocities += settings.social * swarm * np.where(known[leader, np.newaxis], to_leader, 0.0)
        fastest = settings.velocity_limit * space.span
        velocities = np.clip(velocities, -fastest, fastest)
        at_bounds = absorb if settings.bounds == "absorb" else reflect
        moved, state.velocities = at_bounds(space, positions + velocities, velocities)
        return moved

    def _leaders(self) -> NDArray[np.intp]:
        """Return (particles,) the best informant of each particle."""
        particles, fitness = self.settings.particles, self.state.best_fitness
        if self.settings.topology == "global":
            return np.full(particles, np.argmin(fitness))
        if self.settings.topology == "ring":
            return leaders(ring(particles), fitness)
        since, count = self.state.informed_since, self.settings.informants
        draws = swarm_uniform(self.seed, _INFORM, iteration=since, particles=particles, count=count)
        return leaders(random_informants(draws), fitness)

    def _inertia(self) -> float:
        """Return the inertia: linear over the planned iterations, then constant."""
        planned = math.ceil(self.budget / self.settings.particles)
        share = min(self.state.generations / max(planned - 1, 1), 1.0)
        start, end = self.settings.inertia_start, self.settings.inertia_end
        return start + share * (end - start)

    def _draw(self, *, purpose: int) -> tuple[Floats, Floats]:
        """Draw two numbers in [0, 1) per particle and coordinate: twice (particles, d)."""
        particles, d = self.state.best_positions.shape
        draws = swarm_uniform(
            self.seed, purpose, iteration=self.state.generations, particles=particles, count=2 * d
        )
        return draws[:, :d], draws[:, d:]


def absorb(space: Space, positions: Floats, velocities: Floats) -> tuple[Floats, Floats]:
    """Stop particles at the walls."""
    inside = np.clip(positions, space.low, space.high)
    return inside, np.where(inside == positions, velocities, 0.0)


def reflect(space: Space, positions: Floats, velocities: Floats) -> tuple[Floats, Floats]:
    """Reflect particles at the walls, repeatedly if needed."""
    low, high, span = space.low, space.high, space.span
    outside = (positions < low) | (positions > high)
    phase = np.mod(positions - low, 2.0 * span)
    odd = phase > span
    folded = np.clip(low + np.where(odd, 2.0 * span - phase, phase), low, high)
    turned = np.where(outside & odd, -velocities, velocities)
    return np.where(outside, folded, positions), turned


Links = tuple[NDArray[np.intp], NDArray[np.intp]]
"""(m,) informing particles and (m,) informed particles. Each particle informs itself."""


def ring(particles: int) -> Links:
    """Link each particle with both neighbours, cyclically ("lbest", Bratton and Kennedy 2007)."""
    every = np.arange(particles)
    informed = [every, (every + 1) % particles, (every - 1) % particles]
    return np.tile(every, 3), np.concatenate(informed)


def random_informants(draws: Floats) -> Links:
    """Link each particle with random ones, some twice (standard swarm of 2011, Clerc 2012)."""
    particles, k = draws.shape
    every = np.arange(particles)
    informed = np.floor(draws * particles).astype(np.intp)
    return np.concatenate([every, np.repeat(every, k)]), np.concatenate([every, informed.ravel()])


def leaders(links: Links, fitness: Floats) -> NDArray[np.intp]:
    informs, informed = links
    worst_first = np.argsort(-fitness[informs], kind="stable")
    best = np.empty(len(fitness), dtype=np.intp)
    # If an index is assigned several times, the last value stays.
    best[informed[worst_first]] = informs[worst_first]
    return best
