"""The box that is searched, and the designs its points represent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal, NamedTuple

import numpy as np

from gaitswarm.sim.arrays import Floats

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
