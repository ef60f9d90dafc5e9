"""Tolerance classes of the relative error (thesis table 2.3)."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Final


class Tolerance(StrEnum):
    """What an RMAE means, by the colour that the thesis gives it; from good to bad."""

    GREEN = "green"
    YELLOW = "yellow"
    ORANGE = "orange"
    RED = "red"
    PURPLE = "purple"

    @property
    def limit(self) -> float:
        """Largest RMAE [1] that still belongs to the class."""
        return _LIMITS[self]

    @property
    def phrase(self) -> str:
        """What to think of it."""
        return _PHRASES[self]

    @classmethod
    def of(cls, rmae: float) -> Tolerance:
        """Class of a relative mean absolute error [1]; NaN is as bad as can be.

        >>> [Tolerance.of(x).value for x in (0.02, 0.021, 0.31)]
        ['green', 'yellow', 'red']
        """
        return next((known for known in cls if rmae <= known.limit), cls.PURPLE)


_LIMITS: Final = {
    Tolerance.GREEN: 0.02,
    Tolerance.YELLOW: 0.10,
    Tolerance.ORANGE: 0.30,
    Tolerance.RED: 0.50,
    Tolerance.PURPLE: math.inf,
}

_PHRASES: Final = {
    Tolerance.GREEN: "as exact as a digital measurement",
    Tolerance.YELLOW: "as exact as an analog measurement",
    Tolerance.ORANGE: "moderate, acceptable under conditions",
    Tolerance.RED: "unacceptable",
    Tolerance.PURPLE: "a serious error",
}
