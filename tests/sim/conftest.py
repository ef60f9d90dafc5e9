"""The robot that ships."""

from __future__ import annotations

import pytest

from gaitswarm.sim.robot import Robot, load_robot


@pytest.fixture(scope="session")
def robot() -> Robot:
    return load_robot("szabadka2")
