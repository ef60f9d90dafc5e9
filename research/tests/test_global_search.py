"""GLOBAL: cycles of samples, single-linkage clusters, and a local search for each of the rest."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.plugins import Axis, Space
from gaitswarm_research.methods.global_search import Clusters, critical_distance
from gaitswarm_research.methods.local_search import Axes, Floats, Point
from research.tests.searches import MIXED, calls_to, designs_asked, mixed_bowl

SQUARE = Space.continuous([0.0, 0.0], [1.0, 1.0])

LOCAL = pytest.mark.parametrize("method", ["global-unirandi", "global-nelder-mead", "global-bfgs"])


def point(x: float, y: float, fitness: float) -> Point:
    return Point(np.array([x, y]), fitness)


def clusters_of(sample: list[Point], critical: float = 0.15, space: Space = SQUARE) -> Clusters:
    clusters = Clusters(Axes(space))
    clusters.critical = critical
    clusters.reduce(sample)
    return clusters


def test_the_critical_distance_is_the_sources() -> None:
    """b = (1 - alpha^(1/(N - 1)))^(1/n) in the box from -1 to 1, here half as large."""
    assert 2.0 * critical_distance(101, 2, 0.01) == pytest.approx((1.0 - 0.01**0.01) ** 0.5)
    assert critical_distance(1001, 2, 0.01) < critical_distance(101, 2, 0.01)
    assert critical_distance(101, 2, 0.001) > critical_distance(101, 2, 0.01)


def test_a_chain_of_worse_and_worse_points_is_one_cluster() -> None:
    chain = [point(0.1 * k, 0.5, 1.0 + k) for k in range(1, 5)]
    far = point(0.9, 0.5, 9.0)
    clusters = clusters_of([*chain, far])
    clusters.add(chain[0], point(0.05, 0.5, 0.0))
    assert clusters.unclustered() is far


def test_a_point_that_is_better_than_its_neighbour_in_a_cluster_stays_out() -> None:
    best, worse, pit = point(0.1, 0.5, 1.0), point(0.2, 0.5, 3.0), point(0.3, 0.5, 2.0)
    clusters = clusters_of([best, pit, worse])
    clusters.add(best, point(0.1, 0.5, 0.5))
    assert clusters.unclustered() is pit


def test_a_search_that_ends_at_a_known_minimum_joins_its_cluster() -> None:
    first, second = point(0.1, 0.5, 1.0), point(0.9, 0.5, 2.0)
    clusters = clusters_of([first, second])
    clusters.add(first, point(0.5, 0.5, 0.2))
    clusters.add(second, point(0.501, 0.5, 0.1))
    assert [minimum.fitness for minimum in clusters.minima] == [0.1]
    assert clusters.unclustered() is None


def test_a_search_that_ends_elsewhere_founds_a_cluster() -> None:
    first, second = point(0.1, 0.5, 1.0), point(0.9, 0.5, 2.0)
    clusters = clusters_of([first, second])
    clusters.add(first, point(0.1, 0.5, 0.2))
    clusters.add(second, point(0.9, 0.5, 0.3))
    assert [minimum.fitness for minimum in clusters.minima] == [0.2, 0.3]


def test_points_of_a_later_cycle_join_clusters_before_any_search() -> None:
    first, later = point(0.1, 0.5, 1.0), point(0.2, 0.5, 1.5)
    clusters = clusters_of([first])
    clusters.add(first, point(0.1, 0.5, 0.2))
    clusters.reduce([first, later])
    assert clusters.unclustered() is later
    clusters.grow()
    assert clusters.unclustered() is None


def test_another_choice_is_another_cluster() -> None:
    space = Space([Axis(0.0, 1.0), Axis(0.0, 9.0, "categorical")])
    near, other = point(0.1, 0.05, 1.0), point(0.1, 0.15, 2.0)
    clusters = clusters_of([near, other], critical=0.3, space=space)
    clusters.add(near, near)
    assert clusters.unclustered() is other


def test_failed_evaluations_are_not_started_from() -> None:
    assert clusters_of([point(0.1, 0.5, np.inf)]).unclustered() is None


@LOCAL
def test_a_cycle_begins_with_its_sample_in_one_batch(method: str) -> None:
    asked = designs_asked(
        method, SQUARE, lambda x: x[:, 0], 60, particles=100, sample_per_variable=7
    )
    assert len(asked[0]) == 14


@LOCAL
def test_one_valley_is_searched_once_a_cycle_and_two_from_both(method: str) -> None:
    def two_wells(x: Floats) -> Floats:
        left, right = np.square(x - 0.2).sum(axis=1), np.square(x - 0.8).sum(axis=1) + 0.05
        return 1.0 + np.minimum(left, right)

    x = np.vstack(designs_asked(method, SQUARE, two_wells, 250))
    for minimum in (0.2, 0.8):
        assert (np.abs(x - minimum).max(axis=1) < 0.01).any()


@LOCAL
def test_what_joins_a_known_cluster_is_not_searched_from(method: str) -> None:
    def bowl(x: Floats) -> Floats:
        return 1.0 + np.square(x - 0.4).sum(axis=1)

    asked = designs_asked(
        method, SQUARE, bowl, 1200, particles=1000, sample_per_variable=100, alpha=1e-6
    )
    assert [len(designs) for designs in asked[-3:-1]] == [200, 200]
    assert sum(len(designs) == 200 for designs in asked) > 3


@LOCAL
def test_a_mixed_optimum_is_found(method: str) -> None:
    calls = [
        calls_to(1e-2, designs_asked(method, MIXED, mixed_bowl, 600, seed), mixed_bowl)
        for seed in range(5)
    ]
    assert np.median(calls) < 400
