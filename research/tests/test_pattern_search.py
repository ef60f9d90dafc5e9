"""Pattern search: what it polls, how its mesh grows and shrinks, where it restarts."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.plugins import Axis, Optimizer, Space, create_search
from gaitswarm_research.methods.pattern_search import PatternSearchSettings

Floats = NDArray[np.float64]
Function = Callable[[Floats], Floats]

PLANE = Space.continuous([-1.0, 0.0], [1.0, 10.0])
MIXED = Space(
    [
        Axis(-2.0, 2.0),
        Axis(0.0, 40.0, "integer"),
        Axis(0.0, 3.0, "categorical"),
        Axis(100.0, 900.0),
    ]
)


def search(space: Space, *, seed: int = 1, **given: object) -> Optimizer:
    settings = PatternSearchSettings.model_validate({"particles": 100} | given)
    return create_search(settings, space, 1000, seed)


def proposals(optimizer: Optimizer, space: Space, function: Function, count: int) -> list[Floats]:
    """The designs of so many batches; a batch is a start or a poll."""
    found = []
    for _ in range(count):
        designs = space.designs(optimizer.ask())
        optimizer.tell(function(designs))
        found.append(designs)
    return found


def mixed_bowl(designs: Floats) -> Floats:
    """Least, 0, at (0.7, 23, choice 2, 321)."""
    x, n, choice, y = designs.T
    badness: Floats = np.abs(x - 0.7) + np.abs(n - 23.0) / 10.0
    badness += np.abs(y - 321.0) / 200.0 + np.where(choice == 2.0, 0.0, 1.0)
    return badness


def sizes(start: Floats, poll: Floats, space: Space) -> Floats:
    """(n,) length of each step, as a share of its variable's range."""
    steps: Floats = np.max(np.abs(space.to_unit(poll) - space.to_unit(start)), axis=1)
    return steps


def test_a_poll_is_one_step_forth_and_back_in_every_variable_in_one_batch() -> None:
    optimizer = search(PLANE, initial_mesh=0.0625)
    start, poll = proposals(optimizer, PLANE, lambda x: np.arange(1.0 * len(x)), 2)
    assert start.shape == (1, 2)
    steps = sorted(np.round((poll - start[0]) / PLANE.span, 9).tolist())
    assert steps == [[-0.0625, 0.0], [0.0, -0.0625], [0.0, 0.0625], [0.0625, 0.0]]


def test_the_order_of_a_poll_is_drawn() -> None:
    orders = set()
    for seed in range(20):
        start, poll = proposals(
            search(PLANE, seed=seed, initial_mesh=0.01), PLANE, lambda x: np.ones(len(x)), 2
        )
        orders.add(tuple(np.sign(np.round(poll - start[0], 9)).ravel().tolist()))
    assert len(orders) > 5


def test_the_mesh_doubles_after_a_success_and_halves_after_a_failure() -> None:
    values = iter([10.0, 9.0, 8.0, 8.0, 8.0])

    def feedback(designs: Floats) -> Floats:
        """A poll is worth the next value at its first design, and worse elsewhere."""
        return np.array([next(values)] + [11.0] * (len(designs) - 1))

    optimizer = search(PLANE, initial_mesh=2.0**-6)
    start, first, second, third, fourth = proposals(optimizer, PLANE, feedback, 5)
    centres = start[0], first[0], second[0], second[0]
    meshes = [
        sizes(centre, poll, PLANE).max()
        for centre, poll in zip(centres, (first, second, third, fourth), strict=True)
    ]
    assert meshes == pytest.approx([2.0**-6, 2.0**-5, 2.0**-4, 2.0**-5])


def test_a_step_beyond_a_bound_ends_at_it() -> None:
    optimizer = search(PLANE, initial_mesh=1.0)
    _, poll = proposals(optimizer, PLANE, lambda x: np.ones(len(x)), 2)
    assert set(poll[:, 0]) >= {-1.0, 1.0} and set(poll[:, 1]) >= {0.0, 10.0}


def test_integers_go_by_whole_numbers_and_at_least_by_one() -> None:
    steps = set()
    optimizer = search(MIXED)
    batches = proposals(optimizer, MIXED, mixed_bowl, 40)
    best, least = batches[0][0], mixed_bowl(batches[0])[0]
    for batch in batches[1:]:
        if len(batch) == 1:
            break
        assert (batch[:, 1] == np.rint(batch[:, 1])).all()
        steps |= set(np.abs(batch[:, 1] - best[1]).tolist()) - {0.0}
        values = mixed_bowl(batch)
        if values.min() < least:
            best, least = batch[np.argmin(values)], values.min()
    assert min(steps) == 1.0 and max(steps) >= 10.0


