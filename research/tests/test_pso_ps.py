"""The hybrid of a swarm and pattern search: who has which share, and where polls begin."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.plugins import Axis, ParticleSwarm, RandomNumbers, Space, Start, create_search
from gaitswarm_research.methods.pso_ps import PsoPsSettings, best_members, pso_ps

Floats = NDArray[np.float64]

BOX = Space.continuous([-1.0, 0.0, 10.0], [1.0, 4.0, 30.0])
MIXED = Space([Axis(-2.0, 2.0), Axis(0.0, 40.0, "integer"), Axis(0.0, 3.0, "categorical")])
BUDGET = 100
STREAM = 99


def settings_of(**given: object) -> PsoPsSettings:
    return PsoPsSettings.model_validate({"particles": 10} | given)


def bowl(positions: Floats) -> Floats:
    fitness: Floats = np.square(BOX.to_unit(positions) - 0.3).sum(axis=1)
    return fitness


def batches(settings: PsoPsSettings, count: int) -> list[Floats]:
    """What the method proposes on a bowl, batch by batch."""
    proposals = pso_ps(settings, BOX, BUDGET, RandomNumbers(1, STREAM))
    found = [next(proposals)]
    while len(found) < count:
        found.append(proposals.send(bowl(found[-1])))
    return found


def test_it_begins_with_the_motion_of_a_swarm_over_its_share_of_the_budget() -> None:
    settings = settings_of(swarm_share=0.4)
    seed = RandomNumbers(1, STREAM).seed()
    swarm = ParticleSwarm(settings, BOX, 40, seed)
    *iterations, poll = batches(settings, 5)
    for positions in iterations:
        assert positions.tobytes() == swarm.ask().tobytes()
        swarm.tell(bowl(positions))
    assert len(poll) == 2 * BOX.dimension


def test_then_it_polls_around_the_best_design_of_the_swarm() -> None:
    *swarm, poll, _ = batches(settings_of(initial_mesh=0.03125), 7)
    seen = np.concatenate(swarm)
    best = seen[np.argmin(bowl(seen))]
    steps = np.abs(BOX.to_unit(poll) - BOX.to_unit(best[np.newaxis]))
    np.testing.assert_allclose(steps.max(axis=1), 0.03125)
    assert (np.sum(steps > 1e-12, axis=1) == 1).all()


def test_polls_of_several_searches_fill_a_batch() -> None:
    settings = settings_of(searches=3)
    *swarm, polls = batches(settings, 6)
    bests, _ = best_members(swarm_after(settings, swarm), 3)
    assert len(polls) == 3 * 2 * BOX.dimension
    for k, poll in enumerate(np.split(polls, 3)):
        steps = np.abs(BOX.to_unit(poll) - BOX.to_unit(bests[k : k + 1]))
        np.testing.assert_allclose(steps.max(axis=1), settings.initial_mesh)


def swarm_after(settings: PsoPsSettings, iterations: list[Floats]) -> ParticleSwarm:
    """The swarm after iterations on a bowl."""
    swarm = ParticleSwarm(settings, BOX, 50, RandomNumbers(1, STREAM).seed())
    for positions in iterations:
        swarm.ask()
        swarm.tell(bowl(positions))
    return swarm


@pytest.mark.parametrize("count", [3, 12])
def test_what_was_evaluated_before_are_members_of_the_first_swarm(count: int) -> None:
    """They are not asked for again; of more than the swarm has, the best are its members."""
    settings, drawn = settings_of(), RandomNumbers(7, 1)
    given = BOX.from_unit(drawn.uniform(count, BOX.dimension))
    start = Start(given, bowl(given))
    swarm = ParticleSwarm(settings, BOX, 50, RandomNumbers(1, STREAM).seed())
    swarm.start_from(given)
    for size in (count, 10 - count) if count < 10 else (10, 2):
        swarm.tell(bowl(swarm.ask(size)))
    proposals = pso_ps(settings, BOX, BUDGET, RandomNumbers(1, STREAM), start)
    first = next(proposals)
    if count < 10:
        assert len(first) == 10 - count
        first = proposals.send(bowl(first))
    assert first.tobytes() == swarm.ask().tobytes()


def test_best_members_are_each_particles_best_without_failures_and_equal_designs() -> None:
    space = Space([Axis(0.0, 1.0, "integer")])
    swarm = ParticleSwarm(settings_of(particles=4), space, 40, 1)
    first = swarm.ask()
    swarm.tell(np.array([3.0, math.inf, 1.0, 2.0]))
    swarm.ask()
    swarm.tell(np.array([9.0, math.inf, 9.0, 9.0]))
    by_fitness = space.designs(first[[2, 3, 0]])
    expected = list(dict.fromkeys(by_fitness[:, 0].tolist()))
    designs, fitness = best_members(swarm, 4)
    assert designs[:, 0].tolist() == expected
    assert np.isfinite(fitness).all() and (np.diff(fitness) > 0).all()
    assert len(best_members(swarm, 1)[0]) == 1


def test_when_no_poll_is_left_another_swarm_begins() -> None:
    """Polls are six designs, or fewer where a step ends at a bound; the swarm has ten."""
    found = [len(batch) for batch in batches(settings_of(mesh_tolerance=0.05), 40)]
    assert found[:5] == [10] * 5 and found[5] < 10
    begun = [k for k, (before, now) in enumerate(pairwise(found), 1) if before < 10 == now]
    assert begun and found[begun[0] : begun[0] + 5] == [10] * 5


def test_a_swarm_of_which_everything_failed_is_followed_by_another_one() -> None:
    proposals = pso_ps(settings_of(), BOX, BUDGET, RandomNumbers(1, STREAM))
    found = [next(proposals)]
    while len(found) < 11:
        found.append(proposals.send(np.full(10, math.inf)))
    assert [len(batch) for batch in found] == [10] * 11
    assert not np.isin(found[0], found[5]).any()


@pytest.mark.parametrize("polling", ["complete", "opportunistic"])
def test_it_comes_closer_with_integers_and_choices_than_its_swarm_alone(polling: str) -> None:
    """Least, 0, at (0.7, 23, choice 2)."""

    def best(share: float, seed: int) -> float:
        settings = settings_of(swarm_share=share, polling=polling, searches=2)
        optimizer = create_search(settings, MIXED, 400, seed)
        least = math.inf
        while optimizer.evaluations < 400:
            x, n, choice = MIXED.designs(optimizer.ask()).T
            fitness = np.abs(x - 0.7) + np.abs(n - 23.0) / 10.0 + (choice != 2.0)
            least = min(least, float(fitness.min()))
            optimizer.tell(fitness)
        return least

    hybrid = [best(0.5, seed) for seed in range(5)]
    alone = [best(0.99, seed) for seed in range(5)]
    assert max(hybrid) < 1e-3
    assert np.median(hybrid) < np.median(alone)
