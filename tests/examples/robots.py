"""Robots with other fields than the shipped ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from sim.robot import Robot
from sim.robot.description import RobotDescription
from sim.robot.identifiable import with_parameters


def changed(robot: Robot, **tables: Any) -> Robot:
    """The robot with other fields in some tables of its robot.toml, or in all of a table's parts.

    tables: by name of the table, a mapping from fields to values; of the tables that hold parts by
    name (motors, gearheads, actuators) every part is changed alike. Anything but a mapping replaces
    a field of the description itself.
    """
    document = robot.description.model_dump()
    for table, fields in tables.items():
        if not isinstance(fields, Mapping):
            document[table] = fields
        elif table in ("motors", "gearheads", "actuators"):
            document[table] = {name: part | fields for name, part in document[table].items()}
        else:
            document[table] = document[table] | fields
    return replace(robot, description=RobotDescription.model_validate(document))


def with_feet(robot: Robot, **values: float) -> Robot:
    """The robot with the same stiffness, damping, sole or friction under every leg."""
    return with_parameters(
        robot,
        {f"{name}_{leg.name}": v for name, v in values.items() for leg in robot.description.legs},
    )
