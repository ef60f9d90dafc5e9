"""Directed tabu search: regions, descent directions, exploration, and where it goes next."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gaitswarm.plugins import Axis, RandomNumbers, Space
from gaitswarm_research.methods.directed_tabu import (
    DirectedTabuSettings,
    TabuList,
    VisitedRegions,
    descent_direction,
    explore,
    neighbours,
)
from gaitswarm_research.methods.local_search import Axes, Floats, Point
from research.tests.searches import MIXED, Formula, calls_to, designs_asked, mixed_bowl, walked

SQUARE = Axes(Space.continuous([0.0, 0.0], [1.0, 1.0]))

CENTRE = np.array([0.5, 0.5])


def at(unit: list[float], formula: Formula) -> Point:
    return Point(np.array(unit), float(formula(np.array([unit]))[0]))


def explored(start: list[float], formula: Formula, **settings: float) -> tuple[Point, list[Floats]]:
    regions = VisitedRegions(2, 0.2)
    walk = explore(
        at(start, formula),
        SQUARE,
        DirectedTabuSettings.model_validate(settings),
        regions,
        RandomNumbers(1, 1),
    )
    return walked(walk, formula)


def test_a_position_near_a_visited_point_is_tabu_until_the_point_is_forgotten() -> None:
    tabu = TabuList(2, 0.02, 0.1)
    tabu.visit(CENTRE)
    assert tabu.is_tabu(CENTRE + 0.019)
    assert not tabu.is_tabu(np.array([0.521, 0.5]))
    tabu.visit(np.array([0.1, 0.1]))
    assert tabu.is_tabu(CENTRE)
    tabu.visit(np.array([0.9, 0.9]))
    assert not tabu.is_tabu(CENTRE)


def test_the_way_out_leads_from_the_centroid_of_the_points_that_are_near() -> None:
    tabu = TabuList(5, 0.02, 0.1)
    for point in ([0.45, 0.5], [0.45, 0.54], [0.9, 0.9]):
        tabu.visit(np.array(point))
    assert tabu.way_out(CENTRE) == pytest.approx([0.05, -0.02])
    assert not tabu.way_out(np.array([0.1, 0.9])).any()


def test_neighbours_are_one_in_each_variable_on_the_side_that_leads_out() -> None:
    tabu = TabuList(5, 0.02, 0.1)
    tabu.visit(np.array([0.45, 0.55]))
    near = neighbours(CENTRE, SQUARE, 0.1, tabu, RandomNumbers(1, 1))
    assert near == pytest.approx(np.array([[0.6, 0.5], [0.5, 0.4]]))


def test_neighbours_of_integers_are_one_away_and_of_choices_another_one() -> None:
    unit = MIXED.to_unit(MIXED.positions(np.array([[0.1, 10.0, 2.0, 3.0, 500.0]])))[0]
    tabu = TabuList(5, 0.02, 0.1)
    near = neighbours(unit, Axes(MIXED), 1e-4, tabu, RandomNumbers(1, 1))
    designs = MIXED.designs(MIXED.from_unit(near))
    assert designs[1, 1] == 9.0
    assert designs[2, 2] != 2.0
    assert abs(designs[4, 4] - 500.0) == 1.0


def test_the_descent_direction_of_a_plane_is_its_slope() -> None:
    """Weights are differences, directions from the neighbours: here (0.2, 0.1) and its opposite."""

    def plane(unit: Floats) -> Floats:
        return 2.0 * unit[:, 0] - unit[:, 1]

    trials = [at([0.6, 0.5], plane), at([0.5, 0.6], plane)]
    direction = descent_direction(at([0.5, 0.5], plane), trials, SQUARE)
    assert direction == pytest.approx(np.array([-2.0, 1.0]) / math.sqrt(5.0))


def test_neighbours_that_failed_have_no_part_in_a_direction() -> None:
    failed = Point(np.array([0.5, 0.6]), math.inf)
    worse = Point(np.array([0.6, 0.5]), 2.0)
    direction = descent_direction(Point(CENTRE, 1.0), [worse, failed], SQUARE)
    assert direction.tolist() == [-1.0, 0.0]


def test_an_exploration_judges_neighbours_as_a_batch_and_then_along_the_direction() -> None:
    found, proposals = explored([0.9, 0.9], lambda unit: unit.sum(axis=1))
    assert [len(proposal) for proposal in proposals[:3]] == [2, 1, 1]
    first = np.vstack(proposals[1:3])
    assert first[0] == pytest.approx([0.9 - 0.2 / math.sqrt(2.0)] * 2)
    assert first[1] == pytest.approx([0.9 - 0.4 / math.sqrt(2.0)] * 2)
    assert found.unit == pytest.approx([0.0, 0.0], abs=1e-9)


def test_an_exploration_leaves_a_local_minimum_and_does_not_come_back() -> None:
    def cusp(unit: Floats) -> Floats:
        return np.abs(unit - 0.5).sum(axis=1)

    found, proposals = explored([0.5, 0.5], cusp, patience=6)
    assert found.unit.tolist() == [0.5, 0.5]
    distances = np.abs(np.vstack(proposals) - 0.5).max(axis=1)
    assert (distances >= 0.02).all()
    assert len(proposals) > 6


def test_an_exploration_ends_when_it_finds_no_new_best() -> None:
    _, proposals = explored([0.5, 0.5], lambda unit: np.ones(len(unit)), patience=3)
    assert len(proposals) == 3


def test_the_next_start_is_outside_of_visited_regions() -> None:
    regions = VisitedRegions(2, 0.2)
    regions.visit(CENTRE)
    candidates = np.array([[0.6, 0.6], [0.75, 0.5], [0.9, 0.9]])
    assert regions.farthest(candidates).tolist() == [0.75, 0.5]


def test_a_region_that_was_visited_often_is_left_farther_behind() -> None:
    regions = VisitedRegions(2, 0.2)
    for _ in range(4):
        regions.visit(CENTRE + 0.01)
    candidates = np.array([[0.75, 0.5], [0.95, 0.95]])
    assert regions.farthest(candidates).tolist() == [0.95, 0.95]


def test_where_all_is_visited_the_next_start_is_least_inside() -> None:
    regions = VisitedRegions(2, 0.9)
    regions.visit(CENTRE)
    assert regions.farthest(np.array([[0.5, 0.6], [0.1, 0.5]])).tolist() == [0.1, 0.5]


def test_a_mixed_optimum_is_found() -> None:
    calls = [
        calls_to(1e-2, designs_asked("dts", MIXED, mixed_bowl, 600, seed), mixed_bowl)
        for seed in range(5)
    ]
    assert np.median(calls) < 400


def test_the_better_of_two_minima_is_intensified_and_the_other_one_explored() -> None:
    space = Space([Axis(0.0, 1.0), Axis(0.0, 1.0)])

    def two_wells(x: Floats) -> Floats:
        left, right = np.square(x - 0.2).sum(axis=1) + 0.05, np.square(x - 0.8).sum(axis=1)
        return 1.0 + np.minimum(left, right)

    x = np.vstack(designs_asked("dts", space, two_wells, 400, seed=2, tolerance=1e-10))
    assert (np.abs(x - 0.8).max(axis=1) < 1e-3).any()
    assert (np.abs(x - 0.2).max(axis=1) < 0.1).any()
