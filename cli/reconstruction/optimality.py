"""Optima must be optimal: how many random designs beat the published ones (thesis table 4.6)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, PreferenceName, judge
from gaitswarm.sim.calibration.walk import robot_variables, varied_robot
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.robot import RobotSource
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.simulate import simulate

Floats = NDArray[np.float64]

OPTIMA: Final[tuple[PreferenceName, ...]] = ("A", "B", "C")
"""Published optima of chapter 4, each of the preference of its name."""

_CONTROLLER: Final = "fuzzy-pi"

_CHUNK: Final = 64
"""Designs in a task: fills the lanes, and few enough for their tables to stay in the cache."""


class Optimality(BaseModel):
    """How good the published optima are among random designs of their bounds.

    Attributes:
        samples: number of random designs.
        failed: share of them that fails in a scenario [1].
        fitness: of each optimum by each preference, by preference and optimum; null if it fails.
        beaten: by preference, share of the random designs that beat its own optimum [1].
    """

    model_config = ConfigDict(frozen=True)

    samples: int
    failed: float
    fitness: dict[str, dict[str, float | None]]
    beaten: dict[str, float] = Field(default_factory=dict)

    def place(self, preference: str) -> int | None:
        """Place of an optimum among the three under its own preference."""
        row = self.fitness[preference]
        own = row[preference]
        if own is None:
            return None
        return 1 + sum(value is not None and value < own for value in row.values())


def random_designs(samples: int, seed: int) -> Floats:
    """Designs of chapter 4's controller, uniform in the bounds of table 4.4."""
    space = DesignSpace.build(
        required=CONTROLLERS[_CONTROLLER].variables, optional=(), chosen=None, fixed={}
    )
    box = space.box
    shares = np.random.Generator(np.random.Philox(key=seed)).random((samples, box.dimension))
    return space.designs(box.from_unit(shares))


def published_designs() -> Floats:
    """A, B and C."""
    controller = CONTROLLERS[_CONTROLLER]
    rows = [[controller.published[o][v.name] for v in controller.variables] for o in OPTIMA]
    return np.array(rows)


def walk_all(
    choice: Mapping[str, float],
    designs: Floats,
    *,
    robots: Sequence[RobotSource],
    workers: Executor,
) -> tuple[Floats, NDArray[np.bool_]]:
    """Let designs walk through the six scenarios of table 4.2 under a choice of conventions."""
    of_robot = {variable.name for variable in robot_variables(robots)}
    values = {name: value for name, value in choice.items() if name in of_robot}
    planner, robot = varied_robot(robots, values)
    names = [variable.name for variable in CONTROLLERS[_CONTROLLER].variables]
    rest = {name: value for name, value in choice.items() if name not in of_robot}
    columns = (*names, *rest)
    held = np.tile(list(rest.values()), (len(designs), 1))
    whole = np.concatenate([designs, held], axis=1)

    def walk(start: int) -> tuple[list[Floats], list[NDArray[np.bool_]]]:
        rows = whole[start : start + _CHUNK]
        outcomes = [
            simulate(s, _CONTROLLER, columns, rows, robot=robot, planner=planner).outcome
            for s in SCENARIOS
        ]
        return [o.objectives for o in outcomes], [o.statuses != 0 for o in outcomes]

    pieces = list(workers.map(walk, range(0, len(whole), _CHUNK)))
    objectives = np.concatenate([np.stack(walked, axis=1) for walked, _ in pieces])
    failed = np.concatenate([np.stack(bad, axis=1) for _, bad in pieces])
    return objectives, failed


def optimality(objectives: Floats, failed: NDArray[np.bool_]) -> Optimality:
    """Judge the optima among random designs."""
    fitness, beaten = {}, {}
    for index, name in enumerate(OPTIMA):
        found = judge(objectives, failed, PREFERENCES[name]).fitness
        own, others = found[: len(OPTIMA)], found[len(OPTIMA) :]
        fitness[name] = {
            optimum: float(value) if np.isfinite(value) else None
            for optimum, value in zip(OPTIMA, own, strict=True)
        }
        beaten[name] = float((others < own[index]).mean())
    return Optimality(
        samples=len(failed) - len(OPTIMA),
        failed=float(failed[len(OPTIMA) :].any(axis=1).mean()),
        fitness=fitness,
        beaten=beaten,
    )
