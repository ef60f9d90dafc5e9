"""The port of a search method: ask, tell, dump, load."""

from __future__ import annotations

from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ValidationError


class Optimizer(Protocol):
    """A batch optimizer over a box. Knows nothing of storage, simulation or processes.

    call    state before    state after     returns
    ask()   idle at k       asked at k      positions (particles, d)
    ask()   asked at k      asked at k      the same positions again
    tell(f) asked at k      idle at k + 1   -
    dump()  any             unchanged       JSON-able state, exact to the bit

    All randomness is a function of (seed, iteration, particle); equal state, equal future.
    A fitness of +inf (a failed evaluation) never becomes a best.
    """

    @property
    def iteration(self) -> int:
        """Number of completed tells."""

    def ask(self) -> NDArray[np.float64]:
        """Give the positions to evaluate next; the same ones again until they are told.

        Returns:
            (particles, d), inside the bounds, in the variables' own units.
        """

    def tell(self, fitness: NDArray[np.float64]) -> None:
        """Take what the positions last asked for are worth.

        Args:
            fitness: (particles,) of each of them, minimized; +inf for a failed evaluation.

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
            state: as `dump` gave it, for the same settings and bounds.

        Raises:
            ValueError: it is of another method, version or shape, or outside the bounds; the state
                before is kept.
        """


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
        raise ValueError(f"not a state of {optimizer}: {where}: {first['msg']}") from error


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
