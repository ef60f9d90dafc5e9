"""UniRandi and BFGS: steps, batches, bounds and ends of the local searches of GLOBAL."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gaitswarm.plugins import Axis, RandomNumbers, Space
from gaitswarm_research.methods.bfgs import bfgs
from gaitswarm_research.methods.local_search import Axes, Floats, Point, Walk
from gaitswarm_research.methods.unirandi import unirandi
from research.tests.searches import Formula, walked

CUBE = Axes(Space.continuous([0.0] * 4, [1.0] * 4))

MIXED = Axes(Space([Axis(0.0, 1.0), Axis(0.0, 40.0, "integer"), Axis(0.0, 3.0, "categorical")]))

START = np.array([0.3, 0.6, 0.2, 0.7])


def quadratic(unit: Floats) -> Floats:
    """Ill-conditioned, coupled; least, 1, at 0.5 in every variable."""
    x = unit - 0.5
    coupled = x[:, :-1] * x[:, 1:]
    return 1.0 + (x**2 * [1.0, 10.0, 30.0, 100.0]).sum(axis=1) + coupled.sum(axis=1)


def slope_out_of_the_box(unit: Floats) -> Floats:
    return ((unit - [1.4, 0.5, -0.3, 0.5]) ** 2).sum(axis=1)


def at(unit: Floats, formula: Formula) -> Point:
    return Point(unit, float(formula(unit[None])[0]))


def random_walk(start: Point, axes: Axes = CUBE, tolerance: float = 1e-9) -> Walk:
    return unirandi(start, axes, RandomNumbers(1, 1), 0.01, tolerance)


def quasi_newton(start: Point, axes: Axes = CUBE, tolerance: float = 1e-9) -> Walk:
    return bfgs(start, axes, 0.1, tolerance, difference=1e-5)


def test_unirandi_doubles_its_step_along_a_direction_that_gains() -> None:
    def plane(unit: Floats) -> Floats:
        return unit[:, 0]

    centre = np.full(4, 0.5)
    _, proposals = walked(random_walk(at(centre, plane)), plane)
    points = np.vstack([centre, *proposals])
    first = 1 if points[1, 0] < 0.5 else 2
    steps = np.linalg.norm(np.diff(np.vstack([centre, points[first : first + 5]]), axis=0), axis=1)
    assert steps == pytest.approx(0.01 * np.array([1.0, 2.0, 4.0, 8.0, 16.0]))


def test_unirandi_tries_the_opposite_and_halves_its_step_after_two_failures() -> None:
    def cusp(unit: Floats) -> Floats:
        return np.linalg.norm(unit - 0.5, axis=1)

    centre = np.full(4, 0.5)
    found, proposals = walked(random_walk(at(centre, cusp)), cusp)
    steps = np.vstack(proposals) - centre
    assert steps[1] == pytest.approx(-steps[0])
    assert steps[3] == pytest.approx(-steps[2])
    lengths = np.linalg.norm(steps, axis=1)
    assert lengths[:8] == pytest.approx([0.01] * 4 + [0.005] * 4)
    assert found.fitness == 0.0


def test_bfgs_asks_for_a_gradient_as_one_batch_and_for_one_point_along_a_line() -> None:
    _, proposals = walked(quasi_newton(at(START, quadratic)), quadratic)
    assert len(proposals[0]) == 4
    assert {len(proposal) for proposal in proposals} == {1, 4}


def test_bfgs_needs_few_evaluations_on_a_quadratic() -> None:
    found, proposals = walked(quasi_newton(at(START, quadratic), tolerance=1e-6), quadratic)
    assert found.fitness < 1.0 + 1e-5
    assert sum(map(len, proposals)) < 100


@pytest.mark.parametrize("search", [random_walk, quasi_newton])
def test_a_minimum_on_a_corner_of_the_box_is_found_inside_the_bounds(search: object) -> None:
    assert callable(search)
    found, proposals = walked(search(at(START, slope_out_of_the_box)), slope_out_of_the_box)
    asked = np.vstack(proposals)
    assert ((asked >= 0.0) & (asked <= 1.0)).all()
    assert found.unit == pytest.approx([1.0, 0.5, 0.0, 0.5], abs=0.02)


@pytest.mark.parametrize("search", [random_walk, quasi_newton])
def test_polled_variables_are_held(search: object) -> None:
    def formula(unit: Floats) -> Floats:
        return np.abs(unit[:, 1] - 0.75) + unit[:, 0] + unit[:, 2]

    assert callable(search)
    start = at(np.array([0.5, 0.5, 0.6]), formula)
    found, proposals = walked(search(start, MIXED), formula)
    assert (np.vstack(proposals)[:, 2] == 0.6).all()
    assert found.fitness < 0.7


def test_the_neighbour_of_an_integer_is_one_away() -> None:
    start = Point(np.array([0.5, 0.5, 0.6]), 0.5)
    _, proposals = walked(quasi_newton(start, MIXED), lambda unit: unit[:, 1])
    designs = MIXED.space.designs(MIXED.space.from_unit(proposals[0]))
    assert designs[:, 1].tolist() == [20.0, 21.0]


@pytest.mark.parametrize("search", [random_walk, quasi_newton])
@pytest.mark.parametrize("value", [1.0, math.inf])
def test_a_search_ends_where_everything_is_equal_or_fails(search: object, value: float) -> None:
    assert callable(search)
    found, _ = walked(search(Point(START, value)), lambda unit: np.full(len(unit), value))
    assert (found.unit == START).all()


def test_a_neighbour_that_fails_does_not_turn_the_gradient() -> None:
    def formula(unit: Floats) -> Floats:
        fitness = quadratic(unit)
        fitness[unit[:, 2] > 0.4] = math.inf
        return fitness

    start = at(np.array([0.3, 0.6, 0.4, 0.7]), formula)
    found, _ = walked(quasi_newton(start), formula)
    assert found.fitness < 1.4
    assert found.unit[3] == pytest.approx(0.5, abs=0.01)
