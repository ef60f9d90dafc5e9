"""Simulated annealing: acceptance, adapted steps, cooling by the budget, integers, chains."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gaitswarm.plugins import Axis, RandomNumbers, Space
from gaitswarm_research.methods.annealing import Chain, initial_temperature
from gaitswarm_research.methods.local_search import Axes, Floats, Point
from research.tests.searches import MIXED, calls_to, designs_asked, mixed_bowl

SQUARE = Space.continuous([0.0, 0.0], [1.0, 1.0])


def chain(fitness: float = 1.0, space: Space = SQUARE, step: float = 0.5) -> Chain:
    return Chain(Point(np.full(space.dimension, 0.5), fitness), Axes(space), step)


def there(fitness: float) -> Point:
    return Point(np.array([0.6, 0.5]), fitness)


@pytest.mark.parametrize(("chance", "accepts"), [(0.36, True), (0.37, False)])
def test_a_rise_is_accepted_in_the_share_of_its_boltzmann_factor(
    chance: float, accepts: bool
) -> None:
    one = chain()
    one.move(0, there(3.0), temperature=2.0, chance=chance)
    assert (one.here.fitness == 3.0) == accepts
    assert one.best.fitness == 1.0


def test_a_fall_is_always_accepted_and_a_failure_never() -> None:
    one = chain()
    one.move(0, there(0.5), temperature=1e-9, chance=0.999)
    one.move(0, there(math.inf), temperature=1e9, chance=0.0)
    assert one.here.fitness == one.best.fitness == 0.5


def test_a_chain_that_is_at_a_failure_leaves_it() -> None:
    one = chain(math.inf)
    one.move(0, there(math.inf), temperature=1.0, chance=0.9)
    assert one.here.unit[0] == 0.6
    one.move(0, there(7.0), temperature=1.0, chance=0.9)
    assert one.best.fitness == 7.0


def test_steps_grow_where_most_moves_are_accepted_and_shrink_where_few_are() -> None:
    """Corana et al.: 1 + 2 (1 - 0.6) / 0.4 = 3 for all, 1 / (1 + 2 (0.4 - 0) / 0.4) for none."""
    one = chain(10.0, step=0.3)
    for k in range(4):
        one.move(0, there(9.0 - k), temperature=1.0, chance=0.5)
    one.adapt(4)
    assert one.steps.tolist() == pytest.approx([0.9, 0.1])


def test_a_chain_goes_back_to_its_best_when_it_cools() -> None:
    one = chain()
    one.move(0, there(1.1), temperature=10.0, chance=0.1)
    assert one.here.fitness == 1.1
    one.adapt(1)
    assert one.here.fitness == 1.0


def test_the_first_temperature_accepts_a_usual_rise_in_the_share_asked_for() -> None:
    temperature = initial_temperature([1.0, 3.0, math.inf], acceptance=0.2)
    assert math.exp(-2.0 / temperature) == pytest.approx(0.2)
    assert initial_temperature([math.inf, 1.0], acceptance=0.2) == 1.0


def test_a_move_changes_one_variable_and_always_changes_the_design() -> None:
    one, random = chain(space=MIXED, step=1e-3), RandomNumbers(1, 1)
    before = MIXED.designs(MIXED.from_unit(one.here.unit[None]))[0]
    for j in range(5):
        trials = np.array([one.trial(j, random) for _ in range(50)])
        designs = MIXED.designs(MIXED.from_unit(trials))
        assert ((designs != before).sum(axis=0) == np.where(np.arange(5) == j, 50, 0)).all()
        if j == 1:
            assert set(designs[:, 1]) == {4.0, 6.0}
        if j == 2:
            assert set(designs[:, 2]) == {0.0, 1.0, 3.0}


def test_an_integer_at_its_bound_moves_inwards() -> None:
    space = Space([Axis(0.0, 3.0, "integer")])
    one = Chain(Point(np.array([1.0]), 1.0), Axes(space), 0.1)
    random = RandomNumbers(1, 1)
    trials = np.array([one.trial(0, random) for _ in range(20)])
    assert (space.designs(space.from_unit(trials)) == 2.0).all()


@pytest.mark.parametrize("budget", [200, 800])
def test_moves_are_small_at_the_end_of_the_budget_whatever_it_is(budget: int) -> None:
    def bowl(x: Floats) -> Floats:
        return 1.0 + np.square(x - 0.3).sum(axis=1)

    x = np.vstack(designs_asked("sa", SQUARE, bowl, budget))
    half = np.abs(x[budget // 3 : 2 * budget // 3] - 0.3).mean()
    assert np.abs(x[-budget // 10 :] - 0.3).mean() < 0.5 * half


def test_chains_are_one_batch() -> None:
    asked = designs_asked("sa", SQUARE, lambda x: x[:, 0], 100, chains=4, sample=8)
    assert len(asked[0]) == 8
    assert {len(designs) for designs in asked[1:]} == {4}


def test_a_mixed_optimum_is_found() -> None:
    calls = [
        calls_to(0.02, designs_asked("sa", MIXED, mixed_bowl, 1000, seed), mixed_bowl)
        for seed in range(5)
    ]
    assert np.median(calls) < 900
