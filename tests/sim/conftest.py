"""The robot that ships."""

from __future__ import annotations

import pytest

from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.robot import Robot


@pytest.fixture(scope="session")
def robot() -> Robot:
    return load_robot("szabadka2")
