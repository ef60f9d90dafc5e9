"""GLOBAL: samples, clusters and local searches (Boender et al. 1982; Csendes et al. 2008)."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.plugins import Proposals, RandomNumbers, SearchSettings, Space, Start, from_generator
from gaitswarm_research.methods.bfgs import bfgs
from gaitswarm_research.methods.local_search import (
    Axes,
    Endless,
    LocalSearch,
    Point,
    Walk,
    evaluated_once,
    known_points,
    mixed,
    sampled,
)
from gaitswarm_research.methods.nelder_mead import simplex_search
from gaitswarm_research.methods.unirandi import unirandi

Floats = NDArray[np.float64]

_SAME_MINIMUM: Final = 0.1
"""Distance of two minimizers that are one, as a share of the critical distance."""

_MOST_SELECTED: Final = 20
"""Points that a cycle adds to the reduced sample, at most."""

_MOST_CLUSTERED: Final = 500
"""Points of the reduced sample, at most; the source ends at 100."""


class _GlobalSettings(SearchSettings):
    """What the settings of GLOBAL have with every local search."""

    sample_per_variable: int = Field(
        default=10, ge=1, le=1_000, description="Random designs of a cycle, for each variable."
    )
    selected_per_variable: int = Field(
        default=2,
        ge=1,
        le=20,
        description="Best designs that a cycle adds to those that are clustered, for each variable;"
        " 20 in all at most.",
    )
    alpha: float = Field(
        default=0.01,
        gt=0,
        lt=1,
        description="Of the critical distance: the smaller, the larger are clusters, and the fewer"
        " local searches begin.",
    )
    step: float = Field(
        default=0.1,
        gt=0,
        le=0.5,
        description="First step of a local search, as a share of each range.",
    )
    tolerance: float = Field(
        default=1e-4,
        ge=0,
        lt=1,
        description="Gain at which a local search ends, as a share of the fitness.",
    )


class GlobalUnirandiSettings(_GlobalSettings):
    """Settings of GLOBAL with UniRandi."""

    name: Literal["global-unirandi"] = "global-unirandi"


class GlobalNelderMeadSettings(_GlobalSettings):
    """Settings of GLOBAL with the Nelder-Mead simplex."""

    name: Literal["global-nelder-mead"] = "global-nelder-mead"


class GlobalBfgsSettings(_GlobalSettings):
    """Settings of GLOBAL with BFGS."""

    name: Literal["global-bfgs"] = "global-bfgs"
    difference: float = Field(
        default=1e-4,
        gt=0,
        le=0.1,
        description="Distance of the neighbours that give a gradient, as a share of each range.",
    )


GlobalSettings = GlobalUnirandiSettings | GlobalNelderMeadSettings | GlobalBfgsSettings


def global_search(
    settings: GlobalSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Search locally from sample points that belong to no cluster yet.

    A cycle adds random designs to the sample, and clusters the best of it around the minima that
    are known: a point joins a cluster when it is worse than a member that is nearer than the
    critical distance. Points that are left start a local search each, best first; one that ends at
    a known minimum joins its cluster, another one founds a cluster. Where the published algorithm
    would end, because a cycle found no new minimum, the next cycle begins all the same, and keeps
    all that is known.

    A cycle's sample is one batch. Local searches run one after the other, because what one finds
    decides whether the next is needed. They move continuous variables and integers of many values;
    other integers and choices are held and polled.
    """
    axes = Axes(space)

    def search(start: Point, scale: float) -> Walk:
        step = settings.step * scale
        if isinstance(settings, GlobalUnirandiSettings):
            return unirandi(start, axes, random, step, settings.tolerance)
        if isinstance(settings, GlobalNelderMeadSettings):
            return simplex_search(start, axes, step, settings.tolerance)
        return bfgs(start, axes, step, settings.tolerance, settings.difference)

    known = known_points(space, start)
    return evaluated_once(space, _cycles(settings, axes, search, random, known), start)


