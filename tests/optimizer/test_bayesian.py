"""Bayesian optimization: its model, its batches, its region, and that it needs few designs."""

from __future__ import annotations

from importlib.util import find_spec
from statistics import NormalDist

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.bayesian import GaussianProcess
from gaitswarm.services.optimizer.search.space import Axis, Space
from tests.optimizer.searched import MIXED, designs_asked, mixed_bowl

pytestmark = pytest.mark.skipif(find_spec("sklearn") is None, reason="scikit-learn is missing")

Floats = NDArray[np.float64]

LINE = Space([Axis(0.0, 10.0)])


def valley(designs: Floats) -> Floats:
    squares: Floats = np.square(designs[:, 0] - 3.0) / 10.0
    return squares


def model_of(points: list[float]) -> GaussianProcess:
    model = GaussianProcess(LINE)
    designs = np.array(points)[:, np.newaxis]
    model.fit(designs, valley(designs) - valley(designs).mean())
    return model


def test_a_model_of_a_valley_sends_a_design_to_its_floor() -> None:
    chosen = model_of([0.0, 1.0, 2.0, 4.0, 5.0, 8.0, 10.0]).batch(
        np.linspace(0.0, 10.0, 201)[:, None], 1
    )
    assert abs(chosen[0, 0] - 3.0) < 0.5


def test_a_batch_is_of_different_designs() -> None:
    chosen = model_of([0.0, 5.0, 10.0]).batch(np.linspace(0.0, 10.0, 201)[:, None], 5)
    assert len(np.unique(chosen)) == 5


def test_each_design_of_a_batch_is_chosen_as_if_those_before_were_as_expected() -> None:
    model, designs = model_of([2.0, 7.0, 9.0]), np.linspace(0.0, 10.0, 201)[:, None]
    fitted = model._model  # noqa: SLF001 - what it knows of all, which a batch does not tell
    assert fitted is not None
    mean, covariance = fitted.predict(designs / 10.0, return_cov=True)
    least, expected = float(fitted.y_train_.min()), list[int]()
    cdf, pdf = np.vectorize(NormalDist().cdf), np.vectorize(NormalDist().pdf)
    for _ in range(10):
        deviation = np.sqrt(np.maximum(np.diag(covariance), 1e-12))
        z = (least - mean) / deviation
        improvement = deviation * (z * cdf(z) + pdf(z))
        improvement[expected] = -1.0
        pick = int(np.argmax(improvement))
        expected.append(pick)
        # All that is known of all of them, where the batch follows what it needs.
        row = covariance[pick] / np.sqrt(max(covariance[pick, pick], 1e-12))
        covariance = covariance - np.outer(row, row)
        least = min(least, float(mean[pick]))
    assert model.batch(designs, 10).tolist() == designs[expected].tolist()


def test_a_model_is_fitted_to_the_designs_nearest_to_the_best() -> None:
    designs = np.array([[9.0], [3.1], [0.0], [2.9]])
    assert GaussianProcess(LINE).nearest(designs, np.array([3.0]), 2).tolist() == [1, 3]


def test_a_variable_that_matters_less_has_a_longer_side() -> None:
    space = Space.continuous([0.0, 0.0], [1.0, 1.0])
    designs = np.random.default_rng(1).random((40, 2))
    values = np.sin(8.0 * designs[:, 0]) + 0.01 * designs[:, 1]
    model = GaussianProcess(space)
    model.fit(designs, (values - values.mean()) / values.std())
    first, second = model.sides()
    assert second > 3.0 * first
    assert first * second == pytest.approx(1.0)


def test_a_sample_comes_first_and_then_batches() -> None:
    asked = designs_asked("bayesian", MIXED, mixed_bowl, 24, sample=9, batch=3)
    assert [len(designs) for designs in asked] == [9, 3, 3, 3, 3, 3]
    assert np.ptp(asked[0][:, 0]) > 1.5


def test_a_region_that_has_shrunk_to_nothing_is_given_up_for_a_new_sample() -> None:
    asked = designs_asked(
        "bayesian", LINE, lambda x: np.ones(len(x)), 80, sample=8, batch=4, region=0.02
    )
    sizes = [len(designs) for designs in asked]
    again = sizes.index(8, 1)
    # Only failures, so every batch halves the region: to 0.01, and then below a 128th.
    assert again == 3
    assert np.ptp(asked[again]) > 5.0 and np.ptp(asked[again - 1]) < 0.5


@pytest.mark.thorough("comparison with another method")
def test_it_needs_fewer_designs_than_differential_evolution() -> None:
    """To come within 0.1 of the optimum with integers and choices."""
    best = {
        name: min(float(mixed_bowl(d).min()) for d in designs_asked(name, MIXED, mixed_bowl, 80))
        for name in ("bayesian", "de")
    }
    assert best["bayesian"] < 0.1 and best["bayesian"] < 0.5 * best["de"]
