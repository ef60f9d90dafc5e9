"""The preference under which a design wins its job."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitswarm.services.optimizer.analysis.preferences import PreferenceFitView, preference_for
from gaitswarm.services.optimizer.analysis.utilities import fitness_by
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import Aggregation, TuningWorlds
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, Preference
from tests.examples.columns import columns_of

A, C = PREFERENCES["A"], PREFERENCES["C"]


def fits_of(
    columns: EvaluationColumns, row: int, own: Preference, worlds: TuningWorlds | None = None
) -> list[PreferenceFitView]:
    return preference_for(columns, row, JobSpec(preference=own, worlds=worlds)).fits


def rival_of(fit: PreferenceFitView) -> int | None:
    """Row of a fit's rival: each iteration has one particle."""
    return None if fit.rival is None else fit.rival.iteration


def history(rows: int, seed: int, scenarios: int = 2) -> np.ndarray:
    """(rows, scenarios, 5) objectives."""
    return np.exp(0.3 * np.random.default_rng(seed).normal(size=(rows, scenarios, 5)))


@given(
    exponent=st.lists(st.floats(0.05, 1.0), min_size=5, max_size=5),
    owner=st.sampled_from(["A", "B", "C"]),
    seed=st.integers(0, 1000),
)
def test_every_winner_under_some_preference_is_found_to_win(
    exponent: list[float], owner: str, seed: int
) -> None:
    own = PREFERENCES[owner]  # type: ignore[index]
    columns = columns_of(history(30, seed), own=own)
    asked = Preference(bias=own.bias, exponent=tuple(exponent))
    row = int(fitness_by(columns, asked).argmin())
    best = fits_of(columns, row, own)[0]
    assert best.rank == 1
    fitness = fitness_by(columns, best.preference)
    assert fitness.argmin() == row
    others = np.delete(fitness, row)
    assert best.fitness == fitness[row]
    power = 1.0 / sum(best.preference.exponent)
    assert best.margin == pytest.approx((others.min() / fitness[row]) ** power - 1.0)
    rival = rival_of(best)
    assert rival is not None
    assert fitness[rival] == others.min()


def test_it_wins_by_as_much_as_it_can() -> None:
    columns = columns_of(history(40, seed=1), own=C)
    row = int(fitness_by(columns, C).argmin())
    (best,) = [fit for fit in fits_of(columns, row, C) if "job" in fit.biases_of]
    assert best.margin is not None
    generator = np.random.default_rng(2)
    for exponent in generator.dirichlet(np.ones(5), size=300):
        fitness = fitness_by(columns, Preference(bias=C.bias, exponent=tuple(exponent.tolist())))
        # Exponents are rounded to four decimals.
        assert np.delete(fitness, row).min() / fitness[row] - 1.0 <= best.margin + 1e-3


def test_a_dominated_design_cannot_win_and_its_rival_is_named() -> None:
    objectives = history(30, seed=3)
    objectives[7] = objectives[4] * 1.01
    columns = columns_of(objectives, own=A)
    fits = fits_of(columns, 7, A)
    assert [fit.biases_of for fit in fits if "C" in fit.biases_of] == [["C"]]
    for fit in fits:
        assert fit.rank > 1
        assert fit.margin is not None and fit.margin < 0.0
        fitness = fitness_by(columns, fit.preference)
        assert fit.rank == 1 + np.count_nonzero(fitness < fitness[7])
        assert rival_of(fit) == int(fitness.argmin())
    assert [fit.rank for fit in fits] == sorted(fit.rank for fit in fits)


def test_a_design_on_the_front_but_within_its_hull_cannot_win_without_biases() -> None:
    corners = np.ones((5, 5)) - 0.9 * np.eye(5)
    objectives = np.vstack([corners, np.full((1, 5), 0.99)])
    columns = columns_of(objectives, own=C)
    without = [fit for fit in fits_of(columns, 5, C) if "C" in fit.biases_of]
    assert without[0].rank > 1
    # Every corner wins.
    for row in range(5):
        assert fits_of(columns, row, C)[0].rank == 1


