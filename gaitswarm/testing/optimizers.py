"""Contract tests of search methods."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar, Final
from unittest import TestCase

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.optimizer import Optimizer
from gaitswarm.services.optimizer.search.registry import METHODS
from gaitswarm.services.optimizer.search.space import Axis, Space

Floats = NDArray[np.float64]

refused = TestCase().assertRaisesRegex

SPACES: Final[Mapping[str, Space]] = MappingProxyType(
    {
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
)

PARTICLES: Final = 6
BUDGET: Final = 90
BUDGETS: Final = MappingProxyType({"mixed": BUDGET, "one variable": 60, "integers only": 20})
"""Evaluations by space: enough for local searches to restart, and for all of the 8 designs."""
SEED: Final = 3


def search(name: str, space: str = "mixed", *, seed: int = SEED) -> Optimizer:
    """A search before its first ask."""
    method = METHODS[name]
    settings = method.settings.model_validate({"name": name, "particles": PARTICLES})
    return method.create(settings, SPACES[space], BUDGETS[space], seed)


def fitness_of(positions: Floats, space: str = "mixed") -> Floats:
    """A quadratic bowl with a region that fails."""
    box = SPACES[space]
    unit = box.to_unit(box.designs(positions))
    fitness: Floats = np.square(unit - 0.3).sum(axis=1) + 0.1
    fitness[np.sin(40.0 * unit.sum(axis=1)) > 0.95] = math.inf
    return fitness


def answer(name: str, positions: Floats, space: str = "mixed") -> Floats:
    """Results for a method: fitness, or two conflicting objectives."""
    fitness = fitness_of(positions, space)
    if not METHODS[name].multi_objective:
        return fitness
    box = SPACES[space]
    other = np.square(box.to_unit(box.designs(positions)) - 0.6).sum(axis=1)
    return np.column_stack([fitness, np.where(np.isfinite(fitness), other, math.inf)])


def alike(name: str, values: Floats) -> Floats:
    """Results of the given values for a method."""
    return np.column_stack([values] * 2) if METHODS[name].multi_objective else values


def path(
    optimizer: Optimizer,
    name: str,
    space: str = "mixed",
    *,
    evaluations: int | None = None,
    most: int | None = None,
) -> Iterator[Floats]:
    """All positions that a search asks for, one by one; of the whole budget by default."""
    evaluations = BUDGETS[space] if evaluations is None else evaluations
    while optimizer.evaluations < evaluations:
        left = evaluations - optimizer.evaluations
        positions = optimizer.ask(left if most is None else min(most, left))
        yield from positions
        optimizer.tell(answer(name, positions, space))


@cache
def whole_path(name: str, space: str = "mixed", seed: int = SEED) -> Floats:
    """The path of an uninterrupted search, computed once for all tests."""
    found = np.array(list(path(search(name, space, seed=seed), name, space)))
    found.flags.writeable = False
    return found


def best(name: str, seed: int) -> float:
    """Return the least fitness that a search finds."""
    return float(min(fitness_of(whole_path(name, seed=seed))))


def bits(positions: Iterable[Floats]) -> list[bytes]:
    """Positions as bytes."""
    return [position.tobytes() for position in positions]


def through_json(optimizer: Optimizer) -> dict[str, Any]:
    """State after a round trip through JSON."""
    state: dict[str, Any] = json.loads(json.dumps(optimizer.dump(), allow_nan=False))
    return state


def paths_of_another_process(states: Mapping[str, Mapping[str, Any]]) -> dict[str, list[bytes]]:
    """Paths of a new process continued from states, by method."""
    done = subprocess.run(
        [sys.executable, "-m", __name__],
        input=json.dumps(states),
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    found = json.loads(done.stdout)
    return {name: [bytes.fromhex(row) for row in rows] for name, rows in found.items()}


def _go_on() -> None:
    found = {}
    for name, state in json.load(sys.stdin).items():
        optimizer = search(name)
        optimizer.load(state)
        found[name] = [row.hex() for row in bits(path(optimizer, name))]
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    _go_on()


class SearchContract:
    """Tests of a registered search method, within one process.

    Attributes:
        name: Of the method.
        reloaded: Evaluations up to which it is reloaded, where loading repeats slow work.
        seeds: Searches to compare with random search.
        better_than_random: Whether its median search of a bowl is.
    """

    name: str
    reloaded: int = BUDGET
    seeds: int = 7
    better_than_random: bool = True

    spaces: ClassVar = SPACES

    def test_every_position_is_finite_and_inside_the_bounds(self) -> None:
        for space, box in self.spaces.items():
            found = whole_path(self.name, space)
            assert found.shape == (BUDGETS[space], box.dimension)
            assert (found >= box.low).all() and (found <= box.high).all()

    def test_a_budget_is_kept_to_the_last_evaluation(self) -> None:
        optimizer = search(self.name)
        assert len(list(path(optimizer, self.name, evaluations=47))) == optimizer.evaluations == 47

    def test_the_same_seed_gives_the_same_bits_and_another_one_others(self) -> None:
        first = bits(whole_path(self.name))
        assert bits(path(search(self.name), self.name)) == first
        assert bits(whole_path(self.name, seed=SEED - 1)) != first

    def test_a_dump_loaded_between_any_ask_and_tell_changes_no_bit(self) -> None:
        for space in self.spaces:
            reloaded, found = search(self.name, space), list[bytes]()
            while reloaded.evaluations < min(BUDGETS[space], self.reloaded):
                state = through_json(reloaded)
                # The first copy may share the process's caches; the second cannot.
                for _ in range(2):
                    reloaded = search(self.name, space)
                    reloaded.load(state)
                    reloaded.ask(BUDGETS[space] - reloaded.evaluations)
                positions = reloaded.ask()
                state = through_json(reloaded)
                reloaded = search(self.name, space)
                reloaded.load(state)
                assert reloaded.ask().tobytes() == positions.tobytes()
                found += [position.tobytes() for position in positions]
                reloaded.tell(answer(self.name, positions, space))
            assert found == bits(whole_path(self.name, space))[: len(found)]

    def test_the_path_does_not_depend_on_how_much_is_asked_at_once(self) -> None:
        for most in (1, 4):
            found = bits(path(search(self.name), self.name, most=most))
            assert found == bits(whole_path(self.name))

    def test_no_ask_gives_more_than_the_settings_or_the_caller_allow(self) -> None:
        optimizer = search(self.name)
        for most in (None, 3, 100, 1) * 5:
            positions = optimizer.ask(most)
            assert 1 <= len(positions) <= min(PARTICLES, most or PARTICLES)
            optimizer.tell(answer(self.name, positions))

    def test_start_positions_are_asked_for_first_and_survive_a_load(self) -> None:
        box = self.spaces["mixed"]
        start = box.from_unit(np.linspace(0.2, 0.7, 3)[:, np.newaxis] * np.ones(box.dimension))

        def started() -> Optimizer:
            optimizer = search(self.name)
            optimizer.start_from(start)
            return optimizer

        whole = bits(path(started(), self.name, evaluations=30))
        assert whole[: len(start)] == bits(start)
        optimizer, found = started(), list[bytes]()
        while optimizer.evaluations < 30:
            positions = optimizer.ask(30 - optimizer.evaluations)
            found += bits(positions)
            optimizer.tell(answer(self.name, positions))
            state = through_json(optimizer)
            optimizer = started()
            optimizer.load(state)
        assert found == whole
        refused(ValueError, "start", search(self.name).start_from, start + 1e6)

    def test_asking_twice_gives_the_same_positions(self) -> None:
        optimizer = search(self.name)
        first = optimizer.ask()
        first_bits = first.tobytes()
        first[:] = math.nan
        assert optimizer.ask(1).tobytes() == first_bits
        assert (optimizer.iteration, optimizer.evaluations) == (0, 0)

    def test_tells_and_evaluations_are_counted(self) -> None:
        optimizer, evaluations = search(self.name), 0
        for k in range(5):
            assert (optimizer.iteration, optimizer.evaluations) == (k, evaluations)
            positions = optimizer.ask()
            evaluations += len(positions)
            optimizer.tell(answer(self.name, positions))

    def test_a_search_of_which_everything_fails_keeps_searching(self) -> None:
        optimizer, seen = search(self.name), set()
        while optimizer.evaluations < BUDGET:
            positions = optimizer.ask()
            assert np.isfinite(positions).all()
            seen |= {row.tobytes() for row in positions}
            optimizer.tell(alike(self.name, np.full(len(positions), math.inf)))
        assert len(seen) > BUDGET // 2

    def test_a_search_goes_on_when_all_is_equal(self) -> None:
        for space in self.spaces:
            optimizer = search(self.name, space)
            while optimizer.evaluations < BUDGETS[space]:
                optimizer.tell(alike(self.name, np.ones(len(optimizer.ask()))))

    def test_a_fitness_that_is_none_is_refused(self) -> None:
        optimizer = search(self.name)
        feedback = alike(self.name, np.zeros(PARTICLES))
        refused(ValueError, "before ask", optimizer.tell, feedback)
        asked = len(optimizer.ask())
        one, two = np.zeros(asked), np.zeros((asked, 1))
        wrong = one if alike(self.name, one).ndim == 2 else two
        for fitness in (
            alike(self.name, np.zeros(asked + 1)),
            wrong,
            alike(self.name, np.full(asked, math.nan)),
            alike(self.name, np.full(asked, -math.inf)),
        ):
            refused(ValueError, "fitness", optimizer.tell, fitness)
        assert optimizer.iteration == 0

    def test_a_damaged_state_is_refused_by_name_and_leaves_the_state_before(self) -> None:
        optimizer = search(self.name)
        optimizer.tell(answer(self.name, optimizer.ask()))
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
            refused(ValueError, field, optimizer.load, later | {field: value})
        without = {name: value for name, value in later.items() if name != "iteration"}
        refused(ValueError, "iteration", optimizer.load, without)
        assert through_json(optimizer) == before

    def test_a_search_is_better_than_random_search_on_a_bowl(self) -> None:
        if self.better_than_random:
            found = [best(self.name, seed) for seed in range(self.seeds)]
            by_chance = [best("random", seed) for seed in range(7)]
            assert np.median(found) < np.median(by_chance)


class OptimizerContract(SearchContract):
    """Tests of a registered search method; attributes are those of `SearchContract`."""

    def test_another_process_goes_on_with_the_same_bits(self) -> None:
        stopped = search(self.name)
        done = len(list(path(stopped, self.name, evaluations=BUDGET // 2)))
        found = paths_of_another_process({self.name: stopped.dump()})
        assert found[self.name] == bits(whole_path(self.name)[done:])
