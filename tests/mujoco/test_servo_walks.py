"""Servos with the friction of BAM's M6 in MuJoCo."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.sim.robot import load_robot
from tests.examples.robots import changed
from tests.examples.walks import servo_quadruped_files, short_walk, walk
from tests.mujoco.engine import walk_in_mujoco

pytestmark = pytest.mark.slow

FRICTION = {
    "stribeck_friction": 0.1,
    "stribeck_speed": 2.5,
    "stribeck_exponent": 0.84,
    "motor_load_friction": 0.3,
    "stribeck_motor_load": 0.15,
    "stribeck_link_load": 0.05,
    "link_load_square": 0.1,
    "motor_load_square": 0.1,
}


def test_a_walk_of_servos_is_worth_the_same_in_mujocos_own_steps() -> None:
    robot = changed(load_robot(servo_quadruped_files()), gearheads=FRICTION)
    brief, design = short_walk(cycles=1.0, cycle_time=0.2), {"P": 32.0}
    ours = walk(brief, design, "servo", robot=robot).outcome.objectives[0]
    theirs, _ = walk_in_mujoco(robot, brief, "servo", design)
    np.testing.assert_allclose(theirs[:5], ours[:5], rtol=0.03)