def test_a_design_that_wins_among_thousands_of_close_rivals_is_found_to_win() -> None:
    directions = np.abs(np.random.default_rng(4).normal(size=(3000, 5)))
    columns = columns_of(np.exp(-directions / np.linalg.norm(directions, axis=1)[:, None]), own=C)
    # Every one of them wins when exponents are in proportion to its own logarithms.
    for row in (0, 1000, 2000):
        best = fits_of(columns, row, C)[0]
        assert best.rank == 1
        assert best.margin is not None and best.margin > 0.0


def test_where_it_cannot_win_its_rank_is_no_worse_than_by_any_objective_alone() -> None:
    objectives = history(200, seed=5)
    # In energy second to one that is better in all.
    objectives[17] = 3.0
    objectives[17, :, 3] = 0.05
    objectives[18] = 2.9
    objectives[18, :, 3] = 0.04
    columns = columns_of(objectives, own=C)
    fits = fits_of(columns, 17, C)
    assert [(fit.rank, rival_of(fit)) for fit in fits] == [(2, 18)] * 3


def test_biases_are_the_jobs_and_those_of_table_4_5_each_once() -> None:
    columns = columns_of(history(20, seed=7), own=A)
    names = [fit.biases_of for fit in fits_of(columns, 0, A)]
    assert sorted(names) == [["B"], ["C"], ["job", "A"]]
    chapter_3 = PREFERENCES["chapter-3"]
    own = [fit for fit in fits_of(columns, 0, chapter_3) if "job" in fit.biases_of]
    assert len(own[0].preference.exponent) == 6


def test_equal_designs_share_their_place_and_failed_ones_are_no_rivals() -> None:
    objectives = history(20, seed=8)
    columns = columns_of(objectives, own=C)
    row = int(fitness_by(columns, C).argmin())
    twice = columns_of(np.concatenate([objectives, objectives[[row]]]), own=C)
    first, second = (fits_of(twice, k, C)[0] for k in (row, 20))
    assert (first.rank, second.rank, first.margin) == (1, 1, second.margin)
    worst = int(fitness_by(columns, C).argmax())
    alone = columns_of(objectives, failed=tuple(k for k in range(20) if k != worst), own=C)
    best = fits_of(alone, worst, C)[0]
    assert (best.rank, best.rival, best.margin) == (1, None, None)


def test_exponents_sum_to_one_and_are_short() -> None:
    columns = columns_of(history(50, seed=9), own=C)
    row = int(fitness_by(columns, C).argmin())
    best = fits_of(columns, row, C)[0]
    assert sum(best.preference.exponent) == pytest.approx(1.0, abs=1e-3)
    assert all(e == round(e, 4) for e in best.preference.exponent)


def test_exponents_are_not_rounded_where_that_would_cost_the_place() -> None:
    # The third is just below the straight line between the first two.
    ends = np.array([[0.0, 1.0], [math.pi / 3.0, 0.0]])
    first_two = np.vstack([ends, ends.mean(axis=0) - 1e-6])
    columns = columns_of(np.exp(np.hstack([first_two, np.zeros((3, 3))])), own=C)
    (fit,) = [fit for fit in fits_of(columns, 2, C) if "C" in fit.biases_of]
    assert fit.rank == 1
    across, up = fit.preference.exponent[:2]
    assert up / across == pytest.approx(math.pi / 3.0, abs=1e-5)
    assert any(e != round(e, 4) for e in fit.preference.exponent)


def test_in_worlds_ranks_are_by_what_the_job_makes_of_all_worlds() -> None:
    worlds = TuningWorlds(count=2, aggregate="cvar", level=0.5)
    columns = columns_of(history(40, seed=10, scenarios=4), own=A, aggregation=Aggregation(worlds))
    row = int(columns.fitness.argmin())
    best = fits_of(columns, row, A, worlds)[0]
    fitness = fitness_by(columns, best.preference, aggregation=Aggregation(worlds))
    assert best.rank == 1 + np.count_nonzero(fitness < fitness[row])
    assert best.rank == 1
