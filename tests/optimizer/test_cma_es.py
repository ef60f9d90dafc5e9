"""CMA-ES: what the adapter adds to the library, and that it finds what it is to find."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from services.optimizer.search.registry import METHODS, create_search
from services.optimizer.search.space import Axis, Space
from tests.optimizer.searched import MIXED, calls_to, designs_asked, mixed_bowl

pytest.importorskip("cmaes")

Floats = NDArray[np.float64]

BOX = Space.continuous([-5.0] * 6, [5.0] * 6)


def ridge(designs: Floats) -> Floats:
    """A narrow valley across all variables, whose floor falls to 0 at 2 in each."""
    offset = designs - 2.0
    along = np.square(offset.sum(axis=1)) / 6.0
    height: Floats = along + 1e4 * (np.square(offset).sum(axis=1) - along)
    return height


def test_a_narrow_valley_across_the_axes_is_learned() -> None:
    asked = designs_asked("cma-es", BOX, ridge, 2_500)
    assert float(ridge(np.vstack(asked)).min()) < 1e-6


def test_integers_and_choices_are_found_with_the_rest() -> None:
    calls = [
        calls_to(1e-2, designs_asked("cma-es", MIXED, mixed_bowl, 2_500, seed), mixed_bowl)
        for seed in range(3)
    ]
    assert max(calls) <= 2_000


def test_a_generation_is_the_population_and_grows_with_each_restart() -> None:
    asked = designs_asked(
        "cma-es",
        Space([Axis(0.0, 1.0)]),
        lambda x: np.abs(x[:, 0] - 0.3),
        3_000,
        population=6,
        particles=100,
    )
    sizes = [len(designs) for designs in asked[:-1]]
    assert sizes == sorted(sizes) and set(sizes) >= {6, 12, 24}


def test_a_restart_begins_elsewhere_as_wide_as_the_first() -> None:
    asked = designs_asked(
        "cma-es", Space([Axis(0.0, 1.0)]), lambda x: np.abs(x[:, 0] - 0.3), 2_000, population=6
    )
    sizes = [len(designs) for designs in asked]
    restart = sizes.index(12)
    assert np.ptp(asked[restart - 1]) < 1e-6
    assert np.ptp(asked[restart]) > 0.05


def test_only_the_order_of_fitness_values_counts() -> None:
    plain = designs_asked("cma-es", MIXED, mixed_bowl, 200)
    stretched = designs_asked("cma-es", MIXED, lambda x: np.exp(9.0 * mixed_bowl(x)), 200)
    np.testing.assert_array_equal(np.vstack(plain), np.vstack(stretched))


def test_a_variable_never_stops_trying_other_integers_and_choices() -> None:
    """A margin keeps their chance, also where one value has long been best."""
    space = Space([Axis(0.0, 1.0), Axis(0.0, 9.0, "integer"), Axis(0.0, 2.0, "categorical")])
    asked = designs_asked(
        "cma-es", space, lambda x: x[:, 0] + (x[:, 1] != 4.0) + (x[:, 2] != 1.0), 600, growth=1.0
    )
    late = np.vstack(asked)[200:]
    assert (late[:, 1] != 4.0).any() and (late[:, 2] != 1.0).any()


def test_integers_of_two_and_of_very_many_values_are_searched_too() -> None:
    space = Space([Axis(0.0, 1.0, "integer"), Axis(0.0, 1e6, "integer")])
    asked = designs_asked(
        "cma-es", space, lambda x: np.abs(x[:, 1] - 123_456.0) / 1e6 + x[:, 0], 400
    )
    best = min(np.vstack(asked).tolist(), key=lambda x: abs(x[1] - 123_456.0) / 1e6 + x[0])
    assert best[0] == 0.0 and abs(best[1] - 123_456.0) < 100.0


def test_a_search_begins_about_the_best_start_position() -> None:
    settings = METHODS["cma-es"].settings.model_validate({"sigma": 0.01})
    start = np.array([[-4.0] * 6, [3.0] * 6, [4.0] * 6])
    optimizer = create_search(settings, BOX, 100, 1, start)
    optimizer.tell(np.array([2.0, 1.0, 3.0])[: len(optimizer.ask())])
    assert np.abs(optimizer.ask() - 3.0).max() < 0.5
