"""The test functions of thesis 3.2.1, f_D4C0R0I0 to f_D7C1R1I1.

A name consists of tags: D the dimension, C1 continuous or C0 not, R1 with a random part or R0
without, I1 with an integer variable or I0 without. Three of the sixteen functions are printed:
f_D4C0R0I1 (3.9), f_D7C1R1I0 (3.10) and f_D7C0R0I1 (3.11). The others are composed of parts of these
three. A function is the absolute value of a sum of parts:

    part        D4   D7   tag   0                                    1
    ratio       x1   x1   C     abs(1 + 1/(0.1 round(10 x) - 0.9))   abs(1 + 1/(x - 0.9))
    square           x2         (x + 0.5)^2
    root             x3   C     sqrt(abs(0.1 round(10 x) + 0.2))     sqrt(abs(x + 0.2))
    noise            x4   R     sqrt(abs(x + 0.6))                   r sqrt(abs(x + 0.6))
    noise       x4        R     none                                 r sqrt(abs(x + 0.6))
    logarithm   x2   x5   C     g(x)                                 log2(abs(x + 2) + 1)
    level            x6   I     abs(x - 8)/10, x continuous          the same, x an integer
    level       x3        I     (x - 8)/10, x continuous             the same, x an integer
    step        x4   x7   C     sgn(x + 0.4)                         x - 0.6

    g(x) = log2(abs(x + 1.3) + 1) if x >= -0.3, else log2(abs(1.8 - x) + 1)
    r: uniform in [0, 1), drawn for every evaluation (Matlab's rand(1))

Rules by which the other thirteen are composed:

1. What differs between (3.10) and (3.11) belongs to the tag that differs: the four parts of C, the
   factor r to R, the integer x6 to I.
2. (3.9) has four of the seven parts, the level without abs(). It has no part that (3.10) multiplies
   by r, so R1 adds this part as printed, on x4.
3. No part depends on two tags.
4. The box is that of (3.11): -1 <= x <= 1, but 0 <= x <= 10 for the variable of the level.
5. round() is Matlab's, halves away from zero, and sgn(0) = 0.

The minimum of all is 0. In D7C0 it is at one place, in all others on a surface. 1/(...) without a
value is a failed evaluation, +inf.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from gaitswarm.plugins import Axis, RandomNumbers, Space

ACCEPTANCE: Final = 1e-3
"""Value at which a function counts as solved: the acceptance line of figs. 3.1 to 3.3, of assumed
height."""

_NOISE: Final = 1_000
"""Purpose of random streams, beyond those of search methods."""


@dataclass(frozen=True)
class BenchmarkFunction:
    """One of the sixteen functions, by its tags."""

    dimension: Literal[4, 7]
    is_continuous: bool
    is_random: bool
    has_integer: bool

    @property
    def name(self) -> str:
        """Name as in the thesis, such as `D7C0R0I1`."""
        return f"D{self.dimension}C{self.is_continuous:d}R{self.is_random:d}I{self.has_integer:d}"

    @property
    def low(self) -> NDArray[np.float64]:
        """(d,) lower bounds."""
        bounds = np.full(self.dimension, -1.0)
        bounds[self._level_variable] = 0.0
        return bounds

    @property
    def high(self) -> NDArray[np.float64]:
        """(d,) upper bounds."""
        bounds = np.full(self.dimension, 1.0)
        bounds[self._level_variable] = 10.0
        return bounds

    @property
    def integer(self) -> NDArray[np.bool_]:
        """(d,) true for integer variables."""
        mask = np.zeros(self.dimension, dtype=np.bool_)
        mask[self._level_variable] = self.has_integer
        return mask

    @property
    def minimizer(self) -> NDArray[np.float64]:
        """(d,) a point where every draw gives the minimum, 0."""
        if self.dimension == 4:
            return np.array(
                [-0.1, -1.0, 10.0, -0.6] if self.is_continuous else [-0.1, -0.3, 8.0, -0.6]
            )
        if self.is_continuous:
            return np.array([-0.1, -0.5, -0.2, -0.6, -1.0, 8.0, -0.4])
        return np.array([-0.1, -0.5, -0.2, -0.6, -0.3, 8.0, -0.7])

    @property
    def space(self) -> Space:
        """The box that is searched."""
        rows = zip(self.low, self.high, self.integer, strict=True)
        return Space(
            [Axis(float(a), float(b), "integer" if i else "continuous") for a, b, i in rows]
        )

    def value(
        self, designs: NDArray[np.float64], random: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Evaluate (n, d) designs; random: (n,) draws of r."""
        x = np.where(self.integer, _round(designs), designs).T
        total = self._four(x, random) if self.dimension == 4 else self._seven(x, random)
        return np.abs(total)

    @property
    def _level_variable(self) -> int:
        return 2 if self.dimension == 4 else 5

    def _four(self, x: NDArray[np.float64], random: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sum of (3.9) and its relatives."""
        x1, x2, x3, x4 = x
        total: NDArray[np.float64]
        total = self._ratio(x1) + self._logarithm(x2) + (x3 - 8.0) / 10.0 + self._step(x4)
        if self.is_random:
            total += random * _distance_root(x4, -0.6)
        return total

    def _seven(self, x: NDArray[np.float64], random: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sum of (3.10), (3.11) and their relatives."""
        x1, x2, x3, x4, x5, x6, x7 = x
        factor = random if self.is_random else np.ones(len(x4))
        total: NDArray[np.float64]
        total = self._ratio(x1) + (x2 + 0.5) ** 2 + self._root(x3)
        total += factor * _distance_root(x4, -0.6) + np.abs(x6 - 8.0) / 10.0
        return total + self._logarithm(x5) + self._step(x7)

    def _ratio(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        # In tenths, so that 0.9 is exact.
        with np.errstate(divide="ignore"):
            quotient = 1.0 / (x - 0.9) if self.is_continuous else 10.0 / (_round(10.0 * x) - 9.0)
        return np.abs(1.0 + quotient)

    def _root(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        return _distance_root(x if self.is_continuous else _round(10.0 * x) / 10.0, -0.2)

    def _logarithm(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        if self.is_continuous:
            return np.log2(np.abs(x + 2.0) + 1.0)
        return np.log2(np.abs(np.where(x >= -0.3, x + 1.3, 1.8 - x)) + 1.0)

    def _step(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        return x - 0.6 if self.is_continuous else np.sign(x + 0.4)


_DIMENSIONS: Final[tuple[Literal[4, 7], ...]] = (4, 7)

FUNCTIONS: Final = {
    function.name: function
    for dimension in _DIMENSIONS
    for tags in product((False, True), repeat=3)
    for function in [BenchmarkFunction(dimension, *tags)]
}
"""All sixteen functions by name."""


def draw(seed: int, *, first: int, count: int) -> NDArray[np.float64]:
    """Draw r of successive evaluations of a run, independent of the batches."""
    numbers = [
        RandomNumbers(seed, _NOISE, iteration=index).uniform()
        for index in range(first, first + count)
    ]
    return np.array(numbers, dtype=np.float64).reshape(count)


def _distance_root(x: NDArray[np.float64], zero: float) -> NDArray[np.float64]:
    return np.sqrt(np.abs(x - zero))


def _round(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Round to the nearest integer, halves away from zero."""
    whole = np.trunc(x)
    return np.where(np.abs(x - whole) >= 0.5, whole + np.copysign(1.0, x), whole)