def _cycles(
    settings: _GlobalSettings,
    axes: Axes,
    search: LocalSearch,
    random: RandomNumbers,
    sample: list[Point],
) -> Endless:
    """Sample, cluster, search locally, for ever."""
    d = axes.space.dimension
    count = settings.sample_per_variable * d
    selected = min(settings.selected_per_variable * d, _MOST_SELECTED)
    clusters, cycles = Clusters(axes), 0
    while True:
        cycles += 1
        drawn = yield from sampled(axes, random, count)
        # A design that is drawn again, as can happen with integers alone, counts once.
        points = [*drawn, *sample]
        designs = axes.space.designs(axes.space.from_unit(np.array([p.unit for p in points])))
        distinct = {row.tobytes(): point for row, point in zip(designs, points, strict=True)}
        sample = sorted(distinct.values(), key=lambda point: point.fitness)
        del sample[min(cycles * selected, _MOST_CLUSTERED) :]
        clusters.critical = critical_distance(cycles * count, d, settings.alpha)
        clusters.reduce(sample)
        clusters.grow()
        while (start := clusters.unclustered()) is not None:
            found = yield from mixed(start, axes, search)
            clusters.add(start, found)


def critical_distance(count: int, dimension: int, alpha: float) -> float:
    """Distance below which two sample points belong to one cluster."""
    share: float = 1.0 - alpha ** (1.0 / max(count - 1, 1))
    return float(0.5 * share ** (1.0 / dimension))


class Clusters:
    """Sample points by the local minimum that they are thought to lead to.

    Attributes:
        minima: The local minimum of each cluster.
        critical: Critical distance [unit].
    """

    def __init__(self, axes: Axes) -> None:
        """Begin without a cluster."""
        self.minima: list[Point] = []
        self.critical = 0.0
        self._categorical: Final = axes.space.categorical
        self._seeds: list[list[Point]] = []
        self._sample: list[Point] = []
        self._cluster: dict[bytes, int] = {}

    def reduce(self, sample: list[Point]) -> None:
        """Take the sample to be clustered; a point keeps the cluster that it was in."""
        self._sample = [point for point in sample if np.isfinite(point.fitness)]

    def grow(self) -> None:
        """Let every cluster take what is linked to it, in the order of their discovery."""
        for k in range(len(self.minima)):
            members = [point for point in self._sample if self._cluster.get(_key(point)) == k]
            self._link(k, [*self._seeds[k], *members])

    def unclustered(self) -> Point | None:
        """Give the best point that belongs to no cluster."""
        return next((point for point in self._sample if _key(point) not in self._cluster), None)

    def add(self, start: Point, found: Point) -> None:
        """Take what a local search found."""
        same = self._distances(found.unit, [minimum.unit for minimum in self.minima])
        near = np.flatnonzero(same < _SAME_MINIMUM * self.critical)
        if len(near):
            k, seeds = int(near[0]), [start]
            if found.fitness < self.minima[k].fitness:
                self.minima[k] = found
        else:
            k, seeds = len(self.minima), [found, start]
            self.minima.append(found)
            self._seeds.append([])
        self._seeds[k] += seeds
        self._cluster[_key(start)] = k
        self._link(k, seeds)

    def _link(self, k: int, members: list[Point]) -> None:
        """Add points that are worse than a member and near it, and what is linked to those."""
        free = [point for point in self._sample if _key(point) not in self._cluster]
        queue = list(members)
        while queue and free:
            member = queue.pop(0)
            distances = self._distances(member.unit, [point.unit for point in free])
            joins = [
                distance < self.critical and point.fitness > member.fitness
                for point, distance in zip(free, distances.tolist(), strict=True)
            ]
            joined = [point for point, is_in in zip(free, joins, strict=True) if is_in]
            free = [point for point, is_in in zip(free, joins, strict=True) if not is_in]
            self._cluster.update(dict.fromkeys(map(_key, joined), k))
            queue.extend(joined)

    def _distances(self, unit: Floats, others: list[Floats]) -> Floats:
        """(n,) in the variable that differs most; 1, the largest, if a choice differs."""
        apart = np.abs(np.array(others).reshape(-1, len(unit)) - unit)
        apart[:, self._categorical] = apart[:, self._categorical] > 0.0
        largest: Floats = apart.max(axis=1, initial=0.0)
        return largest


def _key(point: Point) -> bytes:
    return point.unit.tobytes()


BFGS = from_generator(
    GlobalBfgsSettings,
    "GLOBAL (Csendes et al. 2008): clustered samples, local searches by BFGS",
    global_search,
)


NELDER_MEAD = from_generator(
    GlobalNelderMeadSettings,
    "GLOBAL (Csendes et al. 2008): clustered samples, local searches by Nelder-Mead",
    global_search,
)


UNIRANDI = from_generator(
    GlobalUnirandiSettings,
    "GLOBAL (Csendes et al. 2008): clustered samples, local searches by UniRandi",
    global_search,
)
