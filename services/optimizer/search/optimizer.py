"""The port of a search method: ask, tell, dump, load."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gaitswarm.services.optimizer.search.space import Space
from gaitswarm.sim.input import message_of


class SearchSettings(BaseModel):
    """What the settings of every method have."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: str
    particles: int = Field(
        default=25, ge=1, le=10_000, description="Designs of one iteration, at most."
    )


class Optimizer(Protocol):
    """A batch optimizer over a box. Knows nothing of storage, simulation or processes.

    call    state before    state after     returns
    ask()   idle at k       asked at k      positions (n, d), 1 <= n <= particles
    ask()   asked at k      asked at k      the same positions again
    tell(f) asked at k      idle at k + 1   -
    dump()  any             unchanged       JSON-able state, exact to the bit

    `start_from` comes before all of these, if at all.

    It is a function of its settings, space, budget, seed and start, and of what it was told: equal
    state, equal future. The path does not depend on how many positions an ask was allowed to give:
    what is asked in pieces is learned from when it is whole. It never ends by itself; a method that
    has converged starts anew from elsewhere. A fitness of +inf (a failed evaluation) never becomes
    a best.
    """

    @property
    def iteration(self) -> int:
        """Number of completed tells."""

    @property
    def evaluations(self) -> int:
        """Number of positions that were told, in all."""

    def start_from(self, positions: NDArray[np.float64]) -> None:
        """Begin with positions that are known to be good: they are the first that are asked for.

        Args:
            positions: (k, d), in the variables' own units; of none the search begins as ever.

        Raises:
            ValueError: One is outside the bounds or of another dimension, or something was asked
                for already.
        """

    def ask(self, most: int | None = None) -> NDArray[np.float64]:
        """Give the positions to evaluate next; the same ones again until they are told.

        Args:
            most: Positions to give, at most, >= 1; what is asked already stays. Default: the
                settings' `particles`, which also is the limit.

        Returns:
            (n, d), inside the bounds, in the variables' own units.
        """

    def tell(self, fitness: NDArray[np.float64]) -> None:
        """Take what the positions last asked for are worth.

        Args:
            fitness: (n,) of each of them, minimized; +inf for a failed evaluation. A method that is
                multi-objective (see `registry.Method`) is told (n, M) objective vectors, each
                number minimized; one with any +inf is that of a failed evaluation.

        Raises:
            ValueError: nothing was asked for, the shape is another, or a value is NaN or -inf.
        """

    def dump(self) -> dict[str, Any]:
        """Give the whole state.

        Returns:
            JSON-able values with a schema version, from which `load` makes the same future.
        """

    def load(self, state: dict[str, Any]) -> None:
        """Take on a state.

        Args:
            state: as `dump` gave it, for the same settings, space, budget, seed and start.

        Raises:
            ValueError: it is of another method, version or shape, or outside the bounds; the state
                before is kept.
        """


@runtime_checkable
class Rejudging(Optimizer, Protocol):
    """A method whose memory can be formed anew, as if its positions had been worth something else.

    It stays where it is, and goes on from there by the other fitness.
    """

    def rejudge(
        self, generations: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]]
    ) -> None:
        """Take what earlier positions are worth, in place of what was told of them.

        Args:
            generations: (n, d) positions and (n,) fitness, +inf for a failed evaluation, of
                everything that was told, in order.

        Raises:
            ValueError: This is not all that was told, or a generation was not told as a whole.
        """


def checked_fitness(
    fitness: NDArray[np.float64], asked: int, objectives: int | None = None
) -> NDArray[np.float64]:
    """Check what is told.

    Args:
        fitness: Of the positions last asked for.
        asked: How many those are, 0 if there are none.
        objectives: Numbers of an objective vector; None for a method that is told one fitness.

    Returns:
        (asked,), or (asked, objectives); a copy.

    Raises:
        ValueError: Nothing was asked for, the shape is another, or a value is NaN or -inf.
    """
    if not asked:
        raise ValueError("tell() before ask(): there are no positions that this belongs to")
    shape = (asked,) if objectives is None else (asked, objectives)
    if fitness.shape != shape:
        raise ValueError(
            f"fitness has shape {fitness.shape}, not {shape}; {asked} positions were asked for"
        )
    if np.isnan(fitness).any() or np.isneginf(fitness).any():
        raise ValueError("fitness must be finite, or +inf for a failed evaluation")
    return np.array(fitness, dtype=np.float64)


def checked_start(
    positions: NDArray[np.float64], space: Space, *, begun: bool
) -> NDArray[np.float64]:
    """Check the positions that a search is to begin with.

    Args:
        positions: Those of `Optimizer.start_from`.
        space: The box that is searched.
        begun: Whether something was asked for already.

    Returns:
        (k, d), a copy.

    Raises:
        ValueError: One is outside the bounds or of another dimension, or the search has begun.
    """
    if begun:
        raise ValueError("start_from() after ask(): the search has begun already")
    if positions.ndim != 2 or positions.shape[1] != space.dimension:
        raise ValueError(f"start: shape {positions.shape}, not (k, {space.dimension})")
    if not ((positions >= space.low) & (positions <= space.high)).all():
        raise ValueError("start: outside the bounds of this job")
    return np.array(positions, dtype=np.float64)


M = TypeVar("M", bound=BaseModel)


def parse_state(state: dict[str, Any], optimizer: str, model: type[M]) -> M:
    """Read a dumped state.

    Args:
        state: what `Optimizer.dump` gave.
        optimizer: name of the method, for messages.
        model: of its state.

    Returns:
        The state as an object of the model.

    Raises:
        ValueError: it is not a state of that method; names the field.
    """
    try:
        return model.model_validate(state)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ValueError(f"not a state of {optimizer}: {where}: {message_of(first)}") from error


def matrix(rows: list[list[float]], shape: tuple[int, ...], name: str) -> NDArray[np.float64]:
    """Read an array of a dumped state.

    Args:
        rows: n lists of d numbers.
        shape: (n, d) that is wanted.
        name: of the field, for messages.

    Returns:
        (n, d), a new array.

    Raises:
        ValueError: the rows have another shape.
    """
    if len(rows) != shape[0] or any(len(row) != shape[1] for row in rows):
        raise ValueError(f"{name}: expected {shape[0]} rows of {shape[1]} numbers")
    return np.array(rows, dtype=np.float64).reshape(shape)
