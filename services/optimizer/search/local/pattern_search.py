"""Pattern search on a mesh, with integers and choices."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.search.optimizer import SearchSettings
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.replayed import Proposals, Start
from gaitswarm.services.optimizer.search.space import Judged, Space

Floats = NDArray[np.float64]

Polls = Generator[Floats, Floats, None]
"""Yields positions (n, d), n >= 1, is sent their fitness (n,), and ends when its mesh is fine."""

_DRAWS: Final = 20
"""Random starts to draw, at most, before one that was judged already is taken."""


class PollSettings(SearchSettings):
    """Settings of the mesh and the poll, for every method that polls."""

    initial_mesh: float = Field(
        default=0.25, gt=0.0, le=1.0, description="First step, as a share of each variable's range."
    )
    mesh_tolerance: float = Field(
        default=1e-8,
        ge=1e-10,
        le=0.1,
        description="Share of the range below which a continuous variable is left as it is.",
    )
    expansion: float = Field(
        default=2.0, ge=1.0, le=10.0, description="Factor of the mesh after a success."
    )
    contraction: float = Field(
        default=0.5, ge=0.05, le=0.95, description="Factor of the mesh after a failure."
    )
    polling: Literal["complete", "opportunistic"] = Field(
        default="complete",
        description="Whether all of a poll is judged, or the rest is dropped after a success.",
    )
    poll_batch: int = Field(
        default=4,
        ge=1,
        le=10_000,
        description="Designs of an opportunistic poll that are judged at once.",
    )


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

    Generalized pattern search (Torczon 1997; Audet and Dennis 2003) with the 2d coordinate
    directions, which Matlab's patternsearch has by default, too. A search begins at a random
    design. When its mesh is below the tolerance, and no neighbour in the integers and choices is
    better, it begins anew at another one and keeps nothing. A random design that fails is left at
    once.
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


def polls(
    settings: PollSettings,
    space: Space,
    start: Floats,
    fitness: float,
    judged: Judged,
    random: RandomNumbers,
) -> Polls:
    """Poll around the best design until the mesh is fine.

    A poll takes one step forth and back in every variable, each on its own, in random order. The
    step is the mesh size times the variable's range; a step beyond a bound ends at it. Integers go
    by whole numbers, at least by one; of a categorical variable, a poll has all other choices. The
    best design that is better becomes the next centre.
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
    """(n, d) designs one step from the centre, those beyond a bound brought to it."""
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
    """Steps of the integer variables, whole and at least one."""
    steps: Floats = np.maximum(np.rint(mesh * space.span[space.integer]), 1.0)
    return steps


def _is_continuous_polled(settings: PollSettings, space: Space, mesh: float) -> bool:
    return mesh >= settings.mesh_tolerance and not (space.integer | space.categorical).all()


def _pieces(
    poll: Floats, settings: PollSettings, judged: Judged, random: RandomNumbers
) -> Iterator[Floats]:
    """What of a poll is new, in random order, as much at once as the polling wants."""
    poll = poll[random.permutation(len(poll))]
    size = len(poll) if settings.polling == "complete" else settings.poll_batch
    for first in range(0, len(poll), size):
        piece = poll[first : first + size]
        designs = piece[judged.new(piece)]
        if len(designs):
            yield designs


def _random_design(space: Space, random: RandomNumbers, judged: Judged) -> Floats:
    """(1, d) a design that was not judged yet, if one is found soon."""
    design = space.designs(space.evenly(random.uniform(1, space.dimension)))
    for _ in range(_DRAWS - 1):
        if judged.new(design)[0]:
            break
        design = space.designs(space.evenly(random.uniform(1, space.dimension)))
    return design
