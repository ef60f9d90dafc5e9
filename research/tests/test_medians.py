"""Medians and ratios of several runs, and the coverage of their intervals."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm_research.medians import (
    MedianInterval,
    median_interval,
    median_ratio,
)


def test_the_interval_of_ten_runs_lies_between_the_second_and_the_ninth() -> None:
    from scipy.stats import binom

    found = median_interval([7.0, 1.0, 3.0, 10.0, 5.0, 2.0, 9.0, 4.0, 8.0, 6.0])
    assert (found.median, found.low, found.high) == (5.5, 2.0, 9.0)
    assert found.coverage == pytest.approx(1.0 - 2.0 * binom.cdf(1, 10, 0.5))


def test_five_runs_have_a_median_but_no_interval() -> None:
    assert median_interval([3.0, 1.0, 2.0, 5.0, 4.0]) == MedianInterval(3.0, None, None, None)


def test_the_ratio_is_the_median_of_all_ratios() -> None:
    found = median_ratio([2.0, 6.0], [1.0, 2.0])
    assert found == MedianInterval(2.5, None, None, None)


def test_the_interval_of_a_ratio_is_that_of_mann_and_whitney() -> None:
    from scipy.stats import mannwhitneyu

    """A factor is inside just where the exact test at 5 % does not reject it."""
    draws = np.random.default_rng(1)
    pi, fuzzy = draws.lognormal(0.3, 0.5, 8), draws.lognormal(0.0, 0.5, 10)
    found = median_ratio(pi.tolist(), fuzzy.tolist())
    assert found.low is not None and found.high is not None
    for end, outwards in ((found.low, 0.9999), (found.high, 1.0001)):
        inside, outside = (
            mannwhitneyu(pi, factor * fuzzy, method="exact").pvalue
            for factor in (end / outwards, end * outwards)
        )
        assert outside <= 0.05 < inside


def test_turned_round_the_ratio_is_the_reciprocal() -> None:
    pi, fuzzy = [1.0, 2.0, 4.0, 8.0, 16.0], [3.0, 3.5, 5.0, 6.0]
    there, back = median_ratio(pi, fuzzy), median_ratio(fuzzy, pi)
    assert there.low is not None and back.high is not None
    assert there.low == pytest.approx(1.0 / back.high)
    assert there.coverage == back.coverage


def test_the_intervals_cover_as_often_as_they_say() -> None:
    draws = np.random.default_rng(2)
    true, runs = 1.22, 2000
    covered = 0
    for _ in range(runs):
        found = median_ratio(
            (true * draws.lognormal(0.0, 0.4, 10)).tolist(), draws.lognormal(0.0, 0.4, 10).tolist()
        )
        assert found.low is not None and found.high is not None and found.coverage is not None
        covered += found.low <= true <= found.high
    assert found.coverage is not None and found.coverage >= 0.95
    # Three standard deviations of the share of 2000 draws.
    assert covered / runs == pytest.approx(found.coverage, abs=0.015)
