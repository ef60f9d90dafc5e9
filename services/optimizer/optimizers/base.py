"""The port of a search algorithm: ask, tell, dump, load."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray


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
