"""Torque-controlled actuators in MuJoCo: whole walks, and the exported model."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from gaitswarm.sim.mujoco.model import exported
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.scenario import SCENARIOS
from tests.examples.walks import short_walk, torque_quadruped_files, walk
from tests.mujoco.engine import walk_in_mujoco

pytestmark = pytest.mark.slow

FILES = torque_quadruped_files()
DRIVES = {
    "joint-pd": {"Kp": 40.0, "Kd": 1.0, "feed_forward": 0.8},
    "pid": {"P": 0.5, "I": 0.1, "D": 0.01},
}
WALK = short_walk(cycles=1.0, cycle_time=0.3)


@pytest.mark.variants
@pytest.mark.parametrize("controller", DRIVES)
def test_a_walk_is_worth_the_same_in_mujocos_own_steps(controller: str) -> None:
    ours = walk(WALK, DRIVES[controller], controller, robot=FILES).outcome.objectives[0]
    theirs, log = walk_in_mujoco(FILES, WALK, controller, DRIVES[controller])
    np.testing.assert_allclose(theirs[:5], ours[:5], rtol=0.03)
    assert np.isfinite(log.current).all()


@pytest.mark.thorough("test_a_walk_is_worth_the_same_in_mujocos_own_steps")
def test_an_inner_rate_that_divides_no_usual_step_is_kept() -> None:
    """At 1500 Hz MuJoCo's steps are 6 kHz, and 81 kHz where a foot may come down."""
    files = torque_quadruped_files(rate=1500)
    ours = walk(WALK, DRIVES["joint-pd"], "joint-pd", robot=files).outcome.objectives[0]
    theirs, _ = walk_in_mujoco(files, WALK, "joint-pd", DRIVES["joint-pd"])
    np.testing.assert_allclose(theirs[:5], ours[:5], rtol=0.03)


def test_the_exported_model_takes_torques_within_the_limits() -> None:
    robot = load_robot(FILES)
    m = mujoco.MjModel.from_xml_string(exported(robot, SCENARIOS[0]))
    assert [m.actuator(k).name for k in range(m.nu)] == [f"{n}_torque" for n in robot.joint_names]
    limit = robot.actuators().torque_limit
    np.testing.assert_allclose(m.actuator_ctrlrange, np.stack([-limit, limit], axis=1))
    d = mujoco.MjData(m)
    d.ctrl[:] = 100.0
    mujoco.mj_forward(m, d)
    np.testing.assert_allclose(d.qfrc_actuator[6:], limit)
