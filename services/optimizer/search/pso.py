"""Particle swarm optimization (thesis 3.4.1, 4.4.1), and its presets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeInt, model_validator

from gaitswarm.services.optimizer.search.generational import (
    Generational,
    GenerationState,
    Row,
    Worth,
    of_worth,
    worth,
)
from gaitswarm.services.optimizer.search.optimizer import SearchSettings, matrix
from gaitswarm.services.optimizer.search.random_stream import swarm_uniform
from gaitswarm.services.optimizer.search.space import Space

_SCATTER: Final = 1
_MOVE: Final = 2
_INFORM: Final = 4
"""Purposes of random streams: never renumbered, or stored jobs would change their future."""

_INITIAL_VELOCITY: Final = 0.1
"""Share of each variable's range."""


class SwarmSettings(SearchSettings):
    """Settings of a swarm's motion, for methods that have a swarm."""

    particles: int = Field(default=25, ge=1, le=10_000, description="Size of the swarm.")
    cognitive: float = Field(default=0.5, ge=0.0, le=10.0, description="Pull to a particle's best.")
    social: float = Field(default=1.5, ge=0.0, le=10.0, description="Pull to the swarm's best.")
    inertia_start: float = Field(default=0.9, ge=0.0, le=2.0, description="Inertia at the start.")
    inertia_end: float = Field(default=0.9, ge=0.0, le=2.0, description="Inertia at the end.")
    velocity_limit: float = Field(
        default=0.5,
        gt=0.0,
        le=1.0,
        description="Largest step, as a share of each variable's range.",
    )
    bounds: Literal["absorb", "reflect"] = Field(
        default="reflect", description="What happens to a particle that leaves the box."
    )
    topology: Literal["global", "ring", "random"] = Field(
        default="global",
        description="Which particles inform a particle: all, both neighbours, or random ones that"
        " change when the swarm's best does not improve.",
    )
    informants: int = Field(
        default=3,
        ge=1,
        le=100,
        description="Particles that each particle informs in the random topology.",
    )

    @model_validator(mode="after")
    def _inertia_falls(self) -> Self:
        if self.inertia_end > self.inertia_start:
            raise ValueError("inertia_end must not exceed inertia_start: inertia never rises")
        return self


class PsoSettings(SwarmSettings):
    """Settings of the particle swarm; the thesis's by default."""

    name: Literal["pso"] = "pso"


class _SwarmState(GenerationState):
    """The dumped state.

    Attributes:
        best_fitness: None where a particle has not succeeded yet.
        informed_since: Generation whose random numbers determine the informants.
    """

    velocities: list[Row]
    best_positions: list[Row]
    best_fitness: Worth
    informed_since: NonNegativeInt = 0


