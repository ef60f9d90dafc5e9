"""Searches that begin with positions that are known to be good, whatever their method."""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.hype import Hype
from gaitswarm.services.optimizer.search.optimizer import Optimizer, Proposals, Replayed, Start
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.registry import (
    METHODS,
    RandomSearchSettings,
    create_search,
)
from gaitswarm.services.optimizer.search.space import Axis, Space

Floats = NDArray[np.float64]

SPACE = Space([Axis(-1.0, 2.0), Axis(0.0, 10.0, "integer"), Axis(0.0, 2.0, "categorical")])
PARTICLES, BUDGET, SEED = 4, 40, 5
FEW = 16
"""Evaluations that show whether two searches ask for the same."""

GOOD = np.array([[0.2, 3.0, 1.0], [0.1, 3.0, 1.0]])
MANY = SPACE.from_unit(np.linspace(0.05, 0.95, 6)[:, np.newaxis] * np.ones(3))

METHOD = pytest.mark.parametrize("method", list(METHODS.built_in))
STARTS = pytest.mark.parametrize("start", [GOOD, MANY], ids=["few", "more than an iteration"])


def search(method: str, start: Floats | None, *, budget: int = BUDGET) -> Optimizer:
    settings = METHODS[method].settings.model_validate({"name": method, "particles": PARTICLES})
    return create_search(settings, SPACE, budget, SEED, start)


def fitness_of(positions: Floats) -> Floats:
    """A bowl in designs; of `MANY` a middle one is the best, and the first fails."""
    unit = SPACE.to_unit(SPACE.designs(positions))
    fitness: Floats = np.square(unit - 0.4).sum(axis=1) + 0.1
    fitness[unit[:, 0] < 0.06] = np.inf
    return fitness


def answer(optimizer: Optimizer, positions: Floats) -> Floats:
    """Feedback of a method: fitness, or two conflicting bowls."""
    fitness = fitness_of(positions)
    if not isinstance(optimizer, Hype):
        return fitness
    other = np.square(SPACE.to_unit(SPACE.designs(positions)) - 0.6).sum(axis=1)
    return np.column_stack([fitness, np.where(np.isfinite(fitness), other, np.inf)])


def path(optimizer: Optimizer, *, evaluations: int = BUDGET) -> Iterator[Floats]:
    while optimizer.evaluations < evaluations:
        positions = optimizer.ask(evaluations - optimizer.evaluations)
        yield from positions
        optimizer.tell(answer(optimizer, positions))


def bits(positions: Iterator[Floats]) -> list[bytes]:
    return [position.tobytes() for position in positions]


@METHOD
@STARTS
def test_the_start_is_asked_for_first_and_counts_as_budget(method: str, start: Floats) -> None:
    optimizer = search(method, start, budget=FEW)
    found = bits(path(optimizer, evaluations=FEW))
    assert found[: len(start)] == [row.tobytes() for row in start]
    assert len(found) == optimizer.evaluations == FEW


@pytest.mark.variants(without="*-bayesian")
@METHOD
@STARTS
def test_a_started_search_resumes_to_the_bit_after_every_tell(method: str, start: Floats) -> None:
    # Every load repeats all models of before, which takes seconds.
    last = 20 if method == "bayesian" else BUDGET
    straight = bits(path(search(method, start), evaluations=last))
    optimizer, found = search(method, start), list[bytes]()
    while optimizer.evaluations < last:
        positions = optimizer.ask(last - optimizer.evaluations)
        state = json.loads(json.dumps(optimizer.dump(), allow_nan=False))
        optimizer = search(method, start)
        optimizer.load(state)
        optimizer.tell(answer(optimizer, positions))
        state = json.loads(json.dumps(optimizer.dump(), allow_nan=False))
        # The first copy may go on with what the process has; the second one has the state alone.
        for _ in range(2):
            optimizer = search(method, start)
            optimizer.load(state)
            optimizer.ask(max(1, last - optimizer.evaluations))
        optimizer = search(method, start)
        optimizer.load(state)
        found += [position.tobytes() for position in positions]
    assert found == straight


@pytest.mark.variants(without="bayesian")
@METHOD
def test_a_method_learns_from_the_start_if_it_says_so(method: str) -> None:
    started = bits(path(search(method, GOOD), evaluations=FEW))[len(GOOD) :]
    left = BUDGET - len(GOOD)
    cold = bits(path(search(method, None, budget=left), evaluations=FEW - len(GOOD)))
    assert (started != cold) == METHODS[method].uses_start


@METHOD
def test_a_start_outside_the_bounds_or_too_late_is_refused(method: str) -> None:
    with pytest.raises(ValueError, match="outside the bounds"):
        search(method, GOOD + 10.0)
    with pytest.raises(ValueError, match="shape"):
        search(method, GOOD[:, :2])
    optimizer = search(method, None)
    optimizer.ask()
    with pytest.raises(ValueError, match="already begun"):
        optimizer.start_from(GOOD)


@pytest.mark.variants(without="bayesian")
@METHOD
def test_without_a_start_the_search_is_unchanged(method: str) -> None:
    none = np.empty((0, SPACE.dimension))
    without, unchanged = (
        bits(path(search(method, start), evaluations=FEW)) for start in (none, None)
    )
    assert without == unchanged


def test_a_swarm_keeps_the_best_of_a_start_that_is_larger_than_it() -> None:
    swarm = create_search(PsoSettings(particles=2), SPACE, BUDGET, SEED, MANY)
    list(path(swarm, evaluations=len(MANY)))
    best = np.sort(np.argsort(fitness_of(MANY), kind="stable")[:2])
    assert swarm.dump()["best_positions"] == MANY[best].tolist()


def test_the_other_members_of_a_swarm_are_those_of_one_without_a_start() -> None:
    cold, started = search("pso", None).ask(), search("pso", GOOD).ask()
    assert started[len(GOOD) :].tobytes() == cold[len(GOOD) :].tobytes()


def test_a_generator_receives_the_start_and_the_remaining_budget() -> None:
    seen: list[tuple[int, Start | None]] = []

    def near_the_best(
        settings: RandomSearchSettings,
        space: Space,
        budget: int,
        random: RandomNumbers,
        *,
        start: Start | None = None,
    ) -> Proposals:
        seen.append((budget, start))
        while True:
            yield space.from_unit(random.uniform(settings.particles, space.dimension))

    optimizer = Replayed(near_the_best, RandomSearchSettings(), SPACE, BUDGET, SEED)
    optimizer.start_from(MANY)
    list(path(optimizer))
    ((budget, start),) = seen
    assert budget == BUDGET - len(MANY)
    assert start is not None
    positions, fitness = start.best_first
    assert fitness.tolist() == sorted(fitness_of(MANY).tolist())[:-1]
    assert positions.tolist() == MANY[np.argsort(fitness_of(MANY))[:-1]].tolist()
