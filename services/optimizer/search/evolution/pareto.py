"""Which objective vectors are the better ones: Pareto ranks, and shares of the hypervolume.

All is comparisons, divisions and sums of whole numbers, so that bits are the same everywhere.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.random_stream import RandomNumbers

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

_BEYOND: Final = 0.1
"""Distance of the reference point from the nadir, as a share of the range of a front."""

_UNIT: Final = 2.0**32
"""Weight of a sample, as a whole number."""


def pareto_ranks(vectors: Floats) -> Indices:
    """Sort objective vectors into fronts (Deb et al. 2002), all objectives minimized."""
    ranks = np.full(len(vectors), -1, dtype=np.intp)
    left = np.isfinite(vectors).all(axis=1)
    no_worse = np.ones((len(vectors), len(vectors)), dtype=np.bool_)
    for column in vectors.T:
        no_worse &= column[:, np.newaxis] <= column
    dominates = no_worse & ~no_worse.T
    rank = 0
    while left.any():
        front = left & ~dominates[left].any(axis=0)
        ranks[front] = rank
        left &= ~front
        rank += 1
    ranks[ranks < 0] = rank
    return ranks


class SampledHypervolume:
    """The box that a front dominates, estimated from points that are drawn in it.

    The front is scaled to [0, 1] between its least and its greatest value in each objective; the
    box ends at the reference point, a tenth beyond.
    """

    def __init__(self, front: Floats, samples: int, random: RandomNumbers) -> None:
        """Draw the points."""
        low = front.min(axis=0)
        span = front.max(axis=0) - low
        scaled = (front - low) / np.where(span > 0.0, span, 1.0)
        points = random.uniform(samples, front.shape[1]) * (1.0 + _BEYOND)
        covers = np.ones((len(front), samples), dtype=np.bool_)
        for objective, point in zip(scaled.T, points.T, strict=True):
            covers &= objective[:, np.newaxis] <= point
        self._covers: Final = covers

    def shares(self) -> NDArray[np.int64]:
        """How much is dominated by each vector alone."""
        alone = self._covers.sum(axis=0) == 1
        return np.asarray((self._covers & alone).sum(axis=1), dtype=np.int64)

    def chosen(self, count: int) -> Indices:
        """Choose the vectors that dominate the most together (HypE; Bader and Zitzler 2011).

        One after the other goes whose loss is the least to be expected, if of all that have to go
        the others were drawn at random (equations 12 and 13 of the paper).
        """
        kept = np.arange(len(self._covers))
        covered = self._covers.sum(axis=0)
        while len(kept) > count:
            weights = _weights(len(kept), len(kept) - count)[covered]
            losses = (self._covers[kept] * weights).sum(axis=1)
            gone = int(losses.argmin())
            covered -= self._covers[kept[gone]]
            kept = np.delete(kept, gone)
        return kept


def _weights(size: int, going: int) -> NDArray[np.int64]:
    """(size + 1,) share of a point in the loss of each of so many vectors that dominate it.

    It is lost only where all the others that dominate it go as well.
    """
    weights, chance = np.zeros(size + 1), 1.0
    for others in range(min(size, going)):
        weights[others + 1] = chance / (others + 1)
        chance *= (going - others - 1) / max(1, size - others - 1)
    return np.asarray(np.rint(weights * _UNIT), dtype=np.int64)
