"""The box that is searched, and the designs that its points stand for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

Kind = Literal["continuous", "integer", "categorical"]

_RESOLUTION: Final = 2.0**40
"""Continuous values are the same design to within this part of a range: rounding is far less."""


@dataclass(frozen=True, slots=True)
class Axis:
    """One variable of a search.

    Attributes:
        low: Lower bound, in the variable's own unit; 0 for a categorical one.
        high: Upper bound, above it; of a categorical one, its number of choices less one.
        kind: What values it takes.
    """

    low: float
    high: float
    kind: Kind = "continuous"


class Space:
    """A box of d variables.

    A *position* is a point of the box, in the variables' own units, and real in every coordinate.
    A *design* is what is judged: integer variables rounded, of categorical ones the index of the
    choice in whose equal share of the bounds the point lies. A *unit position* is a position scaled
    to [0, 1] in every coordinate.

    Attributes:
        axes: The d variables.
        low: (d,) lower bounds.
        high: (d,) upper bounds.
        span: (d,) high - low.
        integer: (d,) true for integer variables.
        categorical: (d,) true for categorical ones.
    """

    def __init__(self, axes: Sequence[Axis]) -> None:
        """Make a box."""
        self.axes: Final = tuple(axes)
        self.low: Final[Floats] = np.array([axis.low for axis in axes], dtype=np.float64)
        self.high: Final[Floats] = np.array([axis.high for axis in axes], dtype=np.float64)
        self.span: Final[Floats] = self.high - self.low
        self.integer: Final = np.array([axis.kind == "integer" for axis in axes])
        self.categorical: Final = np.array([axis.kind == "categorical" for axis in axes])

    @classmethod
    def continuous(cls, low: Sequence[float] | Floats, high: Sequence[float] | Floats) -> Space:
        """Make a box of continuous variables.

        Args:
            low: (d,) lower bounds.
            high: (d,) upper bounds.

        Returns:
            The box.
        """
        return cls([Axis(float(a), float(b)) for a, b in zip(low, high, strict=True)])

    @property
    def dimension(self) -> int:
        """Number of variables, d."""
        return len(self.axes)

    def designs(self, positions: Floats) -> Floats:
        """What is judged for points of the box.

        Args:
            positions: (n, d), inside the bounds.

        Returns:
            (n, d): integer variables rounded, of categorical ones the index of the choice.
        """
        columns = np.array(positions, dtype=np.float64)
        columns[:, self.integer] = np.rint(columns[:, self.integer])
        for j in np.flatnonzero(self.categorical):
            last = self.high[j]
            column = np.floor(columns[:, j] * ((last + 1.0) / last))
            columns[:, j] = np.minimum(column, last)
        return columns

    def positions(self, designs: Floats) -> Floats:
        """Points in the middle of what stands for designs.

        Args:
            designs: (n, d), as `designs` gives them.

        Returns:
            (n, d) positions of which `designs` gives the same back.
        """
        points = np.array(designs, dtype=np.float64)
        for j in np.flatnonzero(self.categorical):
            last = self.high[j]
            points[:, j] = (points[:, j] + 0.5) * (last / (last + 1.0))
        return points

    def from_unit(self, unit: Floats) -> Floats:
        """Positions of unit positions; what lies outside the box is brought to its nearest face.

        Args:
            unit: (n, d).

        Returns:
            (n, d), inside the bounds.
        """
        return np.clip(self.low + unit * self.span, self.low, self.high)

    def to_unit(self, positions: Floats) -> Floats:
        """Unit positions of positions.

        Args:
            positions: (n, d), inside the bounds.

        Returns:
            (n, d) in [0, 1].
        """
        return (positions - self.low) / self.span

    def evenly(self, unit: Floats) -> Floats:
        """Positions of unit positions, each integer value as wide as the next.

        `from_unit` gives the first and last integer half the width of the others.

        Args:
            unit: (n, d) in [0, 1).

        Returns:
            (n, d), inside the bounds.
        """
        points = self.from_unit(unit)
        values = self.low + np.floor(unit * (self.span + 1.0))
        return np.where(self.integer, np.minimum(values, self.high), points)


class Judged:
    """Designs that were judged, so that none is asked for twice."""

    def __init__(self, space: Space) -> None:
        """Begin with none."""
        self._space: Final = space
        self._seen: set[bytes] = set()

    def new(self, designs: Floats) -> NDArray[np.bool_]:
        """Tell which designs were not judged yet, and take them as judged from now on."""
        keys = np.rint(self._space.to_unit(designs) * _RESOLUTION).astype(np.int64)
        new = np.zeros(len(designs), dtype=np.bool_)
        for i, row in enumerate(keys):
            key = row.tobytes()
            new[i] = key not in self._seen
            self._seen.add(key)
        return new
