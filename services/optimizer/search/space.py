"""The box that is searched, and the random numbers that sample it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.memory import require_room_for_scipy

Kind = Literal["continuous", "integer", "categorical"]


class Axis(NamedTuple):
    """One variable of a search."""

    low: float
    """In the variable's own unit; 0 for a categorical variable."""
    high: float
    """Above `low`; for a categorical variable the number of choices minus 1."""
    kind: Kind = "continuous"


class Space:
    """A box of d variables.

    A *position* is a point of the box, in the variables' own units, and real in every coordinate.
    A *design* is what is evaluated: integer variables are rounded, categorical variables become the
    index of the choice in whose equal share of the range the point lies. A *unit position* is a
    position scaled to [0, 1] in every coordinate.

    Arguments of the methods: `positions` is (n, d), inside the bounds; `designs` is (n, d), as
    `Space.designs` returns them; `unit` is (n, d); `low` is (d,) and `high` is (d,).
    """

    def __init__(self, axes: Sequence[Axis]) -> None:
        self.axes: Final = tuple(axes)
        self.low: Final[Floats] = np.array([axis.low for axis in axes], dtype=np.float64)
        self.high: Final[Floats] = np.array([axis.high for axis in axes], dtype=np.float64)
        self.span: Final[Floats] = self.high - self.low
        # (d,) masks
        self.integer: Final = np.array([axis.kind == "integer" for axis in axes])
        self.categorical: Final = np.array([axis.kind == "categorical" for axis in axes])

    @classmethod
    def continuous(cls, low: Sequence[float] | Floats, high: Sequence[float] | Floats) -> Space:
        """Create a box of continuous variables."""
        return cls([Axis(float(a), float(b)) for a, b in zip(low, high, strict=True)])

    @property
    def dimension(self) -> int:
        """Number of variables, d."""
        return len(self.axes)

    @property
    def mostly_integer(self) -> bool:
        """Whether more than half of the variables are integers."""
        return 2 * int(np.count_nonzero(self.integer)) > self.dimension

    def designs(self, positions: Floats) -> Floats:
        """Convert positions to (n, d) designs."""
        columns = np.array(positions, dtype=np.float64)
        columns[:, self.integer] = np.rint(columns[:, self.integer])
        for j in np.flatnonzero(self.categorical):
            last = self.high[j]
            column = np.floor(columns[:, j] * ((last + 1.0) / last))
            columns[:, j] = np.minimum(column, last)
        return columns

    def positions(self, designs: Floats) -> Floats:
        """Convert designs to the positions in the middle of those that represent them."""
        points = np.array(designs, dtype=np.float64)
        for j in np.flatnonzero(self.categorical):
            last = self.high[j]
            points[:, j] = (points[:, j] + 0.5) * (last / (last + 1.0))
        return points

    def from_unit(self, unit: Floats) -> Floats:
        """Convert unit positions to positions, clipped to the box."""
        return np.clip(self.low + unit * self.span, self.low, self.high)

    def to_unit(self, positions: Floats) -> Floats:
        """Convert positions to unit positions."""
        return (positions - self.low) / self.span

    def evenly(self, unit: Floats) -> Floats:
        """Convert unit positions to positions, giving every integer value the same width.

        `from_unit` gives the first and last integer half the width of the others.
        """
        points = self.from_unit(unit)
        values = self.low + np.floor(unit * (self.span + 1.0))
        return np.where(self.integer, np.minimum(values, self.high), points)


_DOUBLE_BITS: Final = 53


class RandomNumbers:
    """A stream of random numbers, drawn in order: Philox 4x64 (Salmon et al. 2011).

    The key is (seed, purpose) and the counter starts at (iteration, particle), so that streams
    neither overlap nor depend on how many numbers another stream has used. The same seed and
    purpose give the same numbers with every version of numpy.

    In the methods, `shape` is that of the result, none for a single number.
    """

    def __init__(self, seed: int, purpose: int, *, iteration: int = 0, particle: int = 0) -> None:
        self._philox = np.random.Philox(
            key=np.array([seed, purpose], dtype=np.uint64),
            counter=np.array([0, 0, particle, iteration], dtype=np.uint64),
        )

    def uniform(self, *shape: int) -> Floats:
        """Draw numbers that are uniform in [0, 1)."""
        # numpy guarantees the raw stream of a bit generator, but not that of a Generator.
        raw = np.asarray(self._philox.random_raw(math.prod(shape)), dtype=np.uint64)
        numbers = (raw >> np.uint64(64 - _DOUBLE_BITS)).astype(np.float64) * 2.0**-_DOUBLE_BITS
        return numbers.reshape(shape)

    def normal(self, *shape: int) -> Floats:
        """Draw numbers of the standard normal distribution; no value exceeds 8.3."""
        numbers: Floats = normal_quantiles(
            (np.floor(self.uniform(*shape) * 2.0**52) + 0.5) * 2.0**-52
        )
        return numbers

    def index(self, count: int) -> int:
        """Draw an index.

        Args:
            count: Number of indices, >= 1.

        Returns:
            0 to count - 1 with equal probability.
        """
        return int(self.uniform() * count)

    def permutation(self, count: int) -> NDArray[np.intp]:
        """Draw a permutation of the indices 0 to count - 1.

        Args:
            count: Number of indices.
        """
        return np.argsort(self.uniform(count), kind="stable")

    def seed(self) -> int:
        """Draw a seed for a library's own generator, 0 to 2**32 - 1."""
        return int(self.uniform() * 2.0**32)


def normal_quantiles(probabilities: Floats | float) -> Any:
    """Return quantiles of the standard normal distribution."""
    require_room_for_scipy()
    from scipy.special import ndtri  # noqa: PLC0415 - slow to import, and few searches need it

    return ndtri(probabilities)


def swarm_uniform(seed: int, purpose: int, *, iteration: int, particles: int, count: int) -> Floats:
    """Draw uniform random numbers of a whole swarm, (particles, count)."""
    return np.array(
        [
            RandomNumbers(seed, purpose, iteration=iteration, particle=particle).uniform(count)
            for particle in range(particles)
        ]
    ).reshape(particles, count)
