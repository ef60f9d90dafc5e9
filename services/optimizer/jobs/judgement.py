"""Fitness and utilities of designs"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.outcome import Outcome, Status

Floats = NDArray[np.float64]

_PIECE: Final = 4096
"""Values converted at a time, so that other Python threads can run in between."""


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """Fitness and utilities of n designs in K cases; all minimized."""

    fitness: Floats  # (n,), +inf if a case failed
    log_utilities: Floats  # (n, K) logarithms of the utilities, +inf if the case failed

    @property
    def utilities(self) -> Floats:
        """(n, K), +inf if the case failed or on overflow."""
        flat = self.log_utilities.reshape(-1)
        utilities = np.empty(len(flat))
        for begin in range(0, len(flat), _PIECE):
            piece = slice(begin, begin + _PIECE)
            utilities[piece] = [exponential(u) for u in flat[piece].tolist()]
        return utilities.reshape(self.log_utilities.shape)


def exponential(logarithm: float) -> float:
    """Python's exponential function: numpy's differs in the last bit between processors."""
    try:
        return math.exp(logarithm)
    except OverflowError:
        return math.inf


def by_design(outcomes: tuple[Outcome, ...]) -> tuple[Floats, NDArray[np.bool_]]:
    """Convert outcomes by case to (n, K, m) objectives and (n, K) failures."""
    objectives = np.stack([outcome.objectives for outcome in outcomes], axis=1)
    failed = np.stack([outcome.statuses != Status.OK for outcome in outcomes], axis=1)
    return objectives, failed
