"""First-order Sobol' indices of given designs, and bounds that hold a winner back."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.services.optimizer.analysis.importance import (
    LEAST_DESIGNS,
    IndexIntervalView,
    companions,
    first_order_indices,
)
from gaitswarm.sim.variables import Variable


def variables(*names: str) -> tuple[Variable, ...]:
    return tuple(Variable(name=name, low=0.0, high=1.0) for name in names)


def indices(designs: np.ndarray, output: np.ndarray) -> list[IndexIntervalView]:
    names = (f"v{k}" for k in range(designs.shape[1]))
    found = first_order_indices(designs, variables(*names), output)
    assert found is not None
    return found


def test_shares_of_a_sum_are_the_shares_of_its_variance() -> None:
    designs = np.random.default_rng(1).normal(size=(4000, 3))
    # Of a normal sum the ranks behave as the sum itself: 9 and 1 parts of 10.
    first, second, idle = indices(designs, 3.0 * designs[:, 0] + designs[:, 1])
    assert first.value == pytest.approx(0.9, abs=0.03)
    assert second.value == pytest.approx(0.1, abs=0.03)
    assert idle.value < 0.02


def test_an_effect_without_a_trend_counts() -> None:
    designs = np.random.default_rng(2).random((2000, 2))
    valley, idle = indices(designs, (designs[:, 0] - 0.5) ** 2)
    assert valley.value > 0.9
    assert idle.value < 0.02


def test_only_the_order_of_the_output_counts() -> None:
    designs = np.random.default_rng(3).random((500, 2))
    output = designs[:, 0] + 0.3 * designs[:, 1]
    assert indices(designs, np.exp(20.0 * output)) == indices(designs, output)


def test_chance_is_corrected_for_and_intervals_hold_the_truth() -> None:
    estimates = []
    for seed in range(40):
        random = np.random.default_rng(seed)
        (idle,) = indices(random.random((200, 1)), random.random(200))
        estimates.append(idle)
    assert np.mean([e.value for e in estimates]) < 0.03
    assert all(e.low <= e.value <= e.high for e in estimates)
    assert sum(e.low == 0.0 for e in estimates) > 30


def test_two_choices_with_all_the_difference_between_them_are_as_by_hand() -> None:
    choice = Variable(name="law", kind="categorical", choices=("stick", "slip"))
    designs = np.repeat([0.0, 1.0], 20)[:, np.newaxis]
    found = first_order_indices(designs, (choice,), np.arange(40.0))
    assert found is not None
    # Ranks 1 to 20 and 21 to 40: means 10 from the middle, 40 * 100 of 40 (40^2 - 1) / 12.
    ratio = 40 * 100.0 / (40 * (40**2 - 1) / 12)
    assert found[0].value == pytest.approx(1.0 - (1.0 - ratio) * 39 / 38)


def test_a_variable_that_never_changed_has_no_share() -> None:
    designs = np.random.default_rng(4).random((100, 2))
    designs[:, 1] = 0.5
    moved, still = indices(designs, designs[:, 0])
    assert moved.value > 0.9
    assert (still.value, still.low, still.high) == (0.0, 0.0, 0.0)
    assert companions(designs, variables("a", "b")) == [None, None]


@pytest.mark.parametrize(
    ("designs", "output"),
    [
        (np.random.default_rng(5).random((100, 1)), np.ones(100)),
        (np.arange(LEAST_DESIGNS - 1.0)[:, np.newaxis], np.arange(LEAST_DESIGNS - 1.0)),
    ],
    ids=["an output that never changes", "too few designs"],
)
def test_of_nothing_nothing_is_said(designs: np.ndarray, output: np.ndarray) -> None:
    assert first_order_indices(designs, variables("a"), output) is None


def test_the_companion_is_the_variable_that_moved_along() -> None:
    first, other = np.random.default_rng(6).random((2, 300))
    designs = np.stack([first, other, -(first**3)], axis=1)
    found = companions(designs, variables("a", "b", "c"))
    assert [c and c[0] for c in found][::2] == ["c", "a"]
    assert found[0] is not None
    assert found[0][1] == pytest.approx(-1.0)