class ParticleSwarm(Generational[SwarmSettings, _SwarmState]):
    """A swarm that remembers the best position of each particle.

    It moves in the continuous box, in the variables' own units. Positions stay real in integer
    variables, so that a particle keeps its velocity while it crosses the width of an integer. A
    velocity is the change of position in one iteration.

    Attributes:
        best_positions: (particles, d) best position of each particle.
        best_fitness: (particles,) fitness of these, +inf for a particle that never succeeded.
    """

    state_model = _SwarmState
    schema_version = 2

    def __init__(self, settings: SwarmSettings, space: Space, budget: int, seed: int) -> None:
        """Create a swarm that has not been asked yet."""
        super().__init__(settings, space, budget, seed)
        self._velocities = np.zeros((settings.particles, space.dimension))
        self.best_positions = np.tile(space.low, (settings.particles, 1))
        self.best_fitness = np.full(settings.particles, np.inf)
        self._informed_since = 0

    def propose(self) -> NDArray[np.float64]:
        """Sample the swarm, or move it."""
        return self._moved() if self.generations else self._scattered()

    def learn(self, positions: NDArray[np.float64], fitness: NDArray[np.float64]) -> None:
        """Update the best of each particle."""
        self._remember(self.generations, positions, fitness)

    def rejudge(
        self, generations: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]]
    ) -> None:
        """Recompute the best of each particle from another fitness of its positions.

        Positions and velocities stay.
        """
        shape = self.best_positions.shape
        whole = all(positions.shape == shape for positions, _ in generations)
        if len(generations) != self.generations or self.iteration != self.generations or not whole:
            raise ValueError(f"{self.settings.name} has not received feedback in whole swarms")
        self.best_fitness = np.full(shape[0], np.inf)
        self._informed_since = 0
        for number, (positions, fitness) in enumerate(generations):
            self._remember(number, positions, fitness)

    def _remember(
        self, generation: int, positions: NDArray[np.float64], fitness: NDArray[np.float64]
    ) -> None:
        if not fitness.min() < self.best_fitness.min():
            self._informed_since = generation + 1
        better = fitness < self.best_fitness
        self.best_positions[better] = positions[better]
        self.best_fitness[better] = fitness[better]

    def memory(self) -> dict[str, Any]:
        """Give velocities and bests, and since when informants are what they are."""
        memory = {
            "velocities": self._velocities.tolist(),
            "best_positions": self.best_positions.tolist(),
            "best_fitness": worth(self.best_fitness),
        }
        drawn = self.settings.topology == "random"
        return memory | {"informed_since": self._informed_since} if drawn else memory

    def recall(self, state: _SwarmState) -> None:
        """Take on what `memory` gave."""
        shape = self.best_positions.shape
        # The first generation may be of more start positions than there are particles.
        asked = shape[0] if state.generations else max(shape[0], len(self._start))
        if len(state.positions) not in (0, asked):
            raise ValueError(f"positions: expected {shape[0]} rows of {shape[1]} numbers")
        velocities = matrix(state.velocities, shape, "velocities")
        best = matrix(state.best_positions, shape, "best_positions")
        if len(state.best_fitness) != shape[0]:
            raise ValueError(f"best_fitness: {len(state.best_fitness)} values, not {shape[0]}")
        self.best_positions = self.inside(best, "best_positions")
        self._velocities, self.best_fitness = velocities, of_worth(state.best_fitness)
        self._informed_since = state.informed_since

    def _scattered(self) -> NDArray[np.float64]:
        """Sample uniform positions with small random velocities.

        Small, because a fast swarm spends its first steps at the walls; not zero, because the
        leader, or a swarm in which every member failed, would then stand still.
        """
        draws = self._draw(purpose=_SCATTER)
        space = self.space
        largest = min(_INITIAL_VELOCITY, self.settings.velocity_limit) * space.span
        self._velocities = (2.0 * draws[1] - 1.0) * largest
        return space.from_unit(draws[0])

    def _moved(self) -> NDArray[np.float64]:
        own, swarm = self._draw(purpose=_MOVE)
        settings, space, positions = self.settings, self.space, self.positions
        velocities = self._inertia() * self._velocities
        known = np.isfinite(self.best_fitness)
        to_own_best = np.where(known[:, np.newaxis], self.best_positions - positions, 0.0)
        velocities += settings.cognitive * own * to_own_best
        leader = self._leaders()
        to_leader = self.best_positions[leader] - positions
        velocities += settings.social * swarm * np.where(known[leader, np.newaxis], to_leader, 0.0)
        fastest = settings.velocity_limit * space.span
        velocities = np.clip(velocities, -fastest, fastest)
        at_bounds = absorb if settings.bounds == "absorb" else reflect
        moved, self._velocities = at_bounds(
            positions + velocities, velocities, space.low, space.high
        )
        return moved

    def _leaders(self) -> NDArray[np.intp]:
        """Return (particles,) the best informant of each particle."""
        particles, fitness = self.settings.particles, self.best_fitness
        if self.settings.topology == "global":
            return np.full(particles, np.argmin(fitness))
        if self.settings.topology == "ring":
            return leaders(ring(particles), fitness)
        draws = swarm_uniform(
            self.seed,
            _INFORM,
            iteration=self._informed_since,
            particles=particles,
            count=self.settings.informants,
        )
        return leaders(random_informants(draws), fitness)

    def _inertia(self) -> float:
        """Return the inertia: linear over the planned iterations, then constant."""
        planned = math.ceil(self.budget / self.settings.particles)
        share = min(self.generations / max(planned - 1, 1), 1.0)
        start, end = self.settings.inertia_start, self.settings.inertia_end
        return start + share * (end - start)

    def _draw(self, *, purpose: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Draw two numbers in [0, 1) per particle and coordinate: twice (particles, d)."""
        particles, d = self.best_positions.shape
        draws = swarm_uniform(
            self.seed, purpose, iteration=self.generations, particles=particles, count=2 * d
        )
        return draws[:, :d], draws[:, d:]


def absorb(
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stop particles at the walls."""
    inside = np.clip(positions, low, high)
    return inside, np.where(inside == positions, velocities, 0.0)


def reflect(
    positions: NDArray[np.float64],
    velocities: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Reflect particles at the walls, repeatedly if needed."""
    span = high - low
    outside = (positions < low) | (positions > high)
    phase = np.mod(positions - low, 2.0 * span)
    odd = phase > span
    folded = np.clip(low + np.where(odd, 2.0 * span - phase, phase), low, high)
    return (
        np.where(outside, folded, positions),
        np.where(outside & odd, -velocities, velocities),
    )


Links = tuple[NDArray[np.intp], NDArray[np.intp]]
"""(m,) informing particles and (m,) informed particles. Each particle informs itself."""


def ring(particles: int) -> Links:
    """Link each particle with both neighbours, cyclically ("lbest", Bratton and Kennedy 2007)."""
    every = np.arange(particles)
    informed = [every, (every + 1) % particles, (every - 1) % particles]
    return np.tile(every, 3), np.concatenate(informed)


def random_informants(draws: NDArray[np.float64]) -> Links:
    """Link each particle with random ones (standard swarm of 2011, Clerc 2012).

    A particle may be drawn twice, so the number of informants varies.
    """
    particles, k = draws.shape
    every = np.arange(particles)
    informed = np.floor(draws * particles).astype(np.intp)
    return np.concatenate([every, np.repeat(every, k)]), np.concatenate([every, informed.ravel()])


def leaders(links: Links, fitness: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the best informant of each particle."""
    informs, informed = links
    worst_first = np.argsort(-fitness[informs], kind="stable")
    best = np.empty(len(fitness), dtype=np.intp)
    # If an index is assigned several times, the last value stays.
    best[informed[worst_first]] = informs[worst_first]
    return best
