"""What a calibration may vary: the robot, its parameters, the gait, controllers' conventions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Final

from gaitswarm.sim.catalogue import design_catalogue
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.robot import Robot, RobotSource, load_robot
from gaitswarm.sim.robot.identifiable import (
    CONVENTIONAL_VARIABLES,
    identifiable_variables,
    with_parameters,
)
from gaitswarm.sim.variables import Variable

ROBOT: Final = "robot"
"""The variable that chooses between robots."""

_PLANNED: Final = "planned_soles"
"""The one convention of the robot that its gait is planned by."""


def robot_variables(robots: Sequence[RobotSource]) -> tuple[Variable, ...]:
    """Everything of the robot that may be varied."""
    first, *others = map(load_robot, robots)
    parameters = identifiable_variables(first)
    for other in others:
        if identifiable_variables(other) != parameters:
            raise SimulationInputError(
                f"robots: {other.description.name} has other parameters than"
                f" {first.description.name}"
            )
    if not others:
        return (*CONVENTIONAL_VARIABLES, *parameters)
    choice = Variable(
        name=ROBOT,
        kind="categorical",
        choices=tuple(str(robot) for robot in robots),
        description="Which robot's parameters hold where none is varied.",
    )
    return (choice, *CONVENTIONAL_VARIABLES, *parameters)


def walk_variables(controllers: Iterable[ControllerName]) -> tuple[Variable, ...]:
    """Everything of walks that may be varied beside the robot."""
    found: dict[str, Variable] = {}
    for controller in dict.fromkeys(controllers):
        fixed = {variable.name for variable in CONTROLLERS[controller].variables}
        for name, variable in design_catalogue(controller).items():
            # Controllers may have defaults of their own for the same thing.
            same = variable.model_copy(update={"default": None})
            if name not in fixed and found.setdefault(name, same) != same:
                raise SimulationInputError(f"{name}: means different things to two controllers")
    return tuple(found.values())


def varied_robot(robots: Sequence[RobotSource], values: Mapping[str, float]) -> tuple[Robot, Robot]:
    """The robot that a design stands for."""
    parameters = dict(values)
    source = robots[round(parameters.pop(ROBOT, 0.0))]
    planner = _planner(source, parameters.get(_PLANNED))
    return planner, with_parameters(planner, parameters)


@lru_cache(maxsize=32)
def _planner(source: RobotSource, planned_soles: float | None) -> Robot:
    """One object for one robot, so that whoever keeps a plan finds it."""
    described = load_robot(source)
    if planned_soles is None:
        return described
    return with_parameters(described, {_PLANNED: planned_soles})
