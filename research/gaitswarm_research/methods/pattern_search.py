"""Pattern search on a mesh, with integers and choices (Torczon 1997; Audet and Dennis 2003)."""

from __future__ import annotations

from collections.abc import Generator, Iterator
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
"""Random starts drawn, at most, before one that was already evaluated is used."""

Polls = Generator[Floats, Floats, None]
"""Yields positions (n, d), n >= 1, receives their fitness (n,), and ends when its mesh is fine."""


class PollSettings(SearchSettings):
    """Settings of the mesh and the poll, for methods that poll."""

    initial_mesh: float = Field(
        default=0.25, gt=0.0, le=1.0, description="First step, as a share of each variable's range."
    )
    mesh_tolerance: float = Field(
        default=1e-8,
        ge=1e-10,
        le=0.1,
        description="Share of the range below which a continuous variable is not changed.",
    )
    expansion: float = Field(
        default=2.0, ge=1.0, le=10.0, description="Factor of the mesh after a success."
    )
    contraction: float = Field(
        default=0.5, ge=0.05, le=0.95, description="Factor of the mesh after a failure."
    )
    polling: Literal["complete", "opportunistic"] = Field(
        default="complete",
        description="Whether a poll is evaluated completely or only until a success.",
    )
    poll_batch: int = Field(
        default=4,
        ge=1,
        le=10_000,
        description="Designs of an opportunistic poll that are evaluated at once.",
    )


def polls(
    settings: PollSettings,
    space: Space,
    start: Floats,
    fitness: float,
    judged: Judged,
    random: RandomNumbers,
) -> Polls:
    """Poll around the best design until the mesh is fine.

    A poll takes a step in both directions of each variable, in random order. The step is the mesh
    size times the variable's range; a step beyond a bound ends at the bound. Integers move by whole
    numbers, at least by one; for a categorical variable, a poll has all other choices. The best
    design becomes the next centre if it is better.

    Args:
        settings: Mesh and polling.
        space: The box that is searched.
        start: (d,) the design to begin at.
        fitness: Fitness of that design.
        judged: Designs that are not asked for again.
        random: Source of all random numbers.

    Returns:
        A generator that yields positions and receives their fitness.
    """
    mesh = settings.initial_mesh
    centre = start
    while True:
        better = False
        for designs in _pieces(_poll(settings, space, centre, mesh), settings, judged, random):
            values = yield space.positions(designs)
            best = int(np.argmin(values))
            if values[best] < fitness:
                centre, fitness, better = designs[best], float(values[best]), True
                break
        if better:
            mesh = min(mesh * settings.expansion, 1.0)
        else:
            single = bool((_integer_steps(space, mesh) == 1.0).all())
            mesh *= settings.contraction
            if single and not _is_continuous_polled(settings, space, mesh):
                return


def _poll(settings: PollSettings, space: Space, centre: Floats, mesh: float) -> Floats:
    """Return (n, d) designs one step from the centre, clipped to the bounds."""
    steps = mesh * space.span
    steps[space.integer] = _integer_steps(space, mesh)
    if mesh < settings.mesh_tolerance:
        steps[~space.integer] = 0.0
    designs = []
    for j in range(space.dimension):
        if space.categorical[j]:
            values = np.arange(space.high[j] + 1.0)
        else:
            values = np.clip(
                centre[j] + np.array([-steps[j], steps[j]]), space.low[j], space.high[j]
            )
        around = np.tile(centre, (len(values), 1))
        around[:, j] = values
        designs.append(around)
    return np.concatenate(designs)


def _integer_steps(space: Space, mesh: float) -> Floats:
    """Return the steps of the integer variables, whole numbers >= 1."""
    steps: Floats = np.maximum(np.rint(mesh * space.span[space.integer]), 1.0)
    return steps


def _is_continuous_polled(settings: PollSettings, space: Space, mesh: float) -> bool:
    return mesh >= settings.mesh_tolerance and not (space.integer | space.categorical).all()


def _pieces(
    poll: Floats, settings: PollSettings, judged: Judged, random: RandomNumbers
) -> Iterator[Floats]:
    """Yield the new designs of a poll in random order, all at once or in batches."""
    poll = poll[random.permutation(len(poll))]
    size = len(poll) if settings.polling == "complete" else settings.poll_batch
    for first in range(0, len(poll), size):
        piece = poll[first : first + size]
        designs = piece[judged.new(piece)]
        if len(designs):
            yield designs


class PatternSearchSettings(PollSettings):
    """Settings of pattern search."""

    name: Literal["ps"] = "ps"


def pattern_search(
    settings: PatternSearchSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Search by polling around the best design on a mesh that grows and shrinks.

    A poll has the 2d coordinate directions, as Matlab's patternsearch has by default. A search
    begins at a random design. When its mesh is below the tolerance and no neighbour in the integers
    and choices is better, it restarts at another design and keeps nothing. A random design that
    fails is abandoned at once.
    """
    judged = Judged(space)
    if start is not None:
        judged.new(space.designs(start.positions))
        positions, fitness = start.best_first
        for centre in space.designs(positions[:1]):
            yield from polls(settings, space, centre, float(fitness[0]), judged, random)
    while True:
        designs = _random_design(space, random, judged)
        fitness = yield space.positions(designs)
        if np.isfinite(fitness[0]):
            yield from polls(settings, space, designs[0], float(fitness[0]), judged, random)


def _random_design(space: Space, random: RandomNumbers, judged: Judged) -> Floats:
    """Draw (1, d) a design that was not evaluated yet, if one is found soon."""
    design = space.designs(space.evenly(random.uniform(1, space.dimension)))
    for _ in range(_DRAWS - 1):
        if judged.new(design)[0]:
            break
        design = space.designs(space.evenly(random.uniform(1, space.dimension)))
    return design


METHOD = from_generator(
    PatternSearchSettings,
    "Generalized pattern search on a mesh (Torczon 1997; Audet and Dennis 2003)",
    pattern_search,
)
