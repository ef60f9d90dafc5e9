"""The share of a box that points dominate."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitswarm.services.optimizer.analysis.front import hypervolume_curve

LARGEST_ERROR = 0.008
"""Five standard deviations of a half, estimated from 100 000 points."""


def by_inclusion_and_exclusion(points: np.ndarray) -> float:
    """Volume of a union of boxes [point, 1)."""
    clipped = np.clip(points, 0.0, 1.0)
    return sum(
        (-1.0) ** (size + 1) * float(np.prod(1.0 - np.max(chosen, axis=0)))
        for size in range(1, len(points) + 1)
        for chosen in combinations(clipped, size)
    )


def sphere(count: int, seed: int) -> np.ndarray:
    """(count, 5) points of which none dominates another."""
    directions = np.abs(np.random.default_rng(seed).normal(size=(count, 5)))
    return np.asarray(1.0 - directions / np.linalg.norm(directions, axis=1)[:, None])


@pytest.mark.parametrize(
    ("points", "volumes"),
    [
        ([[0.0, 0.0, 0.0, 0.0, 0.0]], [1.0]),
        ([[0.5, 0.5, 0.5, 0.5, 0.5]], [0.5**5]),
        ([[0.5, 0.5], [0.25, 0.75], [0.5, 0.5]], [0.25, 0.3125, 0.3125]),
        # What dominates an earlier point, and what lies on or beyond the reference point.
        ([[0.5, 0.5], [0.0, 0.5], [1.0, 0.0], [2.0, -1.0]], [0.25, 0.5, 0.5, 0.5]),
        # Better than the ideal counts as the ideal.
        ([[-1.0, 0.5]], [0.5]),
    ],
)
def test_known_volumes(points: list[list[float]], volumes: list[float]) -> None:
    curve, error = hypervolume_curve(np.array(points))
    np.testing.assert_allclose(curve, volumes, atol=LARGEST_ERROR)
    assert error == pytest.approx(np.sqrt(curve[-1] * (1.0 - curve[-1]) / 100_000))


@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 8),
    objectives=st.integers(1, 6),
    values=st.sampled_from([3, 5, 10_000]),
)
def test_it_is_the_volume_of_the_union_after_each_point(
    seed: int, count: int, objectives: int, values: int
) -> None:
    # Few values make many equal coordinates, among them those of dominated and of equal points.
    drawn = np.random.default_rng(seed).integers(0, values + 1, (count, objectives))
    points = drawn / values
    expected = [by_inclusion_and_exclusion(points[:k]) for k in range(1, count + 1)]
    np.testing.assert_allclose(hypervolume_curve(points)[0], expected, atol=LARGEST_ERROR)


@pytest.mark.thorough("test_it_is_the_volume_of_the_union_after_each_point")
def test_a_front_of_hundreds_agrees_with_points_drawn_at_random() -> None:
    points = sphere(300, seed=3)
    drawn = np.random.default_rng(4).random((40_000, 5))
    dominated = np.zeros(len(drawn), dtype=bool)
    for point in points:
        dominated |= (drawn >= point).all(axis=1)
    error = np.sqrt(dominated.mean() * (1.0 - dominated.mean()) / len(drawn))
    assert hypervolume_curve(points)[0][-1] == pytest.approx(dominated.mean(), abs=5.0 * error)


def test_it_never_falls_and_the_order_of_points_does_not_matter_to_the_whole() -> None:
    points = sphere(100, seed=6)
    (forwards, error), (backwards, _) = hypervolume_curve(points), hypervolume_curve(points[::-1])
    assert 0.0 < error < 0.002
    assert (np.diff(forwards) >= 0.0).all()
    assert forwards[-1] == backwards[-1]
