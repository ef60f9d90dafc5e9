"""What every search method keeps to. A method of the registry is tested as soon as it is in it."""

from __future__ import annotations

import json
import math
import platform
import subprocess
import sys
from collections.abc import Iterable, Iterator
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from services.optimizer.search.optimizer import Optimizer
from services.optimizer.search.registry import METHODS, MethodName, create_search
from services.optimizer.search.space import Axis, Space

Floats = NDArray[np.float64]

SPACES = {
    "mixed": Space(
        [
            Axis(-1.0, 2.0),
            Axis(0.0, 10.0, "integer"),
            Axis(0.0, 2.0, "categorical"),
            Axis(1500.0, 6000.0),
        ]
    ),
    "one variable": Space([Axis(-3.0, 5.0)]),
    "integers only": Space([Axis(0.0, 3.0, "integer"), Axis(0.0, 1.0, "categorical")]),
}

PARTICLES = 6
BUDGET = 90
BUDGETS = {"mixed": BUDGET, "one variable": 60, "integers only": 30}
"""By space, evaluations: enough for local searches to begin anew, and for all of the 8 designs."""
RELOADED = {"bayesian": 36}
"""By method, evaluations until which it is loaded anew, where a load repeats what takes long."""
SEED = 3

INSTALLED = [name for name, method in METHODS.items() if not method.missing]
"""Methods whose libraries are here; with the development lock, all that this machine can have."""

WITHOUT_WHEEL = set() if platform.machine() == "x86_64" else {"mads"}

METHOD = pytest.mark.parametrize("method", INSTALLED)
SPACE = pytest.mark.parametrize("space", SPACES)


def search(
    method: MethodName, space: str = "mixed", *, seed: int = SEED, particles: int = PARTICLES
) -> Optimizer:
    settings = METHODS[method].settings.model_validate({"name": method, "particles": particles})
    return create_search(settings, SPACES[space], BUDGETS[space], seed)


def fitness_of(positions: Floats, space: str = "mixed") -> Floats:
    """A bowl in designs, of which a part cannot be judged."""
    box = SPACES[space]
    unit = box.to_unit(box.designs(positions))
    fitness = np.square(unit - 0.3).sum(axis=1) + 0.1
    fitness[np.sin(40.0 * unit.sum(axis=1)) > 0.95] = math.inf
    return fitness


def answer(method: MethodName, positions: Floats, space: str = "mixed") -> Floats:
    """What a method is told: fitness, or two bowls that are in each other's way."""
    fitness = fitness_of(positions, space)
    if not METHODS[method].multi_objective:
        return fitness
    box = SPACES[space]
    other = np.square(box.to_unit(box.designs(positions)) - 0.6).sum(axis=1)
    return np.column_stack([fitness, np.where(np.isfinite(fitness), other, math.inf)])


def alike(method: MethodName, values: Floats) -> Floats:
    """Given values, as a method is told them."""
    return np.column_stack([values] * 2) if METHODS[method].multi_objective else values


def path(
    optimizer: Optimizer,
    method: MethodName,
    space: str = "mixed",
    *,
    evaluations: int | None = None,
    most: int | None = None,
) -> Iterator[Floats]:
    """Every position that is asked for, one by one; of the whole budget by default."""
    evaluations = BUDGETS[space] if evaluations is None else evaluations
    while optimizer.evaluations < evaluations:
        left = evaluations - optimizer.evaluations
        positions = optimizer.ask(left if most is None else min(most, left))
        yield from positions
        optimizer.tell(answer(method, positions, space))


@cache
def whole_path(method: MethodName, space: str = "mixed", seed: int = SEED) -> Floats:
    """Of a search that nothing interrupts; walked once for all tests."""
    found = np.array(list(path(search(method, space, seed=seed), method, space)))
    found.flags.writeable = False
    return found


def bits(positions: Iterable[Floats]) -> list[bytes]:
    return [position.tobytes() for position in positions]


def through_json(optimizer: Optimizer) -> dict[str, object]:
    state: dict[str, object] = json.loads(json.dumps(optimizer.dump(), allow_nan=False))
    return state


def test_every_method_is_tested_where_its_libraries_can_be_had() -> None:
    assert set(METHODS) - set(INSTALLED) <= WITHOUT_WHEEL


@METHOD
@SPACE
def test_every_position_is_finite_and_inside_the_bounds(method: MethodName, space: str) -> None:
    box = SPACES[space]
    found = whole_path(method, space)
    assert found.shape == (BUDGETS[space], box.dimension)
    assert (found >= box.low).all() and (found <= box.high).all()


@METHOD
def test_a_budget_is_kept_to_the_last_evaluation(method: MethodName) -> None:
    optimizer = search(method)
    assert len(list(path(optimizer, method, evaluations=47))) == optimizer.evaluations == 47


@METHOD
def test_the_same_seed_gives_the_same_bits_and_another_one_others(method: MethodName) -> None:
    first = bits(whole_path(method))
    assert bits(path(search(method), method)) == first
    assert bits(whole_path(method, seed=SEED + 1)) != first


