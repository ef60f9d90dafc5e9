"""Hypervolume of points as they come: the share of a box that they dominate.

Exact by local upper bounds (Klamroth, Lacour and Vanderpooten 2015), which divide what is not yet
dominated into disjoint boxes (Lacour, Klamroth and Fonseca 2017); where there are too many of them,
an estimate from points drawn in the box.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.random_stream import uniform

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

MOST_BOUNDS: Final = 250_000
"""Local upper bounds up to which a hypervolume is exact."""

_MOST_SAMPLES: Final = 100_000
"""Points that are drawn for an estimate, at most."""

_COMPARISONS: Final = 1_000_000_000
"""Pairs of points that an estimate compares; the more points there are, the fewer are drawn."""

_DRAW: Final = 0xA7EA
"""Purpose of the random numbers."""

_AT_ONCE: Final = 4_000_000
"""Comparisons of an estimate that are held in memory at a time."""


@dataclass(frozen=True, slots=True, eq=False)
class HypervolumeCurve:
    """Hypervolume after each point of a sequence.

    Attributes:
        values: (n,) share of the unit box that the first 1, 2, ... points dominate; never falls.
        standard_error: of the last value, if they are estimates; 0 if they are exact.
    """

    values: Floats
    standard_error: float


def hypervolume_curve(points: Floats, *, most_bounds: int = MOST_BOUNDS) -> HypervolumeCurve:
    """Measure what points dominate, one after the other.

    Args:
        points: (n, M) objectives, minimized, in the order in which they came; each is counted in
            the box from 0 to 1, at whose corner 1 is the reference point. What lies below 0 is
            taken for 0.
    """
    clipped = np.maximum(points, 0.0)
    exact = _exact(clipped, most_bounds)
    return _estimated(clipped) if exact is None else HypervolumeCurve(exact, 0.0)


def _exact(points: Floats, most_bounds: int) -> Floats | None:
    """(n,) values; None if it takes more bounds than allowed."""
    undominated = _Undominated.of(points)
    values = np.empty(len(points))
    for row in range(len(points)):
        undominated.insert(row)
        if undominated.count > most_bounds:
            return None
        values[row] = undominated.volume
    return np.maximum.accumulate(np.clip(1.0 - values, 0.0, 1.0))


@dataclass(slots=True, eq=False)
class _Undominated:
    """The part of the unit box that no point dominates, as a union of [0, bound).

    A bound's coordinate j is that of the point defining[j], or 1 where that is -1; the point is
    below the bound in all other coordinates. Of equal coordinates that of the later point counts
    as the greater, so that no two are equal.

    points: (n, M); bounds: (M, room), used up to `count`; defining: (M, room) rows of points;
    volumes: (room,) of the disjoint boxes; volume: their sum.
    """

    points: Floats
    bounds: Floats
    defining: Rows
    volumes: Floats
    count: int
    volume: float

    @classmethod
    def of(cls, points: Floats) -> _Undominated:
        size = points.shape[1]
        return cls(
            # The last row belongs to -1: the sides of the box, 0 in all coordinates but one.
            np.vstack([points, np.zeros(size)]),
            np.ones((size, 1024)),
            np.full((size, 1024), -1, dtype=np.intp),
            np.ones(1024),
            count=1,
            volume=1.0,
        )

    def insert(self, row: int) -> None:
        """Take away what a point dominates."""
        point, size = self.points[row], self.points.shape[1]
        above = self.bounds[0, : self.count] > point[0]
        for j in range(1, size):
            above &= self.bounds[j, : self.count] > point[j]
        split = np.flatnonzero(above)
        if not len(split):
            return
        bounds, defining = self.bounds[:, split], self.defining[:, split]
        new_bounds, new_defining = [], []
        for j in range(size):
            others = self.points[np.delete(defining, j, axis=0), j]
            kept = point[j] >= others.max(axis=0, initial=0.0)
            new = bounds[:, kept]
            new[j] = point[j]
            by = defining[:, kept]
            by[j] = row
            new_bounds.append(new)
            new_defining.append(by)
        self._replace(split, np.concatenate(new_bounds, 1), np.concatenate(new_defining, 1))

    def _replace(self, old: Rows, bounds: Floats, defining: Rows) -> None:
        volumes = self._volumes(bounds, defining)
        self.volume += math.fsum(volumes) - math.fsum(self.volumes[old])
        added = max(0, len(volumes) - len(old))
        self._reserve(self.count + added)
        places = np.concatenate([old, np.arange(self.count, self.count + added)])
        places, empty = places[: len(volumes)], places[len(volumes) :]
        self.bounds[:, places], self.defining[:, places] = bounds, defining
        self.volumes[places] = volumes
        # No point is below these any more.
        self.bounds[:, empty], self.volumes[empty] = 0.0, 0.0
        self.count += added

    def _volumes(self, bounds: Floats, defining: Rows) -> Floats:
        """Of the boxes: in coordinate j, from the points that define the coordinates before."""
        volumes: Floats = bounds[0].copy()
        for j in range(1, len(bounds)):
            volumes *= np.maximum(bounds[j] - self.points[defining[:j], j].max(axis=0), 0.0)
        return volumes

    def _reserve(self, count: int) -> None:
        room = self.bounds.shape[1]
        if count > room:
            more = max(count, 2 * room) - room
            self.bounds = np.pad(self.bounds, ((0, 0), (0, more)))
            self.defining = np.pad(self.defining, ((0, 0), (0, more)))
            self.volumes = np.pad(self.volumes, (0, more))


def _estimated(points: Floats) -> HypervolumeCurve:
    """The share of points drawn in the box that are dominated, after each point."""
    size = points.shape[1]
    samples = min(_MOST_SAMPLES, _COMPARISONS // len(points))
    drawn = uniform(0, _DRAW, iteration=0, particle=0, count=samples * size)
    left = drawn.reshape(samples, size)
    hits = np.zeros(len(points), dtype=np.int64)
    first, step = 0, 1
    while first < len(points) and len(left):
        chunk = points[first : first + step]
        when = _first_below(chunk, left)
        dominated = when < len(chunk)
        hits[first : first + len(chunk)] = np.bincount(when[dominated], minlength=len(chunk))
        left = left[~dominated]
        first += len(chunk)
        step = max(1, _AT_ONCE // max(1, len(left)))
    values = np.cumsum(hits) / samples
    last = float(values[-1])
    return HypervolumeCurve(values, math.sqrt(last * (1.0 - last) / samples))


def _first_below(points: Floats, samples: Floats) -> Rows:
    """(s,) index of the first point that dominates each sample; n for none."""
    below = np.ones((len(samples), len(points) + 1), dtype=np.bool_)
    for m in range(points.shape[1]):
        below[:, :-1] &= points[None, :, m] <= samples[:, m, None]
    return np.asarray(below.argmax(axis=1))
