"""Searches of bowls, as the contract of search methods walks them."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.search.optimizer import Optimizer
from gaitswarm.services.optimizer.search.registry import METHODS
from gaitswarm.services.optimizer.search.space import Axis, Space

Floats = NDArray[np.float64]

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
"""By space, evaluations: enough for local searches to begin anew, and for all of the 8 designs."""
SEED: Final = 3


def search(name: str, space: str = "mixed", *, seed: int = SEED) -> Optimizer:
    """A search before its first ask."""
    method = METHODS[name]
    settings = method.settings.model_validate({"name": name, "particles": PARTICLES})
    return method.create(settings, SPACES[space], BUDGETS[space], seed)


def fitness_of(positions: Floats, space: str = "mixed") -> Floats:
    """A bowl in designs, of which a part cannot be judged."""
    box = SPACES[space]
    unit = box.to_unit(box.designs(positions))
    fitness: Floats = np.square(unit - 0.3).sum(axis=1) + 0.1
    fitness[np.sin(40.0 * unit.sum(axis=1)) > 0.95] = math.inf
    return fitness


def answer(name: str, positions: Floats, space: str = "mixed") -> Floats:
    """What a method is told: fitness, or two bowls that are in each other's way."""
    fitness = fitness_of(positions, space)
    if not METHODS[name].multi_objective:
        return fitness
    box = SPACES[space]
    other = np.square(box.to_unit(box.designs(positions)) - 0.6).sum(axis=1)
    return np.column_stack([fitness, np.where(np.isfinite(fitness), other, math.inf)])


def alike(name: str, values: Floats) -> Floats:
    """Given values, as a method is told them."""
    return np.column_stack([values] * 2) if METHODS[name].multi_objective else values


def path(
    optimizer: Optimizer,
    name: str,
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
        optimizer.tell(answer(name, positions, space))


@cache
def whole_path(name: str, space: str = "mixed", seed: int = SEED) -> Floats:
    """Of a search that nothing interrupts; walked once for all tests."""
    found = np.array(list(path(search(name, space, seed=seed), name, space)))
    found.flags.writeable = False
    return found


def best(name: str, seed: int) -> float:
    """The least fitness that a search finds."""
    return float(min(fitness_of(whole_path(name, seed=seed))))


def bits(positions: Iterable[Floats]) -> list[bytes]:
    """Positions to the last bit."""
    return [position.tobytes() for position in positions]


def through_json(optimizer: Optimizer) -> dict[str, Any]:
    """Its state, as it comes back from a database."""
    state: dict[str, Any] = json.loads(json.dumps(optimizer.dump(), allow_nan=False))
    return state


def paths_of_another_process(states: Mapping[str, Mapping[str, Any]]) -> dict[str, list[bytes]]:
    """How a new process goes on from states, by method."""
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
