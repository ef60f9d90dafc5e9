"""The interface of a search method: ask, tell, dump, load."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from pydantic import Field

from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.input import Data


class SearchSettings(Data):
    """Settings that every method has."""

    name: str
    particles: int = Field(
        default=25, ge=1, le=10_000, description="Designs of one iteration, at most."
    )


class Optimizer(Protocol):
    """A batch optimizer over a box, independent of storage, simulation and processes.

    call    state before    state after     returns
    ask()   idle at k       asked at k      positions (n, d), 1 <= n <= particles
    ask()   asked at k      asked at k      the same positions again
    tell(f) asked at k      idle at k + 1   -
    dump()  any             unchanged       JSON-compatible state, exact to the bit

    `start_from`, if it is called at all, precedes all other calls.

    An optimizer is a function of its settings, space, budget, seed, start and feedback: equal
    states have equal futures. Its path does not depend on the sizes of the asks: positions that are
    asked for in pieces are learned from when they are complete. It never ends by itself; a method
    that has converged restarts elsewhere. A fitness of +inf (a failed evaluation) never becomes a
    best.
    """

    @property
    def iteration(self) -> int:
        """Number of completed tells."""

    @property
    def evaluations(self) -> int:
        """Number of positions evaluated so far."""

    def start_from(self, positions: Floats) -> None:
        """Begin with known good positions: they are the first that are asked for.

        Args:
            positions: (k, d), in the variables' own units; k = 0 changes nothing.

        Raises:
            ValueError: A position is outside the bounds or has another dimension, or positions have
                already been asked for.
        """

    def ask(self, most: int | None = None) -> Floats:
        """Return the positions to evaluate next; the same ones until their fitness is known.

        Args:
            most: Largest number of positions, >= 1; positions already asked for stay. Default and
                upper limit: the settings' `particles`.

        Returns:
            (n, d), inside the bounds, in the variables' own units.
        """

    def tell(self, fitness: Floats) -> None:
        """Receive the fitness of the positions that were asked for last.

        Args:
            fitness: (n,), minimized; +inf for a failed evaluation. A multi-objective method (see
                `Method`) receives (n, M) objective vectors, each number minimized; a vector with
                any +inf belongs to a failed evaluation.

        Raises:
            ValueError: Nothing was asked for, the shape differs, or a value is NaN or -inf.
        """

    def dump(self) -> dict[str, Any]:
        """Return the complete state.

        Returns:
            JSON-compatible values with a schema version, from which `load` restores the future.
        """

    def load(self, state: dict[str, Any]) -> None:
        """Restore a state.

        Args:
            state: Result of `dump` for the same settings, space, budget, seed and start.

        Raises:
            ValueError: The state is of another method, version or shape, or outside the bounds; the
                previous state is kept.
        """


@runtime_checkable
class Rejudging(Optimizer, Protocol):
    """A method that can rebuild its memory from another fitness of the same positions.

    It keeps its current positions and continues by the other fitness.
    """

    def rejudge(self, generations: Sequence[tuple[Floats, Floats]]) -> None:
        """Replace the fitness of all positions evaluated so far.

        generations: (n, d) positions and (n,) fitness, +inf for a failed evaluation, of all
        evaluations, in order. Raises ValueError if some are missing or a generation is incomplete.
        """


def stored_state(search: Optimizer) -> dict[str, Any]:
    """Return the dump as the store will return it; raise at once if JSON cannot represent it."""
    stored: dict[str, Any] = json.loads(json.dumps(search.dump(), allow_nan=False))
    return stored


def checked_fitness(fitness: Floats, asked: int, objectives: int | None = None) -> Floats:
    """Return a copy of the argument of `Optimizer.tell`; raises ValueError.

    asked: number of positions asked for last; objectives: length of an objective vector.
    """
    if not asked:
        raise ValueError("tell() before ask(): no positions are waiting for a fitness")
    shape = (asked,) if objectives is None else (asked, objectives)
    if fitness.shape != shape:
        raise ValueError(
            f"fitness has shape {fitness.shape}, not {shape}; {asked} positions were asked for"
        )
    if np.isnan(fitness).any() or np.isneginf(fitness).any():
        raise ValueError("fitness must be finite, or +inf for a failed evaluation")
    return np.array(fitness, dtype=np.float64)


def checked_start(positions: Floats, space: Space, *, begun: bool) -> Floats:
    """Return a copy of the argument of `Optimizer.start_from`; raises ValueError."""
    if begun:
        raise ValueError("start_from() after ask(): the search has already begun")
    if positions.ndim != 2 or positions.shape[1] != space.dimension:
        raise ValueError(f"start: shape {positions.shape}, not (k, {space.dimension})")
    if not ((positions >= space.low) & (positions <= space.high)).all():
        raise ValueError("start: outside the bounds of this job")
    return np.array(positions, dtype=np.float64)
