"""Optimality of the published optima: how many random designs beat them (thesis table 4.6)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from gaitswarm import CONTROLLERS, SCENARIOS, JobSpec
from gaitswarm.plugins import Robot, load_robot, simulate_walk, with_parameters

Floats = NDArray[np.float64]

OPTIMA: Final = ("A", "B", "C")
"""Published optima of chapter 4, each of the preference of its name."""

_CONTROLLER: Final = "fuzzy-pi"

_OF_ROBOT: Final = ("planned_soles", "contact_law", "energy", "current_filter")
"""Conventions of the robot; all others are of the controller and the gait."""

_CHUNK: Final = 64
"""Designs per task: they fill the lanes, and their tables stay in the cache."""


class Optimality(BaseModel):
    """Ranks of the published optima among random designs of their bounds.

    Attributes:
        samples: Number of random designs.
        failed: Share of them that fails in a scenario [1].
        fitness: Fitness by preference and optimum; null if the optimum fails.
        beaten: Share of the random designs that beat the preference's own optimum [1].
    """

    model_config = ConfigDict(frozen=True)

    samples: int
    failed: float
    fitness: dict[str, dict[str, float | None]]
    beaten: dict[str, float] = Field(default_factory=dict)

    def place(self, preference: str) -> int | None:
        """Rank of an optimum among the three under its own preference."""
        row = self.fitness[preference]
        own = row[preference]
        if own is None:
            return None
        return 1 + sum(value is not None and value < own for value in row.values())


def random_designs(samples: int, seed: int) -> Floats:
    """Designs of chapter 4's controller, uniform in the bounds of table 4.4."""
    space = JobSpec(controller=_CONTROLLER).design_space()
    box = space.box
    shares = np.random.Generator(np.random.Philox(key=seed)).random((samples, box.dimension))
    return space.designs(box.from_unit(shares))


def published_designs() -> Floats:
    """Designs A, B and C."""
    controller = CONTROLLERS[_CONTROLLER]
    rows = [[controller.published[o][v.name] for v in controller.variables] for o in OPTIMA]
    return np.array(rows)


def simulate_designs(
    choice: Mapping[str, float], designs: Floats, *, robots: Sequence[str], workers: Executor
) -> tuple[Floats, NDArray[np.bool_]]:
    """Simulate designs in the six scenarios of table 4.2 under a choice of conventions.

    Returns (n, 6, m) objectives, and (n, 6) whether a simulation failed.
    """
    planner, robot = varied_robot(choice, robots)
    conventions = {n: v for n, v in choice.items() if n not in ("robot", *_OF_ROBOT)}
    names = [variable.name for variable in CONTROLLERS[_CONTROLLER].variables]
    columns = (*names, *conventions)
    constant = np.tile(list(conventions.values()), (len(designs), 1))
    whole = np.concatenate([designs, constant], axis=1)

    def simulated(start: int) -> tuple[Floats, NDArray[np.bool_]]:
        rows = whole[start : start + _CHUNK]
        outcomes = [
            simulate_walk(s, _CONTROLLER, columns, rows, robot=robot, planner=planner).outcome
            for s in SCENARIOS
        ]
        return (
            np.stack([outcome.objectives for outcome in outcomes], axis=1),
            np.stack([outcome.statuses != 0 for outcome in outcomes], axis=1),
        )

    pieces = list(workers.map(simulated, range(0, len(whole), _CHUNK)))
    objectives, failed = zip(*pieces, strict=True)
    return np.concatenate(objectives), np.concatenate(failed)


def varied_robot(choice: Mapping[str, float], robots: Sequence[str]) -> tuple[Robot, Robot]:
    """Robot that the gait is planned for, and the robot that is simulated."""
    planner = load_robot(robots[round(choice.get("robot", 0.0))])
    values = {name: choice[name] for name in _OF_ROBOT if name in choice}
    if "planned_soles" in values:
        planner = with_parameters(planner, {"planned_soles": values["planned_soles"]})
    return planner, with_parameters(planner, values)


def optimality(objectives: Floats, failed: NDArray[np.bool_]) -> Optimality:
    """Compare the optima, the first designs, with the random designs after them."""
    fitness, beaten = {}, {}
    for index, name in enumerate(OPTIMA):
        all_fitness = JobSpec(preference=name).judge(objectives, failed).fitness
        own, others = np.split(all_fitness, [len(OPTIMA)])
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
