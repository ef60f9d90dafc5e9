"""Bayesian optimization: its model, its merit, its designs, and that it needs few of them."""

from __future__ import annotations

from statistics import NormalDist

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.bayesian import (
    GaussianProcess,
    inverted,
    log_improvement,
    normal_scores,
)
from gaitswarm.services.optimizer.search.space import Axis, Space
from tests.optimizer.searched import MIXED, calls_to, designs_asked, mixed_bowl

Floats = NDArray[np.float64]

LINE = Space([Axis(0.0, 10.0)])


def valley(designs: Floats) -> Floats:
    squares: Floats = np.square(designs[:, 0] - 3.0) / 10.0
    return squares


def slope(designs: Floats) -> Floats:
    return np.asarray(designs.sum(axis=1))


def bowl(designs: Floats) -> Floats:
    return np.asarray(np.square(designs - 0.3).sum(axis=1))


def test_a_model_predicts_between_its_data_and_is_unsure_beyond_them() -> None:
    model, designs = GaussianProcess(LINE), np.linspace(0.0, 5.0, 6)[:, np.newaxis]
    values = valley(designs) - valley(designs).mean()
    model.fit(designs, values)
    mean, deviation = model.predict(np.array([[2.5], [9.0]]))
    assert mean[0] == pytest.approx(0.025 - valley(designs).mean(), abs=0.03)
    assert deviation[1] > 5.0 * deviation[0]


def test_a_variable_that_matters_less_has_a_longer_length() -> None:
    space = Space.continuous([0.0, 0.0], [1.0, 1.0])
    designs = np.random.default_rng(1).random((40, 2))
    values = np.sin(8.0 * designs[:, 0]) + 0.01 * designs[:, 1]
    model = GaussianProcess(space)
    model.fit(designs, (values - values.mean()) / values.std())
    first, second = model.lengths()
    assert second > 3.0 * first
    assert first * second == pytest.approx(1.0)


def test_any_two_choices_are_equally_far_apart() -> None:
    model = GaussianProcess(Space([Axis(0.0, 3.0, "categorical")]))
    model.learn(np.zeros((1, 1)), np.ones(1))
    mean, _ = model.predict(np.array([[0.0], [1.0], [2.0], [3.0]]))
    assert mean[1] == mean[2] == mean[3] < 0.7 * mean[0]


def test_a_matrix_is_inverted() -> None:
    root = np.random.default_rng(1).random((7, 7))
    matrix = root @ root.T + 0.1 * np.eye(7)
    inverse, log_determinant = inverted(matrix)
    assert inverse == pytest.approx(np.linalg.inv(matrix))
    assert log_determinant == pytest.approx(np.linalg.slogdet(matrix)[1])


def test_the_merit_is_the_expected_improvement() -> None:
    mean, deviation, least = np.array([0.3, -0.5, 4.0]), np.array([0.5, 0.1, 1.0]), 0.1
    expected = [
        (least - m) * NormalDist().cdf((least - m) / s) + s * NormalDist().pdf((least - m) / s)
        for m, s in zip(mean.tolist(), deviation.tolist(), strict=True)
    ]
    merit = np.exp(log_improvement(mean, deviation, least)) / np.sqrt(2.0 * np.pi)
    assert merit == pytest.approx(expected)


def test_the_merit_orders_designs_that_are_all_hopeless() -> None:
    merit = log_improvement(np.logspace(0.0, 12.0, 50), np.ones(50), 0.0)
    assert np.isfinite(merit).all()
    assert (np.diff(merit) < 0.0).all()


def test_a_model_sees_ranks_so_that_bad_values_do_not_bend_it() -> None:
    scores = normal_scores(np.array([3.0, 1.0, 1e6, np.inf, np.inf]))
    assert scores.tolist() == normal_scores(np.array([3.0, 1.0, 4.0, 9.0, 9.0])).tolist()
    ranks = [0.3, 0.1, 0.5, 0.8, 0.8]
    assert scores == pytest.approx([NormalDist().inv_cdf(rank) for rank in ranks])


def test_a_sample_comes_first_and_then_batches() -> None:
    asked = designs_asked("bayesian", MIXED, mixed_bowl, 24, sample=9, batch=3)
    assert [len(designs) for designs in asked] == [9, 3, 3, 3, 3, 3]
    assert np.ptp(asked[0][:, 0]) > 1.5


def test_the_region_halves_after_failures_and_begins_again_when_too_small() -> None:
    asked = designs_asked(
        "bayesian", LINE, lambda x: np.ones(len(x)), 44, sample=5, batch=4, handover=44
    )
    best = asked[0][0, 0]
    reaches = [float(np.abs(designs - best).max()) for designs in asked[1:]]
    assert all(reach <= 4.0 * 0.5**k for k, reach in enumerate(reaches[:7]))
    assert reaches[6] < 0.1 and max(reaches[7:]) > 0.5


def test_cma_es_goes_on_from_the_best_design_with_small_steps() -> None:
    space = Space.continuous([-2.0] * 4, [5.0] * 4)
    asked = designs_asked("bayesian", space, bowl, 80, handover=24)
    before, after = np.vstack(asked[:15]), np.vstack(asked[15:])
    assert [len(designs) for designs in asked[14:17]] == [1, 8, 8]
    best = before[np.argmin(bowl(before))]
    assert np.abs(after[:8] - best).mean() == pytest.approx(0.8 * 0.1 * 7.0, rel=0.4)
    assert bowl(after).min() < bowl(best[np.newaxis])[0]


def test_a_best_design_at_all_bounds_is_found_exactly() -> None:
    space = Space.continuous([0.0] * 4, [1.0] * 4)
    assert calls_to(0.0, designs_asked("bayesian", space, slope, 20, sample=5), slope) <= 20


@pytest.mark.parametrize("batch", [1, 7])
def test_no_design_is_asked_for_twice(batch: int) -> None:
    space = Space([Axis(0.0, 3.0, "integer"), Axis(0.0, 2.0, "categorical")])
    asked = np.vstack(designs_asked("bayesian", space, slope, 10, sample=3, batch=batch))
    assert len(np.unique(asked, axis=0)) == 10


def test_it_needs_fewer_designs_than_differential_evolution() -> None:
    """To come within 0.1 of the optimum with integers and choices."""
    calls = {
        name: calls_to(0.1, designs_asked(name, MIXED, mixed_bowl, budget), mixed_bowl)
        for name, budget in (("bayesian", 40), ("de", 80))
    }
    assert calls["bayesian"] <= 40 < 0.5 * calls["de"]
