"""Building blocks of local searches: polls, held variables, designs requested once."""

from __future__ import annotations

import math
from collections.abc import Generator

import numpy as np
import pytest

from gaitswarm.plugins import Axis, Space, create_search
from gaitswarm_research.methods.local_search import (
    Axes,
    Endless,
    Floats,
    Point,
    Walk,
    evaluated_once,
    gains,
    mixed,
    poll,
)
from research.tests.searches import MIXED, mixed_bowl, walked

AXES = Axes(MIXED)

START = MIXED.to_unit(MIXED.positions(np.array([[0.1, 2.0, 0.0, 3.0, 500.0]])))[0]


def bowl(unit: Floats) -> Floats:
    return mixed_bowl(MIXED.designs(MIXED.from_unit(unit)))


def start() -> Point:
    return Point(START, float(bowl(START[None])[0]))


def stays(here: Point, scale: float) -> Walk:
    """A local search that finds nothing."""
    yield here.unit[None]
    return here


def test_integers_of_few_values_and_choices_are_polled_all_others_are_smooth() -> None:
    assert AXES.polled.tolist() == [1, 2]
    assert AXES.smooth.tolist() == [0, 3, 4]
    assert AXES.least.tolist() == [0.0, 0.1, 0.0, 0.0, 0.001]


def test_neighbours_are_one_away_in_an_integer_and_every_other_choice() -> None:
    designs = MIXED.designs(MIXED.from_unit(AXES.neighbours(START)))
    assert designs[:, 1:3].tolist() == [[1, 0], [3, 0], [2, 1], [2, 2], [2, 3]]
    assert designs[:, [0, 3, 4]] == pytest.approx(np.tile([0.1, 3.0, 500.0], (5, 1)))


def test_there_are_no_neighbours_outside_the_bounds() -> None:
    corner = MIXED.to_unit(MIXED.positions(np.array([[0.1, 10.0, 0.0, 3.0, 500.0]])))[0]
    designs = MIXED.designs(MIXED.from_unit(AXES.neighbours(corner)))
    assert designs[:, 1].tolist() == [9, 10, 10, 10]


def test_a_poll_continues_until_no_neighbour_is_better() -> None:
    found, _ = walked(poll(start(), AXES), bowl)
    assert MIXED.designs(MIXED.from_unit(found.unit[None]))[0, 1:3].tolist() == [7, 2]
    assert found.fitness == bowl(found.unit[None])[0]


def test_a_poll_of_neighbours_that_are_equal_stays() -> None:
    here = start()
    found, proposals = walked(poll(here, AXES), lambda unit: np.full(len(unit), here.fitness))
    assert found is here
    assert len(proposals) == 1


def test_a_mixed_search_continues_from_where_a_poll_found_better() -> None:
    """At x = 0.9 an integer of 0 is better, at 0.2, the best x then, one of 1."""
    space = Space([Axis(0.0, 1.0), Axis(0.0, 1.0, "integer")])
    scales = []

    def formula(unit: Floats) -> Floats:
        x = unit[:, 0]
        return np.where(unit[:, 1] > 0.5, np.abs(x - 0.3), 0.2 + 0.5 * np.abs(x - 0.2))

    def best_of_a_line(here: Point, scale: float) -> Walk:
        scales.append((scale, float(here.unit[1])))
        line = np.column_stack([np.linspace(0.0, 1.0, 11), np.full(11, here.unit[1])])
        fitness = yield line
        k = int(np.argmin(fitness))
        return Point(line[k], float(fitness[k]))

    at = np.array([0.9, 0.0])
    here = Point(at, float(formula(at[None])[0]))
    found, _ = walked(mixed(here, Axes(space), best_of_a_line), formula)
    assert found.unit == pytest.approx([0.3, 1.0])
    assert [integer for _, integer in scales] == [0.0, 1.0]
    assert scales[1][0] < scales[0][0] == 1.0


def test_a_mixed_search_without_smooth_variables_polls_only() -> None:
    space = Space([Axis(0.0, 5.0, "integer")])
    here = Point(np.array([0.0]), 5.0)
    found, _ = walked(mixed(here, Axes(space), stays), lambda unit: 5.0 - 5.0 * unit[:, 0])
    assert found.unit.tolist() == [1.0]


def proposing(units: list[list[float]], heard: list[list[float]]) -> Endless:
    """A search of one variable that proposes what is listed, again and again."""
    while True:
        for unit in units:
            fitness = yield np.array(unit)[:, None]
            heard.append(fitness.tolist())


def test_a_design_that_is_known_is_answered_from_memory() -> None:
    space = Space([Axis(0.0, 4.0, "integer")])
    heard: list[list[float]] = []
    proposals = evaluated_once(space, proposing([[0.0, 0.26, 0.24], [0.5, 0.25], [0.75]], heard))
    assert next(proposals).ravel().tolist() == [0.0, 1.04]
    assert proposals.send(np.array([10.0, 11.0])).ravel().tolist() == [2.0]
    assert proposals.send(np.array([12.0])).ravel().tolist() == [3.0]
    assert heard == [[10.0, 11.0, 11.0], [12.0, 11.0]]


def test_a_search_that_knows_all_designs_still_asks() -> None:
    space = Space([Axis(0.0, 1.0, "integer")])
    proposals: Generator[Floats, Floats, None] = evaluated_once(
        space, proposing([[0.0], [1.0]], [])
    )
    assert next(proposals).tolist() == [[0.0]]
    asked = [proposals.send(np.ones(1)).tolist() for _ in range(5)]
    assert asked[0] == [[1.0]]
    assert all(position in ([[0.0]], [[1.0]]) for position in asked)


def test_any_success_gains_on_a_failed_evaluation() -> None:
    failed, good, better = (Point(START, f) for f in (math.inf, 2.0, 1.9))
    assert gains(good, failed, 0.1) and not gains(failed, failed, 0.1)
    assert gains(better, good, 0.04) and not gains(better, good, 0.06)


@pytest.mark.parametrize(
    "method", ["dts", "global-bfgs", "global-nelder-mead", "global-unirandi", "nelder-mead", "sa"]
)
def test_a_method_searches_around_the_best_of_its_start(method: str) -> None:
    """Random designs differ from it in every variable, its neighbours in one."""
    best = np.array([0.5, 7.0, 2.0, -1.2, 640.0])
    start = MIXED.positions(np.array([[1.5, 2.0, 0.0, 4.0, 100.0], best]))
    search = create_search(method, MIXED, 120, 1, start)
    asked = []
    while search.evaluations < 120:
        designs = MIXED.designs(search.ask(120 - search.evaluations))
        asked.append(designs)
        search.tell(mixed_bowl(designs))
    after = np.vstack(asked)[2:]
    assert ((np.abs(after - best) > 1e-9).sum(axis=1) == 1).any()
