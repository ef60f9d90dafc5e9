"""The test functions of thesis 3.2.1: formulas, tags and minima."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm_research.compare.functions import (
    ACCEPTANCE,
    FUNCTIONS,
    BenchmarkFunction,
    draw,
)

Numbers = NDArray[np.float64]


@pytest.fixture(params=FUNCTIONS)
def function(request: pytest.FixtureRequest) -> BenchmarkFunction:
    return FUNCTIONS[request.param]


def points(function: BenchmarkFunction, count: int, seed: int = 1) -> Numbers:
    """Uniform in the box; integer variables are integers."""
    generator = np.random.default_rng(seed)
    x = generator.uniform(function.low, function.high, (count, function.dimension))
    return np.where(function.integer, np.round(x), x)


def numbers(count: int, seed: int = 2) -> Numbers:
    return np.random.default_rng(seed).random(count)


def value(function: BenchmarkFunction, x: Numbers, r: float = 0.5) -> Numbers:
    return function.value(x, np.full(len(x), r))


def moved(x: Numbers, variable: int, to: float) -> Numbers:
    """The points with x_variable, counted from 1, at another place."""
    there = x.copy()
    there[:, variable - 1] = to
    return there


# Parts as the thesis prints them, one point at a time.


def coarse_ratio(x: float) -> float:
    at = 0.1 * round(10 * x) - 0.9
    return abs(1 + 1 / at) if at else math.inf


def smooth_ratio(x: float) -> float:
    return abs(1 + 1 / (x - 0.9))


def sgn(x: float) -> float:
    return math.copysign(1.0, x) if x else 0.0


def g(x: float) -> float:
    return math.log2(abs(x + 1.3) + 1) if x >= -0.3 else math.log2(abs(1.8 - x) + 1)


def printed_3_9(x: list[float], _r: float) -> float:
    x1, x2, x3, x4 = x
    return abs(coarse_ratio(x1) + (round(x3) - 8) / 10 + sgn(x4 + 0.4) + g(x2))


def printed_3_10(x: list[float], r: float) -> float:
    x1, x2, x3, x4, x5, x6, x7 = x
    roots = math.sqrt(abs(x3 + 0.2)) + r * math.sqrt(abs(x4 + 0.6))
    rest = math.log2(abs(x5 + 2) + 1) + abs(x6 - 8) / 10 + x7 - 0.6
    return abs(smooth_ratio(x1) + (x2 + 0.5) ** 2 + roots + rest)


def printed_3_11(x: list[float], _r: float) -> float:
    x1, x2, x3, x4, x5, x6, x7 = x
    roots = math.sqrt(abs(0.1 * round(10 * x3) + 0.2)) + math.sqrt(abs(x4 + 0.6))
    rest = abs(x6 - 8) / 10 + sgn(x7 + 0.4) + g(x5)
    return abs(coarse_ratio(x1) + roots + (x2 + 0.5) ** 2 + rest)


# What docs/optimizers.md decides of four dimensions, of which (3.9) alone is printed.


def continuous_four(x: list[float], _r: float) -> float:
    x1, x2, x3, x4 = x
    return abs(smooth_ratio(x1) + (x3 - 8) / 10 + x4 - 0.6 + math.log2(abs(x2 + 2) + 1))


def noisy_four(x: list[float], r: float) -> float:
    x1, x2, x3, x4 = x
    rest = (round(x3) - 8) / 10 + sgn(x4 + 0.4) + g(x2)
    return abs(coarse_ratio(x1) + rest + r * math.sqrt(abs(x4 + 0.6)))


@pytest.mark.parametrize(
    ("name", "formula"),
    [
        ("D4C0R0I1", printed_3_9),
        ("D7C1R1I0", printed_3_10),
        ("D7C0R0I1", printed_3_11),
        ("D4C1R0I0", continuous_four),
        ("D4C0R1I1", noisy_four),
    ],
)
def test_a_function_is_its_formula(
    name: str, formula: Callable[[list[float], float], float]
) -> None:
    x, r = points(FUNCTIONS[name], 2000), numbers(2000)

    expected = [formula(row, number) for row, number in zip(x.tolist(), r.tolist(), strict=True)]

    np.testing.assert_allclose(FUNCTIONS[name].value(x, r), expected, rtol=1e-12, atol=1e-12)


def test_there_is_a_function_for_every_choice_of_tags() -> None:
    assert sorted(FUNCTIONS) == [
        f"D{d}C{c}R{r}I{i}" for d in (4, 7) for c in (0, 1) for r in (0, 1) for i in (0, 1)
    ]
    assert all(name == function.name for name, function in FUNCTIONS.items())


def test_an_integer_variable_changes_the_box_of_a_function_only(
    function: BenchmarkFunction,
) -> None:
    x, r = points(FUNCTIONS[function.name[:-1] + "1"], 500), numbers(500)

    twin = FUNCTIONS[function.name[:-1] + "0"]

    np.testing.assert_array_equal(function.value(x, r), twin.value(x, r))


def test_the_random_part_is_a_factor_in_seven_dimensions_and_a_term_in_four(
    function: BenchmarkFunction,
) -> None:
    x = points(function, 500)
    still = FUNCTIONS[function.name.replace("R1", "R0")]
    moving = FUNCTIONS[function.name.replace("R0", "R1")]
    r = 1.0 if function.dimension == 7 else 0.0
    np.testing.assert_allclose(value(moving, x, r), value(still, x), rtol=1e-13, atol=1e-13)


def test_r_alone_tells_evaluations_of_a_random_function_apart(function: BenchmarkFunction) -> None:
    x = moved(points(function, 100), 1, 0.0)
    differ = value(function, x, 0.1) != value(function, x, 0.9)
    assert differ.all() if function.is_random else not differ.any()


def test_integer_variables_are_rounded_and_no_others(function: BenchmarkFunction) -> None:
    x = moved(points(function, 100), 1, 0.0)
    level = int(np.argmax(function.high)) + 1
    assert function.integer.sum() == function.has_integer
    assert function.integer[level - 1] == function.has_integer

    near, same = moved(x, level, 4.3), moved(x, level, 4.0)

    equal = value(function, near) == value(function, same)
    assert equal.all() if function.has_integer else not equal.any()
    assert (value(function, moved(x, level, 5.0)) != value(function, same)).all()


def test_halves_are_rounded_away_from_zero() -> None:
    whole = FUNCTIONS["D7C0R0I1"]
    x = points(whole, 1)
    for half, to in ((2.5, 3.0), (3.5, 4.0), (0.5, 1.0)):
        assert value(whole, moved(x, 6, half)) == value(whole, moved(x, 6, to))
    for half, tenth in ((-0.25, -0.3), (0.25, 0.3), (-0.75, -0.8)):
        assert value(whole, moved(x, 3, half)) == value(whole, moved(x, 3, tenth))


def largest_jump(function: BenchmarkFunction, steps: int) -> float:
    """Between neighbours on segments through the box, short of the pole, without integer steps."""
    ends = np.minimum(points(function, 40), np.where(np.arange(function.dimension), np.inf, 0.8))
    start, end = ends[:20], ends[20:]
    end = np.where(function.integer, start, end)
    share = np.linspace(0.0, 1.0, steps + 1)
    return max(
        float(np.abs(np.diff(value(function, a + share[:, np.newaxis] * (b - a)))).max())
        for a, b in zip(start, end, strict=True)
    )


def test_a_function_jumps_unless_it_is_continuous(function: BenchmarkFunction) -> None:
    coarse, fine = largest_jump(function, 1_000), largest_jump(function, 16_000)
    if function.is_continuous:
        # A square root's step shrinks by the root of 16.
        assert fine < coarse / 3.5
    else:
        assert fine > 0.5
        assert fine > 0.95 * coarse


def test_at_its_step_a_discontinuous_function_is_between_its_two_sides() -> None:
    function = FUNCTIONS["D7C0R0I1"]
    x = moved(points(function, 50), 1, 0.0)
    below, at, above = (
        value(function, moved(x, 7, x7)) for x7 in (np.nextafter(-0.4, -1.0), -0.4, -0.39)
    )
    np.testing.assert_allclose(at, below + 1.0)
    np.testing.assert_allclose(above, below + 2.0)


def test_the_pole_is_a_failed_evaluation(function: BenchmarkFunction) -> None:
    x = points(function, 20)
    assert np.isposinf(value(function, moved(x, 1, 0.9))).all()
    for near in (0.86, 0.94):
        failed = np.isposinf(value(function, moved(x, 1, near)))
        assert not failed.any() if function.is_continuous else failed.all()
    for outside in (0.84, 0.96):
        assert np.isfinite(value(function, moved(x, 1, outside))).all()


def test_the_minimum_is_reached_at_the_minimizer_by_every_draw(function: BenchmarkFunction) -> None:
    point = function.minimizer
    assert ((function.low <= point) & (point <= function.high)).all()
    np.testing.assert_array_equal(point[function.integer], np.round(point[function.integer]))

    r = numbers(100)

    assert (function.value(np.tile(point, (100, 1)), r) == 0.0).all()


@pytest.mark.variants("D4*")
def test_nothing_is_found_below_the_minimum(function: BenchmarkFunction) -> None:
    from scipy.optimize import Bounds, differential_evolution

    generator = np.random.default_rng(3)

    def population(x: Numbers) -> Any:
        return function.value(x.T, generator.random((x.shape[1],)))

    found = [float(population(points(function, 20_000).T).min())]
    for seed in range(3):
        result = differential_evolution(
            population,
            Bounds(function.low, function.high),
            integrality=function.integer,
            maxiter=60,
            popsize=10,
            polish=False,
            updating="deferred",
            vectorized=True,
            rng=seed,
        )
        found.append(float(result.fun))
    assert 0.0 <= min(found) < 1.0


@pytest.mark.parametrize("name", [name for name in FUNCTIONS if name.startswith("D7C0")])
def test_discontinuous_in_seven_dimensions_every_variable_has_its_own_best_place(name: str) -> None:
    """No part is below zero there: the absolute value around the sum changes nothing."""
    function = FUNCTIONS[name]
    x, best = points(function, 2000), function.minimizer
    elsewhere = (0.0, -0.4, 0.0, -0.5, -0.2, 7.0, 0.0)
    for variable in range(1, 8):
        improved = moved(x, variable, best[variable - 1])
        assert (value(function, improved) <= value(function, x) + 1e-12).all()
        away = moved(best[np.newaxis], variable, elsewhere[variable - 1])
        assert value(function, away)[0] > ACCEPTANCE


@pytest.mark.parametrize(
    ("name", "another"),
    [
        ("D4C0R0I1", (-0.1, 2**1.2 - 2.3, 6.0, -0.7)),
        ("D4C0R1I0", (-0.1, 2**1.05 - 2.3, 7.5, -0.6)),
        ("D4C1R0I1", (-0.1, -1.0, 8.0, -0.4)),
        ("D4C1R1I0", (-0.1, 2**1.1 - 3.0, 9.0, -0.6)),
        ("D7C1R0I1", (-0.1, -0.5, -0.2, -0.6, -0.5, 8.0, 0.6 - math.log2(2.5))),
        ("D7C1R1I0", (-0.1, -0.5, -0.2, -0.6, -1.0, 7.5, -0.45)),
    ],
)
def test_the_others_have_their_minimum_in_many_places(
    name: str, another: tuple[float, ...]
) -> None:
    """The sum is negative on one side of them, where the absolute value folds it."""
    function = FUNCTIONS[name]
    assert np.abs(function.minimizer - another).max() > 0.04
    values = function.value(np.tile(another, (20, 1)), numbers(20))
    np.testing.assert_allclose(values, 0.0, atol=1e-12)


def test_random_points_reach_the_acceptance_line_of_four_dimensions_but_not_of_d7c0() -> None:
    for name, function in FUNCTIONS.items():
        reached = function.value(points(function, 100_000), numbers(100_000)) <= ACCEPTANCE
        if not name.startswith("D7C1"):
            assert reached.any() == name.startswith("D4")


def test_draws_depend_on_seed_and_index_and_not_on_batches() -> None:
    together = draw(7, first=0, count=10)
    assert ((together >= 0.0) & (together < 1.0)).all()
    assert len(set(together.tolist())) == 10
    apart = [draw(7, first=0, count=3), draw(7, first=3, count=0), draw(7, first=3, count=7)]
    np.testing.assert_array_equal(np.concatenate(apart), together)
    assert not (draw(8, first=0, count=10) == together).any()
