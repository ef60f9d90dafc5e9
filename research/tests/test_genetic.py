"""The genetic algorithm: what the adapter adds to pymoo, and that it finds what it is to find."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.plugins import Axis, Space
from research.tests.searches import MIXED, calls_to, designs_asked, mixed_bowl

pytest.importorskip("pymoo")


def test_integers_and_choices_are_found_with_the_rest() -> None:
    asked = designs_asked("ga", MIXED, mixed_bowl, 1_500)
    assert calls_to(0.05, asked, mixed_bowl) <= 1_500
    by_chance = designs_asked("random", MIXED, mixed_bowl, 1_500)
    assert mixed_bowl(np.vstack(asked)).min() < 0.5 * mixed_bowl(np.vstack(by_chance)).min()


def test_a_population_and_then_its_offspring_are_asked_for() -> None:
    asked = designs_asked("ga", MIXED, mixed_bowl, 60, population=20, offspring=8)
    assert [len(designs) for designs in asked] == [20, 8, 8, 8, 8, 8]


def test_where_no_new_child_can_be_bred_another_population_begins() -> None:
    space = Space([Axis(0.0, 3.0, "integer"), Axis(0.0, 1.0, "categorical")])
    asked = designs_asked("ga", space, lambda x: x.sum(axis=1), 32, population=8, particles=8)
    assert all(len(np.unique(designs, axis=0)) == len(designs) for designs in asked)
    assert len(np.vstack(asked)) == 32


def test_without_crossover_and_mutation_nothing_new_is_bred() -> None:
    asked = designs_asked(
        "ga", MIXED, mixed_bowl, 40, population=10, crossover_probability=0, mutation_probability=0
    )
    # Each is a new random population, as wide as the box.
    assert [len(designs) for designs in asked] == [10] * 4
    assert all(np.ptp(designs[:, 4]) > 500.0 for designs in asked)