def test_a_choice_is_polled_by_all_others() -> None:
    optimizer = search(MIXED)
    start, poll = proposals(optimizer, MIXED, lambda x: np.ones(len(x)), 2)
    others = poll[(poll[:, [0, 1, 3]] == start[0, [0, 1, 3]]).all(axis=1), 2]
    assert sorted([*others, start[0, 2]]) == [0.0, 1.0, 2.0, 3.0]


def test_no_design_is_asked_for_twice() -> None:
    designs = np.concatenate(proposals(search(MIXED), MIXED, mixed_bowl, 100))
    assert len(designs) > 400
    unit = np.round(MIXED.to_unit(designs), 11)
    assert len(np.unique(unit, axis=0)) == len(unit)


def test_when_the_mesh_is_fine_it_begins_again_elsewhere() -> None:
    """From 0.25 down to 0.01 there are five sizes; without a success that is five polls."""
    optimizer = search(PLANE, mesh_tolerance=0.01)
    batches = proposals(optimizer, PLANE, lambda x: np.ones(len(x)), 12)
    starts = [k for k, batch in enumerate(batches) if len(batch) == 1]
    assert starts == [0, 6]
    assert (batches[0] != batches[6]).all()
    meshes = [sizes(batches[6], poll, PLANE).max() for poll in batches[7:]]
    assert meshes == pytest.approx([2.0**-k for k in range(2, 7)])


def test_it_does_not_end_before_the_neighbours_in_the_integers_are_polled() -> None:
    """A tolerance that is coarse for continuous variables does not make integers coarse."""
    space = Space([Axis(0.0, 1.0), Axis(0.0, 10_000.0, "integer")])
    optimizer = search(space, mesh_tolerance=0.1)
    found = proposals(optimizer, space, lambda x: np.abs(x[:, 1] - 4321.0), 40)
    assert {4320.0, 4321.0, 4322.0} <= set(np.concatenate(found)[:, 1])


def test_an_opportunistic_poll_ends_with_the_first_success() -> None:
    optimizer = search(PLANE, polling="opportunistic", poll_batch=1, initial_mesh=2.0**-6)
    worth = iter([5.0, 6.0, 4.0, 7.0])
    start, worse, better, after = proposals(optimizer, PLANE, lambda _: np.array([next(worth)]), 4)
    assert sizes(start, worse, PLANE) == pytest.approx([2.0**-6])
    assert sizes(start, better, PLANE) == pytest.approx([2.0**-6])
    assert sizes(better, after, PLANE) == pytest.approx([2.0**-5])


def test_a_job_that_starts_from_designs_is_polled_around_their_best() -> None:
    optimizer = search(PLANE, initial_mesh=2.0**-6)
    given = np.array([[0.5, 1.0], [0.25, 2.0], [-0.5, 3.0]])
    optimizer.start_from(given)
    worth = iter([np.array([2.0, 1.0, math.inf]), np.ones(4)])
    start, poll = proposals(optimizer, PLANE, lambda _: next(worth), 2)
    assert start.tolist() == given.tolist()
    assert sizes(given[1], poll, PLANE) == pytest.approx([2.0**-6] * 4)


def test_a_start_that_fails_is_left_at_once() -> None:
    optimizer = search(PLANE)
    worth = iter([math.inf, math.inf, 1.0])
    found = proposals(optimizer, PLANE, lambda x: np.full(len(x), next(worth)), 3)
    assert [len(batch) for batch in found] == [1, 1, 1]
    assert len(optimizer.ask()) > 1


@pytest.mark.parametrize("polling", ["complete", "opportunistic"])
def test_it_reaches_a_target_with_integers_and_choices(polling: str) -> None:
    for seed in range(5):
        optimizer = search(MIXED, seed=seed, polling=polling)
        best = math.inf
        while optimizer.evaluations < 300:
            fitness = mixed_bowl(MIXED.designs(optimizer.ask()))
            best = min(best, float(fitness.min()))
            optimizer.tell(fitness)
        assert best < 1e-3
