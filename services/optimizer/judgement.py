"""What designs are worth, however their job judges them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """n designs after K trials; both to be minimized.

    fitness: (n,), +inf where a trial failed; log_utilities: (n, K), logarithm of what a design is
    worth in each trial, +inf where it failed.
    """

    fitness: Floats
    log_utilities: Floats

    @property
    def utilities(self) -> Floats:
        """(n, K), +inf where the trial failed or the number is too great."""
        rows = [[exponential(u) for u in row] for row in self.log_utilities.tolist()]
        return np.array(rows, dtype=np.float64).reshape(self.log_utilities.shape)


def exponential(logarithm: float) -> float:
    """Its exponential, +inf where a double ends. Of Python's math: the same bits on any CPU."""
    try:
        return math.exp(logarithm)
    except OverflowError:
        return math.inf
