"""Robots as data."""

from __future__ import annotations

from gaitswarm.sim.robot.variant import (
    DEFAULT_ROBOT,
    SHIPPED,
    RobotChoice,
    RobotFiles,
    RobotName,
    RobotSource,
    RobotVariant,
    load_robot,
)

__all__ = [
    "DEFAULT_ROBOT",
    "SHIPPED",
    "RobotChoice",
    "RobotFiles",
    "RobotName",
    "RobotSource",
    "RobotVariant",
    "load_robot",
]
