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
"""Distance below which two minimizers are the same, as a share of the critical distance."""

_MOST_SELECTED: Final = 20
"""Maximum number of points that a cycle adds to the reduced sample."""

_MOST_CLUSTERED: Final = 500
"""Maximum size of the reduced sample; 100 in the published code."""


class _GlobalSettings(SearchSettings):
    """Settings of GLOBAL that every local search shares."""

    sample_per_variable: int = Field(
        default=10, ge=1, le=1_000, description="Random designs of a cycle per variable."
    )
    selected_per_variable: int = Field(
        default=2,
        ge=1,
        le=20,
        description="Best designs that a cycle adds to the reduced sample per variable, at most 20"
        " in all.",
    )
    alpha: float = Field(
        default=0.01,
        gt=0,
        lt=1,
        description="Significance level of the critical distance; a smaller value makes larger"
        " clusters and fewer local searches.",
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
        description="Gain below which a local search ends, as a share of the fitness.",
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
        description="Step of finite differences, as a share of each range.",
    )


GlobalSettings = GlobalUnirandiSettings | GlobalNelderMeadSettings | GlobalBfgsSettings


def global_search(
    settings: GlobalSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
    start: Start | None = None,
) -> Proposals:
    """Start local searches from sample points outside of all clusters.

    A cycle adds random designs to the sample, and clusters the best of the sample around the local
    minima: a point joins a cluster if it is worse than a member that is nearer than the critical
    distance. Each remaining point starts a local search, best first; its minimum joins an existing
    cluster or founds one. Unlike the published algorithm, which ends when a cycle finds no new
    minimum, cycles continue and keep the clusters.

    The sample of a cycle is one batch. Local searches run in sequence, because the minimum of one
    decides whether the next is needed. They move continuous variables and integers with many
    values; other integers and categorical variables are polled.
    """
    axes = Axes(space)

    def search(start: Point, scale: float) -> Walk:
        step = settings.step * scale
        if isinstance(settings, GlobalUnirandiSettings):
            return unirandi(start, axes, random, step, settings.tolerance)
        if isinstance(settings, GlobalNelderMeadSettings):
            return simplex_search(start, axes, step, settings.tolerance)
        return bfgs(start, axes, step, settings.tolerance, settings.difference)

    sample = known_points(space, start)
    return evaluated_once(space, _cycles(settings, axes, search, random, sample), start)


def _cycles(
    settings: _GlobalSettings,
    axes: Axes,
    search: LocalSearch,
    random: RandomNumbers,
    sample: list[Point],
) -> Endless:
    """Sample, cluster and search locally, endlessly."""
    d = axes.space.dimension
    count = settings.sample_per_variable * d
    selected = min(settings.selected_per_variable * d, _MOST_SELECTED)
    clusters, cycles = Clusters(axes), 0
    while True:
        cycles += 1
        drawn = yield from sampled(axes, random, count)
        # Repeated designs, possible if all variables are integers, count once.
        points = [*drawn, *sample]
        designs = axes.space.designs(axes.space.from_unit(np.array([p.unit for p in points])))
        distinct = {row.tobytes(): point for row, point in zip(designs, points, strict=True)}
        sample = sorted(distinct.values(), key=lambda point: point.fitness)
        del sample[min(cycles * selected, _MOST_CLUSTERED) :]
        clusters.critical = critical_distance(cycles * count, d, settings.alpha)
        clusters.reduce(sample)
        clusters.grow()
        while (start := clusters.unclustered()) is not None:
            minimum = yield from mixed(start, axes, search)
            clusters.add(start, minimum)


def critical_distance(count: int, dimension: int, alpha: float) -> float:
    """Return the distance below which two sample points belong to one cluster."""
    share: float = 1.0 - alpha ** (1.0 / max(count - 1, 1))
    return float(0.5 * share ** (1.0 / dimension))


class Clusters:
    """Sample points by the local minimum that they are expected to lead to.

    Attributes:
        minima: local minimum of each cluster.
        critical: critical distance [unit].
    """

    def __init__(self, axes: Axes) -> None:
        self.minima: list[Point] = []
        self.critical = 0.0
        self._categorical: Final = axes.space.categorical
        self._seeds: list[list[Point]] = []
        self._sample: list[Point] = []
        self._cluster: dict[bytes, int] = {}

    def reduce(self, sample: list[Point]) -> None:
        """Set the sample to be clustered; points keep their cluster."""
        self._sample = [point for point in sample if np.isfinite(point.fitness)]

    def grow(self) -> None:
        """Add linked points to every cluster, in the order of their discovery."""
        for k in range(len(self.minima)):
            members = [point for point in self._sample if self._cluster.get(_key(point)) == k]
            self._link(k, [*self._seeds[k], *members])

    def unclustered(self) -> Point | None:
        """Return the best point outside of all clusters."""
        return next((point for point in self._sample if _key(point) not in self._cluster), None)

    def add(self, start: Point, minimum: Point) -> None:
        """Add the start and the minimum of a local search."""
        same = self._distances(minimum.unit, [other.unit for other in self.minima])
        near = np.flatnonzero(same < _SAME_MINIMUM * self.critical)
        if len(near):
            k, seeds = int(near[0]), [start]
            if minimum.fitness < self.minima[k].fitness:
                self.minima[k] = minimum
        else:
            k, seeds = len(self.minima), [minimum, start]
            self.minima.append(minimum)
            self._seeds.append([])
        self._seeds[k] += seeds
        self._cluster[_key(start)] = k
        self._link(k, seeds)

    def _link(self, k: int, members: list[Point]) -> None:
        """Add points that are worse than a member and near it, and points linked to those."""
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
        """Return the largest difference (n,) over variables; 1 if a category differs."""
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
