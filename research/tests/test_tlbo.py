"""Teaching-learning-based optimization: what its phases propose, and what a class keeps."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gaitswarm.plugins import Axis, Proposals, RandomNumbers, Space, Start, create_search
from gaitswarm_research.methods.tlbo import TlboSettings, tlbo

Floats = NDArray[np.float64]

# A class in the middle of its box never comes to a bound.
BOX = Space.continuous([-1.0, -2.0], [1.0, 2.0])


def begin(space: Space = BOX, *, seed: int = 1, **given: object) -> tuple[Proposals, Floats]:
    settings = TlboSettings.model_validate({"particles": 6} | given)
    proposals = tlbo(settings, space, 1000, RandomNumbers(seed, 99))
    return proposals, next(proposals).copy()


def bowl(positions: Floats) -> Floats:
    fitness: Floats = np.square(positions - 0.1).sum(axis=1)
    return fitness


def is_inside(moved: Floats, space: Space = BOX) -> NDArray[np.bool_]:
    inside: NDArray[np.bool_] = (moved > space.low) & (moved < space.high)
    return inside


def test_the_teacher_phase_moves_by_the_teacher_less_once_or_twice_the_mean() -> None:
    factors = set()
    for seed in range(10):
        proposals, learners = begin(seed=seed)
        fitness = bowl(learners)
        moved = proposals.send(fitness.copy())
        assert moved.shape == learners.shape
        teacher, mean = learners[np.argmin(fitness)], learners.mean(axis=0)
        for before, after in zip(learners, moved, strict=True):
            free = is_inside(after)
            possible = {
                factor
                for factor in (1.0, 2.0)
                if all(0.0 <= r < 1.0 for r in ((after - before) / (teacher - factor * mean))[free])
            }
            assert possible
            factors.add(frozenset(possible))
    assert {frozenset({1.0}), frozenset({2.0})} <= factors


def test_the_learner_phase_goes_to_a_better_one_and_away_from_a_worse_one() -> None:
    proposals, (good, bad) = begin(particles=2)
    proposals.send(np.array([1.0, 2.0]))
    moved = proposals.send(np.full(2, math.inf))
    for before, after in zip((good, bad), moved, strict=True):
        share = ((after - before) / (good - bad))[is_inside(after)]
        assert ((share >= 0.0) & (share < 1.0)).all()
    assert is_inside(moved).any(axis=1).all()


def test_a_learner_keeps_what_is_better_and_nothing_else() -> None:
    """In the next learner phase of two, one of them moves along the line between both."""
    proposals, (first, second) = begin(particles=2)
    taught = proposals.send(np.array([1.0, 2.0])).copy()
    moved = proposals.send(np.array([1.5, 0.5]))
    line = taught[1] - first
    shares = ((moved - np.array([first, taught[1]])) / line)[is_inside(moved)]
    assert ((shares >= 0.0) & (shares < 1.0)).all()
    assert not np.allclose(taught[1], second)


def test_phases_alternate_and_are_one_batch_each() -> None:
    optimizer = create_search(TlboSettings(particles=6), BOX, 1000, 1)
    for _ in range(7):
        positions = optimizer.ask()
        assert len(positions) == 6
        optimizer.tell(bowl(positions))


def test_duplicates_are_changed_before_they_are_judged() -> None:
    space = Space([Axis(0.0, 29.0, "integer"), Axis(0.0, 29.0, "integer")])
    proposals, positions = begin(space, particles=10)
    seen = []
    for _ in range(20):
        designs = space.designs(positions)
        seen += [tuple(row) for row in designs.tolist()]
        positions = proposals.send(np.square(designs - 11.0).sum(axis=1))
    assert len(set(seen)) == len(seen) == 200


def test_a_class_that_has_collapsed_is_replaced() -> None:
    proposals, positions = begin(collapse=0.01)
    spreads = []
    for _ in range(100):
        spreads.append(float(np.ptp(positions, axis=0).max()))
        positions = proposals.send(bowl(positions))
    close = int(np.argmax(np.array(spreads) < 0.1))
    assert 5 < close < 70
    assert max(spreads[close:]) > 1.0


def test_a_class_of_which_everything_failed_is_replaced() -> None:
    proposals, first = begin()
    second = proposals.send(np.full(6, math.inf))
    drawn = RandomNumbers(1, 99)
    for positions in (first, second):
        assert positions.tolist() == BOX.evenly(drawn.uniform(6, 2)).tolist()


def test_what_was_evaluated_before_are_learners_of_the_first_class() -> None:
    given = np.array([[0.5, 0.5], [0.3, 0.2], [-0.5, 0.5]])
    _, drawn = begin()
    settings, worth = TlboSettings(particles=6), np.array([2.0, 1.0, math.inf])
    proposals = tlbo(settings, BOX, 1000, RandomNumbers(1, 99), Start(given, worth))
    assert next(proposals).tolist() == drawn[2:].tolist()

    full = tlbo(TlboSettings(particles=2), BOX, 1000, RandomNumbers(1, 99), Start(given, worth))
    moved = next(full)
    teacher, mean = given[1], given[:2].mean(axis=0)
    for before, after in zip(given[[1, 0]], moved, strict=True):
        shares = [(after - before) / (teacher - factor * mean) for factor in (1.0, 2.0)]
        assert any(((share >= 0.0) & (share < 1.0)).all() for share in shares)


def test_it_reaches_a_target_with_integers_and_choices() -> None:
    """Least, 0, at (0.7, 23, choice 2)."""
    space = Space([Axis(-2.0, 2.0), Axis(0.0, 40.0, "integer"), Axis(0.0, 3.0, "categorical")])
    for seed in range(5):
        optimizer = create_search(TlboSettings(), space, 2000, seed)
        least = math.inf
        while optimizer.evaluations < 2000:
            x, n, choice = space.designs(optimizer.ask()).T
            fitness = np.abs(x - 0.7) + np.abs(n - 23.0) / 10.0 + (choice != 2.0)
            least = min(least, float(fitness.min()))
            optimizer.tell(fitness)
        assert least < 1e-2