@METHOD
@SPACE
def test_a_dump_loaded_between_any_ask_and_tell_changes_no_bit(
    method: MethodName, space: str
) -> None:
    reloaded, found = search(method, space), list[bytes]()
    last = min(BUDGETS[space], RELOADED.get(method, BUDGET))
    while reloaded.evaluations < last:
        state = through_json(reloaded)
        # The first copy may go on with what the process has; the second one has the state alone.
        for copy in (search(method, space), search(method, space)):
            copy.load(state)
            reloaded = copy
            positions = copy.ask(BUDGETS[space] - copy.evaluations)
        state = through_json(reloaded)
        reloaded = search(method, space)
        reloaded.load(state)
        assert reloaded.ask().tobytes() == positions.tobytes()
        found += [position.tobytes() for position in positions]
        reloaded.tell(answer(method, positions, space))
    assert found == bits(whole_path(method, space))[: len(found)]


RESUME = """
import json, sys
from tests.optimizer.test_optimizer_contract import bits, path, search
for method, state in json.load(sys.stdin).items():
    optimizer = search(method)
    optimizer.load(state)
    print(json.dumps([method, *(row.hex() for row in bits(path(optimizer, method)))]))
"""


def test_another_process_goes_on_with_the_same_bits() -> None:
    given, expected = {}, list[list[str]]()
    for method in INSTALLED:
        stopped = search(method)
        done = list(path(stopped, method, evaluations=BUDGET // 2))
        given[method] = stopped.dump()
        expected.append([method, *(row.hex() for row in bits(whole_path(method)[len(done) :]))])
    printed = subprocess.run(
        [sys.executable, "-c", RESUME],
        input=json.dumps(given),
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert [json.loads(line) for line in printed.splitlines()] == expected


@METHOD
def test_the_path_does_not_depend_on_how_much_is_asked_at_once(method: MethodName) -> None:
    for most in (1, 4):
        assert bits(path(search(method), method, most=most)) == bits(whole_path(method))


@METHOD
def test_no_ask_gives_more_than_the_settings_or_the_caller_allow(method: MethodName) -> None:
    optimizer = search(method)
    for most in (None, 3, 100, 1) * 5:
        positions = optimizer.ask(most)
        assert 1 <= len(positions) <= min(PARTICLES, most or PARTICLES)
        optimizer.tell(answer(method, positions))


@METHOD
def test_asking_twice_gives_the_same_positions(method: MethodName) -> None:
    optimizer = search(method)
    first = optimizer.ask()
    first_bits = first.tobytes()
    first[:] = math.nan
    assert optimizer.ask(1).tobytes() == first_bits
    assert (optimizer.iteration, optimizer.evaluations) == (0, 0)


@METHOD
def test_tells_and_evaluations_are_counted(method: MethodName) -> None:
    optimizer, evaluations = search(method), 0
    for k in range(5):
        assert (optimizer.iteration, optimizer.evaluations) == (k, evaluations)
        positions = optimizer.ask()
        evaluations += len(positions)
        optimizer.tell(answer(method, positions))


@METHOD
def test_a_search_of_which_everything_fails_keeps_searching(method: MethodName) -> None:
    optimizer, seen = search(method), set()
    while optimizer.evaluations < BUDGET:
        positions = optimizer.ask()
        assert np.isfinite(positions).all()
        seen |= {row.tobytes() for row in positions}
        optimizer.tell(alike(method, np.full(len(positions), math.inf)))
    assert len(seen) > BUDGET // 2


@METHOD
@SPACE
def test_a_search_goes_on_when_all_is_equal(method: MethodName, space: str) -> None:
    optimizer = search(method, space)
    while optimizer.evaluations < BUDGETS[space]:
        optimizer.tell(alike(method, np.ones(len(optimizer.ask()))))


@METHOD
@pytest.mark.parametrize("worst", [np.nan, -np.inf])
def test_a_fitness_that_is_none_is_refused(method: MethodName, worst: float) -> None:
    optimizer = search(method)
    with pytest.raises(ValueError, match="before ask"):
        optimizer.tell(alike(method, np.zeros(PARTICLES)))
    asked = len(optimizer.ask())
    wrong = np.zeros(asked) if METHODS[method].multi_objective else np.zeros((asked, 1))
    for fitness in (
        alike(method, np.zeros(asked + 1)),
        wrong,
        alike(method, np.full(asked, worst)),
    ):
        with pytest.raises(ValueError, match="fitness"):
            optimizer.tell(fitness)
    assert optimizer.iteration == 0


@METHOD
def test_a_damaged_state_is_refused_by_name_and_leaves_the_state_before(method: MethodName) -> None:
    optimizer = search(method)
    optimizer.tell(answer(method, optimizer.ask()))
    before = through_json(optimizer)
    optimizer.ask()
    later = through_json(optimizer)
    optimizer.load(before)
    for field, value in (
        ("schema_version", 999),
        ("iteration", -1),
        ("asked", None),
        ("asked", 10**6),
        ("optimizer", "another"),
    ):
        with pytest.raises(ValueError, match=field):
            optimizer.load(later | {field: value})
    with pytest.raises(ValueError, match="iteration"):
        optimizer.load({name: value for name, value in later.items() if name != "iteration"})
    assert through_json(optimizer) == before


@pytest.mark.parametrize("method", [name for name in INSTALLED if name != "random"])
def test_a_search_is_better_than_random_search_on_a_bowl(method: MethodName) -> None:
    found = [best(method, seed) for seed in range(3 if method == "bayesian" else 7)]
    by_chance = [best("random", seed) for seed in range(7)]
    assert np.median(found) < np.median(by_chance)


def best(method: MethodName, seed: int) -> float:
    return float(min(fitness_of(whole_path(method, seed=seed))))
