"""Robots as data."""

from __future__ import annotations

from sim.robot.robot import Robot, parse_robot
from sim.robot.variant import RobotFiles, RobotName, RobotSource, RobotVariant, load_robot

__all__ = [
    "Robot",
    "RobotFiles",
    "RobotName",
    "RobotSource",
    "RobotVariant",
    "load_robot",
    "parse_robot",
]
