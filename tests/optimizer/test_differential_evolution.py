"""Differential evolution's own mechanics, and that it finds what it is to find."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from gaitswarm.services.optimizer.search.differential_evolution import (
    DeSettings,
    DifferentialEvolution,
    gains,
    lehmer_mean,
)
from gaitswarm.services.optimizer.search.pso import ParticleSwarm, PsoSettings
from gaitswarm.services.optimizer.search.space import Axis, Space

Floats = NDArray[np.float64]

MIXED = Space([Axis(-5.0, 5.0)] * 8 + [Axis(-5.0, 5.0, "integer")])
GRID = Space([Axis(0.0, 9.0, "integer")] * 3)
LINE = Space([Axis(0.0, 1.0)])


def search(
    space: Space = MIXED, budget: int = 500, seed: int = 1, **given: object
) -> DifferentialEvolution:
    return DifferentialEvolution(DeSettings.model_validate(given), space, budget, seed)


def bowl(designs: Floats) -> Floats:
    """0 at 2 in every variable."""
    squares: Floats = np.square(designs - 2.0).sum(axis=1)
    return squares


def generation(optimizer: DifferentialEvolution) -> Floats:
    """Tell a whole generation what a bowl comes to there; it is given back."""
    positions = optimizer.ask()
    optimizer.tell(bowl(optimizer.space.designs(positions)))
    return positions


def best_of(optimizer: DifferentialEvolution | ParticleSwarm) -> float:
    best = math.inf
    while optimizer.evaluations < optimizer.budget:
        positions = optimizer.ask(optimizer.budget - optimizer.evaluations)
        fitness = bowl(optimizer.space.designs(positions))
        best = min(best, float(fitness.min()))
        optimizer.tell(fitness)
    return best


def test_the_first_generation_is_a_latin_hypercube() -> None:
    positions = search(Space.continuous([0.0] * 3, [1.0] * 3), population=20).ask()
    for column in positions.T:
        assert sorted(np.floor(column * 20).tolist()) == list(range(20))


def test_a_member_is_replaced_by_a_trial_that_is_no_worse_and_by_no_other() -> None:
    optimizer = search(population=10, population_end=10)
    first = optimizer.ask()
    optimizer.tell(np.ones(10))
    trials = optimizer.ask()
    fitness = np.array([0.5, 1.0, 1.5, math.inf, 0.9] * 2)
    optimizer.tell(fitness)
    expected = np.where((fitness <= 1.0)[:, np.newaxis], trials, first)
    np.testing.assert_array_equal(optimizer.state.members, expected)


def test_the_population_falls_evenly_over_the_budget_and_then_stays() -> None:
    optimizer = search(budget=600, population=24, population_end=4)
    sizes = {}
    while optimizer.evaluations < 700:
        generation(optimizer)
        sizes[optimizer.evaluations] = len(optimizer.state.members)
    for evaluations, size in sizes.items():
        assert abs(size - max(4.0, 24.0 - 20.0 * evaluations / 600)) <= 0.5


def test_the_worst_members_are_removed() -> None:
    optimizer = search(budget=40, population=20, population_end=4)
    first = optimizer.ask()
    optimizer.tell(np.arange(20.0))
    np.testing.assert_array_equal(optimizer.state.members, first[:12])
    optimizer.tell(np.full(len(optimizer.ask()), math.inf))
    np.testing.assert_array_equal(optimizer.state.members, first[:7])


def test_no_trial_is_a_design_that_the_population_has() -> None:
    optimizer = search(GRID, population=8, crossover=0.0)
    generation(optimizer)
    new = total = 0
    for _ in range(30):
        have = {row.tobytes() for row in GRID.designs(optimizer.state.members)}
        trials = {row.tobytes() for row in GRID.designs(generation(optimizer))}
        new, total = new + len(trials - have), total + len(have)
    # One draw in ten gives a variable the value that it had.
    assert new > 0.8 * total


def test_a_converged_population_is_given_up_for_a_new_one() -> None:
    optimizer = search(LINE, budget=20_000, population=8)
    generation(optimizer)
    extents = []
    while len(members := optimizer.state.members):
        extents.append(float(np.ptp(members)))
        generation(optimizer)
        assert optimizer.evaluations < 5_000
    assert extents[-1] < 0.01 * extents[0]
    new = generation(optimizer)
    assert sorted(np.floor(new[:, 0] * 8).tolist()) == list(range(8))


def test_crossover_and_scale_are_learned_unless_they_are_not_to_be() -> None:
    states = {}
    for adaptation in ("success-history", "none"):
        optimizer = search(adaptation=adaptation, memory=3)
        for _ in range(10):
            generation(optimizer)
        states[adaptation] = optimizer.dump()
    assert states["none"]["scales"] == [0.5] * 3 and states["none"]["crossovers"] == [0.9] * 3
    learned = states["success-history"]
    assert 0.5 not in learned["scales"] and 0.9 not in learned["crossovers"]


def test_a_success_counts_by_its_gain() -> None:
    assert lehmer_mean(np.array([0.2, 0.8]), np.array([1.0, 0.0])) == pytest.approx(0.2)
    assert lehmer_mean(np.array([0.2, 0.8]), np.array([1.0, 1.0])) == pytest.approx(0.68)
    assert lehmer_mean(np.zeros(2), np.ones(2)) == 0.0


def test_a_mean_does_not_depend_on_the_order_of_its_terms() -> None:
    numbers = np.random.default_rng(1).random((2, 100))
    assert lehmer_mean(*numbers) == lehmer_mean(*numbers[:, ::-1])


def test_what_a_first_success_gains_is_finite() -> None:
    before, after = np.array([3.0, math.inf, math.inf]), np.array([1.0, 5.0, math.inf])
    assert gains(before, after).tolist() == [2.0, 2.0, 0.0]
    assert gains(before[1:], after[1:]).tolist() == [1.0, 0.0]


def test_a_categorical_variable_takes_every_choice_and_settles_on_the_best() -> None:
    space = Space([Axis(0.0, 4.0, "categorical"), Axis(0.0, 1.0)])
    optimizer = search(space, budget=400, population=20)
    seen = list[float]()
    while optimizer.evaluations < 400:
        designs = space.designs(optimizer.ask())
        seen += designs[:, 0].tolist()
        # Neighbours of the best choice are the worst ones: nothing leads there by differences.
        optimizer.tell(
            np.array([3.0, 5.0, 0.0, 5.0, 4.0])[designs[:, 0].astype(int)] + designs[:, 1]
        )
    assert set(seen[:100]) == {0.0, 1.0, 2.0, 3.0, 4.0}
    assert set(space.designs(optimizer.state.members)[:, 0]) == {2.0}


def test_the_population_never_grows() -> None:
    with pytest.raises(ValidationError, match="population_end"):
        DeSettings(population=10, population_end=11)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("members", [[0.0] * 9] * 3),
        ("members", [[9.0] * 9] * 25),
        ("member_fitness", [1.0]),
        ("archive", [[9.0] * 9]),
        ("scales", []),
        ("positions", [[0.0] * 9] * 30),
    ],
)
def test_an_impossible_state_is_refused(field: str, value: object) -> None:
    optimizer = search(population_end=25)
    generation(optimizer)
    optimizer.ask()
    with pytest.raises(ValueError, match=field):
        optimizer.load(optimizer.dump() | {field: value})


@pytest.mark.thorough("test_a_member_is_replaced_by_a_trial_that_is_no_worse_and_by_no_other")
def test_a_bowl_with_an_integer_is_solved_in_2500_evaluations() -> None:
    found = [best_of(search(budget=2_500, seed=seed)) for seed in range(5)]
    by_swarm = [best_of(ParticleSwarm(PsoSettings(), MIXED, 2_500, seed)) for seed in range(5)]
    assert max(found) < 1e-6 < min(by_swarm)
