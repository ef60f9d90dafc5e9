"""Robots as data."""

from __future__ import annotations

from typing import Literal

from sim.robot.robot import Robot, load_robot, parse_robot

RobotName = Literal["szabadka2"]
"""Robots that ship with gaitswarm."""

__all__ = ["Robot", "RobotName", "load_robot", "parse_robot"]
