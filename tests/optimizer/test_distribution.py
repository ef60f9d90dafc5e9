"""Distribution of designs, and its thinning for pictures."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitswarm.services.optimizer.analysis.distribution import (
    QUANTILES,
    distribution,
    finite_quantiles,
    thinned,
)
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.sim.variables import Variable
from tests.optimizer.columns import columns_of, fitness_only

INF = math.inf
A, B = (Variable(name=name, low=0.0, high=10.0) for name in "ab")
SPACE = DesignSpace((A,), (("b", 3.0),), (A, B))


@given(st.lists(st.floats(-1e9, 1e9), min_size=1, max_size=9), st.integers(0, 3))
def test_quantiles_are_numpys_over_the_finite_values(values: list[float], failed: int) -> None:
    row = np.array([[*values, *[INF] * failed]])
    expected = np.quantile(values, QUANTILES)
    np.testing.assert_allclose(finite_quantiles(row, QUANTILES)[0], expected, rtol=1e-9, atol=1e-6)


def test_failed_designs_are_counted_and_left_out() -> None:
    found = distribution(fitness_only((4.0, INF, 2.0), (INF, INF, INF)), SPACE)
    assert [(item.index, item.failed, item.mean) for item in found.items] == [
        (0, 1, 3.0),
        (1, 3, None),
    ]
    assert found.items[0].fitness[::3] == [2.0, 3.0, 4.0]
    assert set(found.items[1].fitness) == {None}
    assert found.next is None


def test_a_page_ends_before_the_iterations_that_follow() -> None:
    found = distribution(fitness_only((4.0,), (3.0,), (2.0,)), DesignSpace((A,), (), (A,)), limit=2)
    assert [item.mean for item in found.items] == [4.0, 3.0]
    assert found.next == "1"


def test_diversity_is_a_share_of_the_range_of_what_is_searched() -> None:
    designs = np.array([[0.0, 3.0], [10.0, 3.0], [4.0, 3.0], [4.0, 3.0]])
    columns = columns_of(np.ones((4, 1, 6)), particles=2, designs=designs)
    assert [item.diversity for item in distribution(columns, SPACE).items] == [0.5, 0.0]


def test_no_iteration_has_no_distribution() -> None:
    found = distribution(columns_of(np.empty((0, 1, 6)), designs=np.empty((0, 2))), SPACE)
    assert found.items == []


def test_few_evaluations_are_not_thinned() -> None:
    assert thinned(fitness_only((1.0, 2.0), (3.0, 4.0)), 4).tolist() == [0, 1, 2, 3]


def test_whole_iterations_are_chosen_evenly_from_the_first_to_the_last() -> None:
    swarms = [(9.0, 9.0)] * 101
    swarms[77] = (9.0, 1.0)
    rows = thinned(fitness_only(*swarms), 11)
    assert rows.tolist() == [0, 1, 50, 51, 100, 101, 150, 151, 155, 200, 201]


@pytest.mark.parametrize("most", [1, 2, 3, 7])
def test_an_iteration_that_is_too_large_is_thinned_itself(most: int) -> None:
    fitness = [9.0] * 100
    fitness[42] = 1.0
    rows = thinned(fitness_only(tuple(fitness)), most)
    assert 1 <= len(rows) <= most
    assert 42 in rows


@given(st.integers(1, 40), st.integers(1, 12), st.integers(1, 60))
def test_thinning_keeps_to_its_limit_and_the_best(
    iterations: int, particles: int, most: int
) -> None:
    fitness = np.random.default_rng(iterations).random((iterations, particles))
    rows = thinned(fitness_only(*map(tuple, fitness)), most)
    assert len(rows) <= most
    assert int(np.argmin(fitness)) in rows
    assert (np.diff(rows) > 0).all()
