"""Robots with other fields than the shipped ones."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from gaitswarm.sim.robot.description import RobotDescription
from gaitswarm.sim.robot.identifiable import with_parameters
from gaitswarm.sim.robot.robot import Robot
from tests.examples.paths import QUADRUPED

SLOW: Final[dict[str, Any]] = {
    "name": "slow",
    "cycle_time": 2.0,
    "radius": 0.22,
    "hip_height": 0.16,
    "stride": 0.06,
    "height": 0.03,
    "duty_factor": 0.8,
    "cycles": 1,
}
"""A walk of the quadruped, as a document."""

FAST: Final[dict[str, Any]] = SLOW | {"name": "fast", "stride": 0.08}
"""The same with longer strides."""


def robot_folder(folder: Path, **job: Any) -> Path:
    """The folder of the quadruped, whose jobs have these fields in place of pi, C, slow and fast.

    folder: to be made. job: fields of job.json.
    """
    shutil.copytree(QUADRUPED, folder)
    document = {"controller": "pi", "preference": "C", "scenarios": [SLOW, FAST]} | job
    (folder / "job.json").write_text(json.dumps(document), encoding="utf-8")
    return folder


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
