"""The gravitational search algorithm: masses, pulls, and the schedule of the constant."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.plugins import Axis, RandomNumbers, Space, create_search
from gaitswarm_research.methods.gsa import GsaSettings, accelerations, gsa, masses

Floats = NDArray[np.float64]

BOX = Space.continuous([-1.0, 0.0], [1.0, 10.0])


def random() -> RandomNumbers:
    return RandomNumbers(1, 99)


def test_the_best_is_heaviest_and_neither_the_worst_nor_a_failure_has_a_mass() -> None:
    assert masses(np.array([3.0, 1.0, math.inf, 5.0])) == pytest.approx([1 / 3, 2 / 3, 0.0, 0.0])


def test_masses_are_equal_where_none_is_better() -> None:
    assert masses(np.array([2.0, math.inf, 2.0])).tolist() == [0.5, 0.0, 0.5]
    assert masses(np.full(4, math.inf)).tolist() == [0.25] * 4


def test_a_mass_is_pulled_towards_the_others_by_at_most_their_mass_at_any_distance() -> None:
    places = np.array([[0.0, 0.0], [3.0, 4.0], [300.0, 400.0]])
    for heavy in (1, 2):
        mass = np.zeros(3)
        mass[heavy] = 1.0
        pull = accelerations(places, mass, 3, random())
        assert (pull[heavy] == 0.0).all()
        share = pull[0] / np.array([0.6, 0.8])
        assert ((share > 0.0) & (share < 1.0)).all()
        assert share[0] != share[1]


def test_only_the_heaviest_attract() -> None:
    places = np.array([[0.0], [1.0], [-1.0]])
    mass = np.array([0.0, 0.6, 0.4])
    assert accelerations(places, mass, 1, random())[0, 0] > 0.0
    lighter = accelerations(places, mass, 2, random())
    assert lighter[1, 0] < 0.0, "the lighter one pulls the heavier one"
    assert accelerations(places, mass, 1, random())[1, 0] == 0.0


def steps(settings: GsaSettings, iterations: int) -> list[float]:
    """Median distance that masses go in each iteration, as a share of the range."""
    proposals = gsa(settings, BOX, 10 * iterations, random())
    positions, found = next(proposals), []
    for _ in range(2 * iterations):
        unit = BOX.to_unit(positions)
        positions = proposals.send(np.square(unit - 0.4).sum(axis=1))
        found.append(float(np.median(np.abs(BOX.to_unit(positions) - unit))))
    return found


def test_masses_come_to_rest_over_the_budget_and_then_begin_again() -> None:
    found = steps(GsaSettings(particles=10), 40)
    assert np.median(found[:10]) > 0.1
    assert max(found[35:39]) < 1e-3
    assert found[39] > 0.1
    assert max(found[75:79]) < 1e-3


def test_without_decay_masses_do_not_come_to_rest() -> None:
    assert min(steps(GsaSettings(particles=10, decay=0.0), 40)) > 0.1


def test_a_value_that_leaves_the_box_is_drawn_again() -> None:
    proposals = gsa(GsaSettings(particles=10, gravity=1e6), BOX, 1000, random())
    positions, seen = next(proposals), []
    for _ in range(20):
        seen.append(positions)
        positions = proposals.send(positions.sum(axis=1))
    unit = BOX.to_unit(np.concatenate(seen))
    assert ((unit > 0.0) & (unit < 1.0)).all(), "nothing sticks to a wall"
    assert np.histogram(unit, bins=4, range=(0.0, 1.0))[0].min() > 50


def test_it_reaches_a_target_with_an_integer() -> None:
    """Least, 0, at (0.3, 6)."""
    space = Space([Axis(-1.0, 1.0), Axis(0.0, 10.0, "integer")])
    for seed in range(5):
        optimizer = create_search(GsaSettings(), space, 2000, seed)
        least = math.inf
        while optimizer.evaluations < 2000:
            x, n = space.designs(optimizer.ask()).T
            fitness = np.square(x - 0.3) + np.square(n - 6.0) / 25.0
            least = min(least, float(fitness.min()))
            optimizer.tell(fitness)
        assert least < 1e-3
