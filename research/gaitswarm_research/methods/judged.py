"""Memory of evaluated designs."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.plugins import Space

Floats = NDArray[np.float64]

_RESOLUTION: Final = 2.0**40
"""Designs are equal if they differ by less than this part of a range; rounding is far smaller."""


class Judged:
    """The designs evaluated so far, so that none is asked for twice."""

    def __init__(self, space: Space) -> None:
        self._space: Final = space
        self._seen: set[bytes] = set()

    def new(self, designs: Floats) -> NDArray[np.bool_]:
        """Mark designs as evaluated.

        Args:
            designs: (n, d).

        Returns:
            (n,) which of them were new.
        """
        keys = np.rint(self._space.to_unit(designs) * _RESOLUTION).astype(np.int64)
        new = np.zeros(len(designs), dtype=np.bool_)
        for i, row in enumerate(keys):
            key = row.tobytes()
            new[i] = key not in self._seen
            self._seen.add(key)
        return new
