"""CMA-ES: that it learns scales and valleys, keeps trying, restarts, and stays in its box."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.cma_es import eigen, product
from gaitswarm.services.optimizer.search.registry import METHODS, create_search
from gaitswarm.services.optimizer.search.space import Axis, Space
from tests.optimizer.searched import MIXED, calls_to, designs_asked, mixed_bowl

Floats = NDArray[np.float64]

BOX = Space.continuous([-5.0] * 6, [5.0] * 6)


def ridge(designs: Floats) -> Floats:
    """A narrow valley across all variables, whose floor falls to 0 at 2 in each."""
    offset = designs - 2.0
    along = np.square(offset.sum(axis=1)) / 6.0
    height: Floats = along + 1e4 * (np.square(offset).sum(axis=1) - along)
    return height


def test_a_narrow_valley_across_the_axes_is_learned() -> None:
    asked = designs_asked("cma-es", BOX, ridge, 1_500)
    assert float(ridge(np.vstack(asked)).min()) < 1e-6


@pytest.mark.thorough(
    "how fast it learns, which test_a_narrow_valley_across_the_axes_is_learned shows for one"
)
def test_scales_of_the_variables_are_learned_faster_than_valleys_across_them() -> None:
    scales = 10.0 ** np.linspace(0.0, 6.0, 10)
    box = Space.continuous([-5.0] * 10, [5.0] * 10)
    turn = np.linalg.qr(np.random.default_rng(1).standard_normal((10, 10)))[0]

    def along_the_axes(x: Floats) -> Floats:
        height: Floats = (scales * np.square(x - 1.0)).sum(axis=1)
        return height

    def across_them(x: Floats) -> Floats:
        return along_the_axes((x - 1.0) @ turn + 1.0)

    asked = designs_asked("cma-es", box, along_the_axes, 2_500)
    assert calls_to(1e-6, asked, along_the_axes) < 2_500
    turned = designs_asked("cma-es", box, across_them, 2_500)
    assert across_them(np.vstack(turned)).min() > 1e-3


def test_a_minimum_in_a_corner_is_reached_to_the_bit() -> None:
    """Samples beyond a bound are judged at it."""
    asked = np.vstack(designs_asked("cma-es", BOX, lambda x: x.sum(axis=1), 150))
    assert (asked == BOX.low).all(axis=1).any()


@pytest.mark.thorough("test_a_minimum_in_a_corner_is_reached_to_the_bit")
def test_a_minimum_along_a_bound_does_not_stop_the_other_variables() -> None:
    """However long two variables lie at their bounds, the rest converges."""

    def half_bounded(x: Floats) -> Floats:
        total: Floats = x[:, :2].sum(axis=1) + 10.0 + np.square(x[:, 2:] - 1.0).sum(axis=1)
        return total

    asked = designs_asked("cma-es", BOX, half_bounded, 1_500)
    assert half_bounded(np.vstack(asked)).min() < 1e-6


def test_its_state_is_its_own_and_needs_no_replay() -> None:
    assert not METHODS["cma-es"].replays


@pytest.mark.parametrize("dimension", [1, 2, 9, 40])
def test_the_decomposition_is_that_of_lapack(dimension: int) -> None:
    root = np.random.default_rng(dimension).standard_normal((dimension, dimension))
    symmetric = root @ root.T + 1e-3 * np.eye(dimension)
    values, vectors = eigen(symmetric)
    np.testing.assert_allclose(np.sort(values), np.linalg.eigvalsh(symmetric), rtol=1e-9)
    np.testing.assert_allclose(product(vectors * values, vectors.T), symmetric, atol=1e-9)
    np.testing.assert_allclose(product(vectors.T, vectors), np.eye(dimension), atol=1e-12)


@pytest.mark.parametrize("rows", [2, 71])
def test_a_product_is_summed_in_order_and_little_of_it_is_held_at_once(rows: int) -> None:
    draw = np.random.default_rng(rows)
    left, right = draw.standard_normal((rows, 2_000)), draw.standard_normal((2_000, 200))
    total = np.zeros((rows, 200))
    for k in range(2_000):
        total += left[:, k : k + 1] * right[k]
    tracemalloc.start()
    assert product(left, right).tobytes() == total.tobytes()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # All of its terms would be 227 MB.
    assert peak < 50_000_000


@pytest.mark.thorough("test_a_variable_never_stops_trying_other_integers_and_choices")
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
        particles=400,
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


def test_a_distribution_that_gains_nothing_but_by_chance_is_given_up() -> None:
    """The best of a generation may vary for ever, as on a surface of small steps."""

    def rattling(designs: Floats) -> Floats:
        height: Floats = 10.0 + 0.01 * np.sin(1e7 * designs.sum(axis=1))
        return height

    asked = designs_asked("cma-es", BOX, rattling, 1_000, particles=100)
    sizes = [len(designs) for designs in asked]
    assert sizes.index(2 * sizes[0]) <= 40


def test_only_the_order_of_fitness_values_counts() -> None:
    plain = designs_asked("cma-es", MIXED, mixed_bowl, 200)
    stretched = designs_asked("cma-es", MIXED, lambda x: np.exp(9.0 * mixed_bowl(x)), 200)
    np.testing.assert_array_equal(np.vstack(plain), np.vstack(stretched))


@pytest.mark.parametrize("rescaled", [lambda f: 1e6 * f, lambda f: 1e100 * f, lambda f: f**1e-5])
def test_restarts_do_not_depend_on_the_scale_of_fitness(
    rescaled: Callable[[Floats], Floats],
) -> None:
    def height(x: Floats) -> Floats:
        return np.abs(x[:, 0] - 0.3)

    space = Space([Axis(0.0, 1.0)])
    plain = designs_asked("cma-es", space, height, 2_000, population=6)
    scaled = designs_asked("cma-es", space, lambda x: rescaled(height(x)), 2_000, population=6)
    assert {6, 12} <= {len(designs) for designs in plain}
    np.testing.assert_array_equal(np.vstack(plain), np.vstack(scaled))


@pytest.mark.parametrize("integers", ["widened", "centred"])
def test_a_variable_never_stops_trying_other_integers_and_choices(integers: str) -> None:
    """A margin keeps their chance, also where one value has long been best."""
    space = Space([Axis(0.0, 1.0), Axis(0.0, 9.0, "integer"), Axis(0.0, 2.0, "categorical")])

    def height(x: Floats) -> Floats:
        return x[:, 0] + (x[:, 1] != 4.0) + (x[:, 2] != 1.0)

    asked = designs_asked("cma-es", space, height, 600, growth=1.0, integers=integers)
    late = np.vstack(asked)[200:]
    assert (late[:, 1] != 4.0).any() and (late[:, 2] != 1.0).any()


@pytest.mark.parametrize("integers", ["widened", "centred"])
def test_integers_of_two_and_of_very_many_values_are_searched_too(integers: str) -> None:
    space = Space([Axis(0.0, 1.0, "integer"), Axis(0.0, 1e6, "integer")])

    def height(x: Floats) -> Floats:
        return np.abs(x[:, 1] - 123_456.0) / 1e6 + x[:, 0]

    asked = designs_asked("cma-es", space, height, 800, integers=integers)
    best = min(np.vstack(asked).tolist(), key=lambda x: abs(x[1] - 123_456.0) / 1e6 + x[0])
    assert best[0] == 0.0 and abs(best[1] - 123_456.0) < 100.0


def test_a_search_begins_about_the_best_start_position() -> None:
    settings = METHODS["cma-es"].settings.model_validate({"sigma": 0.01})
    start = np.array([[-4.0] * 6, [3.0] * 6, [4.0] * 6])
    optimizer = create_search(settings, BOX, 100, 1, start)
    optimizer.tell(np.array([2.0, 1.0, 3.0])[: len(optimizer.ask())])
    assert np.abs(optimizer.ask() - 3.0).max() < 0.5
