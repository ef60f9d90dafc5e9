"""Winners of a job's history under many preferences."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from gaitswarm.services.optimizer.analysis.preferences import drawn_preferences, preference_winners
from gaitswarm.services.optimizer.analysis.utilities import fitness_by
from tests.examples.columns import columns_of

TRADE_OFF = np.array(
    [
        [1.0, 9.0, 9.0, 9.0, 9.0],
        [9.0, 1.0, 9.0, 9.0, 9.0],
        [9.0, 9.0, 1.0, 1.0, 1.0],
        [9.5, 9.5, 9.5, 9.5, 9.5],
    ]
)
"""Three designs that are each the best at something, and one that is worse than all of them."""


def test_each_winner_wins_under_the_preference_that_is_named_with_it() -> None:
    columns = columns_of(TRADE_OFF)
    drawn = drawn_preferences(columns, count=400, seed=1)
    found = preference_winners(columns, drawn)
    assert {winner.row for winner in found} == {0, 1, 2}
    for winner in found:
        fitness = fitness_by(columns, winner.preference)
        assert fitness.argmin() == winner.row
    assert sum(winner.share for winner in found) == 1.0


def test_the_winners_of_table_4_5_come_first_with_their_names() -> None:
    columns = columns_of(TRADE_OFF)
    found = preference_winners(columns, drawn_preferences(columns, count=50, seed=1))
    assert found[0].named
    assert sorted(name for winner in found for name in winner.named) == ["A", "B", "C"]
    unnamed = [winner.share for winner in found if not winner.named]
    assert unnamed == sorted(unnamed, reverse=True)


def test_a_design_that_fails_never_wins() -> None:
    columns = columns_of(TRADE_OFF, failed=(2,))
    found = preference_winners(columns, drawn_preferences(columns, count=200, seed=1))
    assert {winner.row for winner in found} == {0, 1}


def test_many_preferences_take_no_memory_for_each_design() -> None:
    columns = columns_of(np.random.default_rng(1).uniform(1.0, 2.0, size=(20_000, 5)))
    drawn = drawn_preferences(columns, count=100, seed=1)
    tracemalloc.start()
    found = preference_winners(columns, drawn)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert sum(winner.share for winner in found) == pytest.approx(1.0)
    # A number for each design and preference would be 16 MB.
    assert peak < 8_000_000


def test_preferences_are_drawn_alike_for_a_seed_and_biases_are_of_the_objectives_size() -> None:
    columns = columns_of(TRADE_OFF * np.array([1.0, 10.0, 100.0, 1000.0, 1.0]))
    first, again = (drawn_preferences(columns, count=300, seed=3) for _ in range(2))
    assert first == again
    assert first != drawn_preferences(columns, count=300, seed=4)
    bias = np.array([preference.bias for preference in first])
    np.testing.assert_allclose(bias.max(axis=0), [9.0, 90.0, 900.0, 9000.0, 9.0], rtol=0.05)
    exponent = np.array([preference.exponent for preference in first])
    assert (exponent > 0.0).all() and (exponent <= 1.0).all()
