"""Robots that ship with gaitswarm, by name."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import lru_cache
from importlib import resources
from typing import Final, Literal, get_args

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.robot.identifiable import with_parameters
from gaitswarm.sim.robot.robot import Robot, parse_robot

RobotName = Literal["szabadka2", "szabadka2-identified", "szabadka2-reconstructed"]
"""Robots that ship with gaitswarm."""

DEFAULT_ROBOT: Final[RobotName] = "szabadka2-reconstructed"
"""The robot that walks where none is named: the one that published results speak of."""

SHIPPED: Final[tuple[RobotName, ...]] = get_args(RobotName)


@lru_cache(maxsize=8)
def shipped_robot(name: str) -> Robot:
    """A robot that ships with gaitswarm.

    Its folder holds robot.toml and robot.urdf; or parameters.toml, which names another shipped
    robot as its base and gives some of `identifiable_variables` other values.
    """
    if name not in SHIPPED:
        raise SimulationInputError(f"robot: unknown {name!r}; known are {', '.join(SHIPPED)}")
    folder = resources.files("gaitswarm.sim.robot") / name
    parameters = folder / "parameters.toml"
    if not parameters.is_file():
        robot = parse_robot(
            (folder / "robot.toml").read_text(encoding="utf-8"),
            (folder / "robot.urdf").read_text(encoding="utf-8"),
        )
        return replace(robot, ships=True)
    document = tomllib.loads(parameters.read_text(encoding="utf-8"))
    robot = with_parameters(shipped_robot(document["base"]), document["parameters"])
    said = {field: document[field] for field in ("name", "description")}
    return replace(robot, description=robot.description.model_copy(update=said))
