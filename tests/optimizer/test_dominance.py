"""Designs that no other dominates."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitswarm.services.optimizer.analysis import front
from gaitswarm.services.optimizer.analysis.front import non_dominated


def by_definition(points: np.ndarray) -> np.ndarray:
    """Every pair compared: (r,), true for points that no other dominates."""
    no_worse = (points[:, None] <= points[None]).all(axis=2)
    better = (points[:, None] < points[None]).any(axis=2)
    return np.asarray(~(no_worse & better).any(axis=0) & np.isfinite(points).all(axis=1))


@given(
    seed=st.integers(0, 2**32 - 1),
    rows=st.integers(0, 60),
    objectives=st.integers(1, 6),
    values=st.sampled_from([2, 4, 1000]),
    block=st.sampled_from([1, 4, 100]),
)
def test_it_is_what_the_definition_says(
    seed: int, rows: int, objectives: int, values: int, block: int
) -> None:
    # Few values make many that are equal, and small blocks divide few points.
    points = np.random.default_rng(seed).integers(0, values, (rows, objectives)).astype(np.float64)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(front, "_BLOCK", block)
        assert non_dominated(points).tolist() == by_definition(points).tolist()


@pytest.mark.thorough("test_it_is_what_the_definition_says")
def test_thousands_of_points_agree_with_the_definition() -> None:
    points = np.random.default_rng(1).integers(0, 30, (3000, 5)).astype(np.float64)
    assert non_dominated(points).tolist() == by_definition(points).tolist()


def test_of_equal_points_none_dominates_the_other() -> None:
    assert non_dominated(np.array([[1.0, 2.0], [1.0, 2.0], [2.0, 2.0]])).tolist() == [
        True,
        True,
        False,
    ]


def test_what_has_no_objectives_is_on_no_front() -> None:
    points = np.array([[np.inf, np.inf], [1.0, 5.0], [0.0, np.inf]])
    assert non_dominated(points).tolist() == [False, True, False]
    assert not non_dominated(points[:1]).any()


@pytest.mark.thorough("a large front")
def test_a_hundred_thousand_points_of_which_none_is_dominated_take_seconds() -> None:
    directions = np.abs(np.random.default_rng(2).normal(size=(100_000, 5)))
    points = -directions / np.linalg.norm(directions, axis=1)[:, None]
    before = time.process_time()
    assert non_dominated(points).all()
    assert time.process_time() - before < 30.0
