"""Ranking by another preference: the job's own arithmetic, vectorized."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitswarm.services.optimizer.analysis.preferences import RankingView, rank
from gaitswarm.services.optimizer.analysis.utilities import fitness_by, log_utilities, utilities
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, Preference, judge
from gaitswarm.sim.outcome import Status
from tests.optimizer.columns import columns_of

objective = st.one_of(
    st.floats(-1.0, 1e6), st.sampled_from([0.0, -0.9, math.nan, math.inf, 1e-300, 5e-324])
)


def preferences(entries: int) -> st.SearchStrategy[Preference]:
    """Preferences of so many objectives."""
    return st.builds(
        Preference,
        bias=st.tuples(*[st.floats(0.0, 1e6)] * entries),
        exponent=st.tuples(*[st.one_of(st.just(0.0), st.floats(0.01, 10.0))] * entries).filter(any),
    )


preference = st.one_of(preferences(5), preferences(6))


@given(
    rows=st.lists(st.tuples(*[objective] * 12), min_size=1, max_size=8),
    statuses=st.lists(st.sampled_from([Status.OK, Status.OK, Status.FELL]), min_size=16),
    weights=preference,
)
def test_it_agrees_with_the_jobs_own_arithmetic(
    rows: list[tuple[float, ...]], statuses: list[Status], weights: Preference
) -> None:
    objectives = np.array(rows).reshape(-1, 2, 6)
    ended = np.array(statuses[: 2 * len(rows)], dtype=np.uint8).reshape(-1, 2)
    columns = columns_of(objectives, ended)

    exact = judge(objectives, ended != Status.OK, weights)
    fast = log_utilities(columns, weights)

    np.testing.assert_allclose(fast, exact.log_utilities, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(fitness_by(columns, weights), exact.fitness, rtol=1e-12)


def test_more_rows_than_a_block_are_all_judged() -> None:
    objectives = np.random.default_rng(1).uniform(0.1, 50.0, (9001, 3, 6))
    columns = columns_of(objectives)
    exact = judge(objectives, columns.failed, PREFERENCES["B"])
    fast = fitness_by(columns, PREFERENCES["B"])
    np.testing.assert_allclose(fast, exact.fitness, rtol=1e-12)


def test_utilities_are_by_the_jobs_own_preference() -> None:
    spec = JobSpec(scenarios=("1", "2"), preference="B")
    columns = columns_of(np.random.default_rng(2).uniform(0.1, 50.0, (5, 2, 6)))
    exact = spec.judge(columns.objectives, columns.failed).utilities
    np.testing.assert_allclose(utilities(columns, spec), exact, rtol=1e-12)


def two_objectives(*pairs: tuple[float, float]) -> np.ndarray:
    """One scenario: torque and energy, all others one."""
    return np.array([[[torque, 1.0, 1.0, energy, 1.0, 0.0]] for torque, energy in pairs])


def ranked(columns: EvaluationColumns, preference: Preference, top: int) -> RankingView:
    """Iterations of its designs are their rows, where each has one particle."""
    spec = JobSpec(scenarios=("1",), preference=preference)
    designs = np.zeros((len(columns), len(spec.design_space().names)))
    return rank(replace(columns, designs=designs), spec, top=top)


TORQUE = Preference(bias=(0.0,) * 5, exponent=(1.0, 0.0, 0.0, 0.0, 0.0))
ENERGY = Preference(bias=(0.0,) * 5, exponent=(0.0, 0.0, 0.0, 1.0, 0.0))


def test_another_preference_puts_other_designs_first() -> None:
    columns = columns_of(two_objectives((1, 9), (2, 8), (3, 7)), preference=TORQUE)
    ranking = ranked(columns, ENERGY, top=2)
    assert [(d.iteration, d.rank, d.rank_before) for d in ranking.top] == [(2, 1, 3), (1, 2, 2)]
    assert [d.fitness for d in ranking.top] == pytest.approx([7.0, 8.0])
    assert ranking.fitness_of_present_best == pytest.approx(9.0)
    assert ranking.correlation == pytest.approx(-1.0)


def test_a_preference_of_six_objectives_ranks_by_the_size_of_the_height_loss() -> None:
    objectives = two_objectives((1, 1), (2, 2), (3, 3))
    objectives[:, 0, 5] = (-0.03, 0.02, 0.01)
    height = Preference(bias=(0.0,) * 6, exponent=(0.0,) * 5 + (1.0,))
    ranking = ranked(columns_of(objectives, preference=TORQUE), height, top=3)
    assert [(d.iteration, d.rank_before) for d in ranking.top] == [(2, 3), (1, 2), (0, 1)]
    assert [d.fitness for d in ranking.top] == pytest.approx([0.01, 0.02, 0.03])


def test_the_jobs_own_preference_changes_nothing() -> None:
    columns = columns_of(two_objectives((3, 1), (1, 2), (2, 9)), preference=TORQUE)
    ranking = ranked(columns, TORQUE, top=3)
    assert [d.rank_before for d in ranking.top] == [1, 2, 3]
    assert ranking.correlation == pytest.approx(1.0)
    assert ranking.fitness_of_present_best == ranking.top[0].fitness


def test_of_equal_designs_the_earliest_is_first() -> None:
    ranking = ranked(columns_of(two_objectives((1, 5), (2, 5), (3, 4))), ENERGY, top=3)
    assert [d.iteration for d in ranking.top] == [2, 0, 1]


def test_a_design_that_failed_has_no_rank() -> None:
    fell = np.array([[Status.FELL], [Status.OK]], dtype=np.uint8)
    columns = columns_of(two_objectives((1, 1), (2, 2)), fell, preference=TORQUE)
    ranking = ranked(columns, ENERGY, top=5)
    assert [d.iteration for d in ranking.top] == [1]
    assert ranking.correlation is None


def test_a_design_without_a_weighted_objective_ranks_only_without_it() -> None:
    columns = columns_of(two_objectives((1, math.nan), (2, 2)), preference=ENERGY)
    first = ranked(columns, TORQUE, top=5).top[0]
    assert (first.iteration, first.rank_before) == (0, None)


def test_without_any_evaluation_there_is_no_ranking() -> None:
    ranking = ranked(columns_of(np.empty((0, 2, 6))), TORQUE, top=5)
    assert (ranking.top, ranking.fitness_of_present_best, ranking.correlation) == ([], None, None)
    assert ranking.best_so_far == []


def test_the_best_so_far_is_by_iteration_and_never_rises() -> None:
    torques = [(t, 1.0) for t in (9.0, 9.0, 5.0, 4.0, 6.0, 7.0, 3.0, 9.0)]
    statuses = np.array([[t == 9.0] for t, _ in torques], dtype=np.uint8) * np.uint8(Status.FELL)
    ranking = ranked(columns_of(two_objectives(*torques), statuses, particles=2), TORQUE, top=1)
    assert [entry.index for entry in ranking.best_so_far] == [0, 1, 2, 3]
    expected = [None, pytest.approx(4.0), pytest.approx(4.0), pytest.approx(3.0)]
    assert [entry.fitness for entry in ranking.best_so_far] == expected


def test_the_correlation_is_spearmans_with_shared_ranks() -> None:
    columns = columns_of(two_objectives((1, 1), (2, 3), (2, 2), (9, 4)), preference=TORQUE)
    # Ranks 1, 2.5, 2.5, 4 and 1, 3, 2, 4: covariance 4.5, squares 4.5 and 5.
    expected = 4.5 / math.sqrt(4.5 * 5.0)
    assert ranked(columns, ENERGY, top=1).correlation == pytest.approx(expected)


def test_designs_that_are_all_equal_have_no_correlation() -> None:
    columns = columns_of(two_objectives((1, 1), (1, 1)), preference=TORQUE)
    assert ranked(columns, ENERGY, top=1).correlation is None
