"""A particle swarm, then pattern search from its best (thesis 3.2.2)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.plugins import (
    ParticleSwarm,
    Proposals,
    RandomNumbers,
    Space,
    Start,
    SwarmSettings,
    from_generator,
)
from gaitswarm_research.methods.judged import Judged
from gaitswarm_research.methods.pattern_search import Polls, PollSettings, polls

Floats = NDArray[np.float64]


class PsoPsSettings(SwarmSettings, PollSettings):
    """Settings of the hybrid: those of swarm and polls, and of the change between them."""

    name: Literal["pso-ps"] = "pso-ps"
    inertia_end: float = Field(default=0.7, ge=0.0, le=2.0, description="Inertia at the end.")
    swarm_share: float = Field(
        default=0.5, gt=0.0, lt=1.0, description="Share of the budget of the swarm."
    )
    searches: int = Field(
        default=1,
        ge=1,
        le=100,
        description="Number of the swarm's best designs that pattern searches start from.",
    )
    initial_mesh: float = Field(
        default=0.0625,
        gt=0.0,
        le=1.0,
        description="First step of a pattern search, as a share of each variable's range.",
    )


def pso_ps(
    settings: PsoPsSettings,
    space: Space,
    budget: int,
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Search by a swarm, then by pattern searches from the best positions of its particles.

    In the thesis's hybrid, pattern search runs after the swarm. PSwarm (Vaz and Vicente 2007) polls
    within the swarm instead, whenever an iteration does not improve its best.

    The pattern searches take turns: each batch has one poll of each. When all have ended, the
    method restarts with another swarm and keeps nothing.
    """
    iterations = max(round(settings.swarm_share * budget / settings.particles), 1)
    while True:
        swarm = ParticleSwarm(settings, space, iterations * settings.particles, random.seed())
        judged = Judged(space)
        if start is not None:
            judged.new(space.designs(start.positions))
            _begin(swarm, start)
            start = None
        while swarm.state.generations < iterations:
            positions = swarm.ask()
            judged.new(space.designs(positions))
            swarm.tell((yield positions))
        starts, worth = best_members(swarm, settings.searches)
        yield from _in_turns(
            [
                polls(settings, space, start, fitness, judged, random)
                for start, fitness in zip(starts, worth.tolist(), strict=True)
            ]
        )


def _begin(swarm: ParticleSwarm, start: Start) -> None:
    """Feed start positions with their fitness to a swarm."""
    swarm.start_from(start.positions)
    fitness = start.fitness
    while len(fitness):
        asked = len(swarm.ask(len(fitness)))
        swarm.tell(fitness[:asked])
        fitness = fitness[asked:]


def best_members(swarm: ParticleSwarm, count: int) -> tuple[Floats, Floats]:
    """Return the best distinct designs of a swarm and their fitness."""
    fitness = swarm.state.best_fitness
    designs = swarm.space.designs(swarm.state.best_positions)
    order = np.argsort(fitness, kind="stable")
    order = order[np.isfinite(fitness[order])]
    order = order[Judged(swarm.space).new(designs[order])][:count]
    return designs[order], fitness[order]


def _in_turns(searches: list[Polls]) -> Polls:
    """Combine one poll of each search to a batch, until all have ended."""
    under_way = [(search, poll) for search in searches if (poll := next(search, None)) is not None]
    while under_way:
        fitness = yield np.concatenate([poll for _, poll in under_way])
        ends = np.cumsum([len(poll) for _, poll in under_way])[:-1]
        feedback = zip(under_way, np.split(fitness, ends), strict=True)
        under_way = [
            (search, poll)
            for (search, _), values in feedback
            if (poll := _next_poll(search, values)) is not None
        ]


def _next_poll(search: Polls, fitness: Floats) -> Floats | None:
    try:
        return search.send(fitness)
    except StopIteration:
        return None


METHOD = from_generator(
    PsoPsSettings,
    "Particle swarm, then pattern search from its best designs (thesis 3.2.2)",
    pso_ps,
)
