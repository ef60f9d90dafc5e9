"""Eq. 3.1, 3.8, 4.1 and 4.2 against the thesis's published numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import ValidationError

from gaitswarm.services.optimizer.jobs.preference import (
    PREFERENCES,
    Preference,
    PreferenceName,
    figure_of_merit,
    judge,
    log_utilities,
    objective_vectors,
)
from gaitswarm.sim.outcome import Outcome, Status

TABLE_3_6 = (8.71, 1.77, 16.09, 41.96)
SPEED = 0.156
HEIGHT_LOSS = 3.8e-3


def outcome(*rows: tuple[float, ...], statuses: tuple[int, ...] | None = None) -> Outcome:
    """Rows of f1..f5 or f1..f6."""
    return Outcome(
        np.array([(*row, 0.0)[:6] for row in rows]),
        np.array(statuses or [Status.OK] * len(rows), dtype=np.uint8),
    )


def worth(
    outcomes: list[Outcome], preference: Preference
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    objectives = np.stack([outcome.objectives for outcome in outcomes], axis=1)
    failed = np.stack([outcome.statuses != Status.OK for outcome in outcomes], axis=1)
    judged = judge(objectives, failed, preference)
    return judged.fitness, judged.utilities


def utility(row: tuple[float, ...], preference: Preference) -> float:
    _, utilities = worth([outcome(row)], preference)
    return float(utilities[0, 0])


def test_published_objectives_give_the_published_utility_with_f5_the_reciprocal_speed() -> None:
    assert utility((*TABLE_3_6, 1.0 / SPEED), PREFERENCES["A"]) == pytest.approx(21.05, abs=0.01)


def test_with_f5_the_speed_itself_the_published_utility_is_missed() -> None:
    assert utility((*TABLE_3_6, SPEED), PREFERENCES["A"]) == pytest.approx(17.2, abs=0.05)


def test_preference_c_is_the_plain_product() -> None:
    row = (*TABLE_3_6, 1.0 / SPEED)
    assert utility(row, PREFERENCES["C"]) == pytest.approx(math.prod(row), rel=1e-14)


def test_the_published_row_gives_the_published_figure_of_merit_of_chapter_3() -> None:
    """Printed is 6.887, of inputs that were not rounded."""
    row = (*TABLE_3_6, 1.0 / SPEED, HEIGHT_LOSS)
    chapter_3 = PREFERENCES["chapter-3"]
    fitness, _ = worth([outcome(row)], chapter_3)
    direct = 1e5 * SPEED**2 / (math.prod(TABLE_3_6) * (abs(HEIGHT_LOSS) + 0.03))
    assert figure_of_merit(float(fitness[0]), chapter_3) == pytest.approx(direct, rel=1e-12)
    assert direct == pytest.approx(6.92, abs=0.005)


def test_the_figure_of_merit_of_several_walks_is_the_geometric_mean_of_theirs() -> None:
    rows = [(*TABLE_3_6, 6.4, HEIGHT_LOSS), (1.0, 2.0, 3.0, 4.0, 5.0, 0.01)]
    chapter_3 = PREFERENCES["chapter-3"]
    fitness, utilities = worth([outcome(row) for row in rows], chapter_3)
    each = [1e5 / value for value in utilities[0].tolist()]
    together = figure_of_merit(float(fitness[0]), chapter_3)
    assert together == pytest.approx(math.sqrt(each[0] * each[1]), rel=1e-12)


@pytest.mark.parametrize("name", ["A", "B", "C"])
def test_only_chapter_3_has_a_figure_of_merit(name: PreferenceName) -> None:
    assert figure_of_merit(20.0, PREFERENCES[name]) is None


@pytest.mark.parametrize("fitness", [math.inf, math.nan, 0.0, 5e-324])
def test_a_failed_or_impossible_fitness_has_no_figure_of_merit(fitness: float) -> None:
    assert figure_of_merit(fitness, PREFERENCES["chapter-3"]) is None


def test_a_loss_of_height_counts_by_its_size_whatever_its_sign() -> None:
    rising, sinking = ((*TABLE_3_6, 6.4, sign * 0.01) for sign in (-1.0, 1.0))
    level = (*TABLE_3_6, 6.4, 0.0)
    chapter_3 = PREFERENCES["chapter-3"]
    assert utility(rising, chapter_3) == utility(sinking, chapter_3)
    assert utility(level, chapter_3) / utility(sinking, chapter_3) == pytest.approx(0.03 / 0.04)


def test_a_sixth_objective_without_a_weight_changes_no_bit() -> None:
    five = PREFERENCES["A"]
    six = Preference(bias=(*five.bias, 0.03), exponent=(*five.exponent, 0.0))
    row = (*TABLE_3_6, 6.4, HEIGHT_LOSS)
    assert utility(row, six) == utility(row, five)


def test_fitness_is_the_geometric_mean_over_the_scenarios() -> None:
    first, second = (2.0, 3.0, 5.0, 7.0, 11.0), (1.0, 4.0, 9.0, 16.0, 25.0)
    fitness, utilities = worth([outcome(first), outcome(second)], PREFERENCES["B"])
    assert utilities.shape == (1, 2)
    assert fitness[0] == pytest.approx(math.sqrt(math.prod(utilities[0])), rel=1e-14)


def test_a_design_that_fails_in_one_scenario_is_worth_nothing() -> None:
    row = (*TABLE_3_6, 6.4)
    good = outcome(row, row)
    bad = outcome(row, (math.nan,) * 5, statuses=(Status.OK, Status.FELL))
    fitness, utilities = worth([good, bad], PREFERENCES["A"])
    assert math.isfinite(fitness[0]) and math.isinf(fitness[1])
    assert np.isfinite(utilities[:, 0]).all() and math.isinf(utilities[1, 1])


@pytest.mark.parametrize("name", ["A", "B", "C", "chapter-3"])
def test_fitness_is_the_product_of_the_powers_of_an_objective_vector(name: PreferenceName) -> None:
    preference = PREFERENCES[name]
    rng = np.random.default_rng(1)
    objectives = rng.uniform(0.01, 50.0, (4, 3, 6))
    objectives[:, :, 5] -= 25.0
    failed = np.zeros((4, 3), dtype=bool)
    vectors = objective_vectors(objectives, failed, preference.bias)
    assert (vectors ** np.array(preference.exponent)).prod(axis=1) == pytest.approx(
        judge(objectives, failed, preference).fitness
    )


def test_without_biases_an_objective_vector_is_of_plain_geometric_means_in_their_units() -> None:
    objectives = np.array([[(1.0, 2.0, 3.0, 4.0, 5.0, 0.0), (4.0, 8.0, 12.0, 0.0, 5.0, 0.0)]])
    (vector,) = objective_vectors(objectives, np.zeros((1, 2), dtype=bool))
    assert vector == pytest.approx([2.0, 4.0, 6.0, 0.0, 5.0])


def test_a_design_that_fails_anywhere_is_infinite_in_every_objective() -> None:
    objectives = np.ones((3, 2, 6))
    objectives[1, 0, 2] = np.nan
    vectors = objective_vectors(objectives, np.array([[False, True], [False, False], [False] * 2]))
    assert np.isposinf(vectors).all(axis=1).tolist() == [True, True, False]
    assert not np.isposinf(vectors[2]).any()


def test_a_failure_beats_a_perfect_scenario() -> None:
    perfect = outcome((0.0,) * 5)
    fallen = outcome((1.0,) * 5, statuses=(Status.FELL,))
    fitness, _ = worth([perfect, fallen], PREFERENCES["C"])
    assert math.isinf(fitness[0])


def test_an_undefined_objective_counts_only_if_it_has_a_weight() -> None:
    without_energy = Preference(bias=(0.0,) * 5, exponent=(1.0, 1.0, 1.0, 0.0, 1.0))
    row = np.array([[2.0, 3.0, 5.0, math.nan, 7.0, 0.0]])
    ok = np.array([False])
    assert math.exp(log_utilities(row, ok, without_energy)[0]) == pytest.approx(210.0)
    assert math.isinf(log_utilities(row, ok, PREFERENCES["A"])[0])


@given(
    rows=st.lists(st.tuples(*[st.floats(0.0, 5e5)] * 5), min_size=1, max_size=6),
    bias=st.tuples(*[st.floats(0.0, 5e5)] * 5),
    exponent=st.tuples(*[st.floats(0.01, 10.0)] * 5),
)
@example(rows=[(5e5,) * 5], bias=(5e5,) * 5, exponent=(10.0,) * 5)
def test_no_factors_up_to_a_million_overflow(
    rows: list[tuple[float, ...]], bias: tuple[float, ...], exponent: tuple[float, ...]
) -> None:
    fitness, utilities = worth(
        [outcome(row) for row in rows], Preference(bias=bias, exponent=exponent)
    )
    assert np.isfinite(fitness).all() and np.isfinite(utilities).all()


def test_a_utility_beyond_a_double_is_infinite_as_that_of_a_failed_walk() -> None:
    largest = Preference(bias=(1e6,) * 5, exponent=(10.0,) * 5)
    fitness, utilities = worth([outcome((1e6,) * 5)], largest)
    assert fitness.tolist() == [math.inf]
    assert utilities.tolist() == [[math.inf]]


@pytest.mark.parametrize(
    ("field", "values"),
    [
        ("bias", (-0.1, 0.0, 0.0, 0.0, 0.0)),
        ("exponent", (-1.0, 1.0, 1.0, 1.0, 1.0)),
        ("exponent", (math.nan, 1.0, 1.0, 1.0, 1.0)),
        ("exponent", (0.0,) * 5),
        ("exponent", (1.0,) * 6),
        ("bias", (0.0,) * 4),
        ("bias", (0.0,) * 7),
    ],
)
def test_a_preference_that_cannot_rank_is_refused(field: str, values: tuple[float, ...]) -> None:
    sound = {"bias": (0.0,) * 5, "exponent": (1.0,) * 5}
    with pytest.raises(ValidationError, match=field):
        Preference.model_validate(sound | {field: values})
