"""What is said of runs, against examples that were computed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gaitswarm.services.optimizer.analysis.ranks import average_ranks, spearman
from gaitswarm.services.optimizer.analysis.tournaments.tournament import (
    Runs,
    data_profile,
    expected_running_time,
    mean_ranks,
    rank_correlation,
    ranks,
    running_time_interval,
)

NAN = math.nan


def runs(
    final: list[float],
    to_target: list[float] | None = None,
    *,
    first: float = 10.0,
    target: float | None = None,
) -> Runs:
    """Runs of 100 evaluations that were at `first` after 10."""
    best = np.array([[first, value] for value in final])
    count = len(final)
    return Runs(
        checkpoints=np.array([10, 100]),
        best=best,
        to_best=np.full(count, 100.0),
        to_target=np.full(count, NAN) if to_target is None else np.array(to_target),
        dimension=4,
        target=target,
    )


def test_expected_running_time_counts_the_evaluations_of_runs_that_failed() -> None:
    # 40 + 60 + 100 + 100 evaluations for two successes.
    assert expected_running_time(np.array([40.0, NAN, 60.0, NAN]), 100) == 150.0
    assert expected_running_time(np.array([40.0, 60.0]), 100) == 50.0
    assert expected_running_time(np.array([NAN, NAN]), 100) == math.inf


def test_an_interval_holds_the_estimate_and_is_as_wide_as_runs_differ() -> None:
    equal = running_time_interval(runs([0.0] * 5, [30.0] * 5))
    assert (equal.value, equal.low, equal.high) == (30.0, 30.0, 30.0)
    mixed = running_time_interval(runs([0.0] * 20, [20.0, 80.0] * 10))
    assert mixed.value == 50.0
    # The mean of twenty such values has a standard deviation of 30 / sqrt(20) = 6.7.
    assert 33.0 < mixed.low < 42.0 and 58.0 < mixed.high < 67.0
    rare = running_time_interval(runs([0.0] * 4, [20.0, NAN, NAN, NAN]))
    assert rare.value == 320.0 and rare.high == math.inf


def test_quartiles_are_values_of_runs_and_infinite_where_runs_have_none() -> None:
    some = runs([4.0, 1.0, 3.0, 2.0, NAN])
    assert some.quartiles()[:, 1].tolist() == [2.0, 3.0, 4.0]
    assert some.median_after(100) == some.median_after(5000) == 3.0
    assert some.median_after(99) == 10.0
    assert math.isnan(some.median_after(9))
    assert runs([NAN, NAN, 1.0]).median_after(100) == math.inf


def test_another_target_is_reached_at_the_checkpoint_that_shows_it() -> None:
    aimed = runs([1.0, 2.0, 3.0], first=2.5).aiming_at(2.5)
    assert aimed.to_target.tolist() == [10.0, 10.0, 10.0]
    later = runs([1.0, 2.0, 3.0]).aiming_at(2.0).to_target
    assert later[:2].tolist() == [100.0, 100.0] and math.isnan(later[2])


def test_a_data_profile_counts_runs_by_their_simplex_gradients() -> None:
    # f_L is 0 and f_0 is 10, so tau = 0.1 asks for 1; 100 evaluations are 20 units of 4 + 1.
    results = {"p": {"a": runs([0.0, 1.0, 1.01, 5.0]), "b": runs([2.0, 2.0, 2.0, 2.0])}}
    assert data_profile(results, "a", 0.1, [1.0, 19.9, 20.0]).tolist() == [0.0, 0.0, 0.5]
    assert data_profile(results, "b", 0.2, [20.0]).tolist() == [1.0]
    assert data_profile(results, "b", 0.1, [20.0]).tolist() == [0.0]


def test_equal_values_share_their_mean_rank() -> None:
    values = np.array([3.0, 1.0, 3.0, math.inf, 3.0, math.inf])
    assert average_ranks(values).tolist() == [3.0, 1.0, 3.0, 5.5, 3.0, 5.5]


def test_runs_are_compared_by_success_then_speed_then_value() -> None:
    by_method = {
        # Places among the six runs: 5, 6; 1, 3; 2, 4.
        "never": runs([0.5, 0.6], target=0.1),
        "fast": runs([0.09, 0.02], [10.0, 30.0], target=0.1),
        "slow": runs([0.0, 0.0], [20.0, 90.0], target=0.1),
    }
    assert ranks(by_method).tolist() == [3.0, 1.0, 2.0]


def test_methods_whose_runs_are_equal_share_a_rank() -> None:
    by_method = {"a": runs([1.0, 2.0]), "b": runs([2.0, 1.0]), "c": runs([3.0, 3.0])}
    assert ranks(by_method).tolist() == [1.5, 1.5, 3.0]
    # Places 1, 2.5, 2.5, 4: equal runs share their mean place.
    assert ranks({"a": runs([2.0, 2.0]), "b": runs([1.0, 3.0])}).tolist() == [1.5, 1.5]


def test_mean_ranks_are_means_over_problems_and_sure_where_runs_do_not_overlap() -> None:
    results = {
        "one": {"a": runs([1.0, 1.1]), "b": runs([2.0, 2.1]), "c": runs([3.0, 3.1])},
        "two": {"a": runs([1.0, 1.1]), "b": runs([3.0, 3.1]), "c": runs([2.0, 2.1])},
    }
    found = mean_ranks(results, ["a", "b", "c"])
    assert {m: (r.value, r.low, r.high) for m, r in found.items()} == {
        "a": (1.0, 1.0, 1.0),
        "b": (2.5, 2.5, 2.5),
        "c": (2.5, 2.5, 2.5),
    }
    overlapping = {"one": {"a": runs([1.0, 4.0, 2.0]), "b": runs([2.0, 3.0, 5.0])}}
    rank = mean_ranks(overlapping, ["a", "b"])["a"]
    assert (rank.low, rank.value, rank.high) == (1.0, 1.0, 2.0)


def test_rank_correlation_is_spearmans() -> None:
    # Ranks 1 2 3 4 against 2 1 4 3: 1 - 6 * 4 / (4 * 15).
    one, other = np.array([0.1, 0.2, 0.3, 0.4]), np.array([7.0, 5.0, 99.0, 8.0])
    assert spearman(one, other) == pytest.approx(0.6)
    assert spearman(one, -one) == pytest.approx(-1.0)
    assert math.isnan(spearman(one, np.ones(4)))


def test_the_correlation_of_two_tournaments_is_that_of_their_mean_ranks() -> None:
    names = ["a", "b", "c", "d"]

    def ordered(values: list[float]) -> dict[str, dict[str, Runs]]:
        return {"p": {n: runs([v, v]) for n, v in zip(names, values, strict=True)}}

    found = rank_correlation(ordered([1, 2, 3, 4]), ordered([2, 1, 4, 3]), names)
    assert found.value == pytest.approx(0.6)
    # Runs that are equal leave no doubt about the ranks.
    assert (found.low, found.high) == (found.value, found.value)
