"""What designs are worth, from what the simulator says of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.outcome import Outcome, Status

Floats = NDArray[np.float64]

_PIECE: Final = 4096
"""Numbers that are converted at once: meanwhile no other thread of Python goes on."""


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """What n designs are worth after K cases; all to be minimized.

    Attributes:
        fitness: (n,), +inf where a case failed.
        log_utilities: (n, K) logarithm of what a design is worth in each case, +inf where it
            failed.
    """

    fitness: Floats
    log_utilities: Floats

    @property
    def utilities(self) -> Floats:
        """(n, K), +inf where the case failed or the number is too great."""
        flat = self.log_utilities.reshape(-1)
        utilities = np.empty(len(flat))
        for begin in range(0, len(flat), _PIECE):
            piece = slice(begin, begin + _PIECE)
            utilities[piece] = [exponential(u) for u in flat[piece].tolist()]
        return utilities.reshape(self.log_utilities.shape)


def exponential(logarithm: float) -> float:
    """The exponential function. Python's, as numpy's differs in the last bit between processors."""
    try:
        return math.exp(logarithm)
    except OverflowError:
        return math.inf


def by_design(outcomes: tuple[Outcome, ...]) -> tuple[Floats, NDArray[np.bool_]]:
    """Turn outcomes by case to numbers by design."""
    objectives = np.stack([outcome.objectives for outcome in outcomes], axis=1)
    failed = np.stack([outcome.statuses != Status.OK for outcome in outcomes], axis=1)
    return objectives, failed
