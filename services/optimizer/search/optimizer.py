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
        """Positions to evaluate, (particles, d), inside the bounds."""

    def tell(self, fitness: NDArray[np.float64]) -> None:
        """Take the fitness (particles,) of the positions last asked; minimized, +inf = failed."""

    def dump(self) -> dict[str, Any]:
        """State as JSON-able values with a schema version."""

    def load(self, state: dict[str, Any]) -> None:
        """Take on a dumped state. Raises ValueError if it is of another version or shape."""


M = TypeVar("M", bound=BaseModel)


def parse_state(state: dict[str, Any], optimizer: str, model: type[M]) -> M:
    """The state as an object. Raises ValueError that names the field that is wrong."""
    try:
        return model.model_validate(state)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ValueError(f"not a state of {optimizer}: {where}: {first['msg']}") from error


def matrix(rows: list[list[float]], shape: tuple[int, ...], name: str) -> NDArray[np.float64]:
    """(n, d) array of the rows. Raises ValueError if they have another shape."""
    if len(rows) != shape[0] or any(len(row) != shape[1] for row in rows):
        raise ValueError(f"{name}: expected {shape[0]} rows of {shape[1]} numbers")
    return np.array(rows, dtype=np.float64).reshape(shape)
