"""A well-known quadruped in its proposed gait, in MuJoCo under the kernel's ground forces."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gaitswarm.sim.outcome import Status
from gaitswarm.sim.proposal.document import propose_robot
from gaitswarm.sim.robot import RobotFiles, load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import simulate
from tests.mujoco.controllers import Pi
from tests.mujoco.engine import walk_in_mujoco
from tests.mujoco.walker import walk
from tests.robots.known import QUADRUPEDS, urdf_of

pytestmark = pytest.mark.slow

DESIGN = {"P": 0.6, "I": 0.5}


@pytest.fixture(scope="module")
def files() -> tuple[RobotFiles, dict[str, Any]]:
    """Of a1 with DC motors, which the tests' own PI drives, and the faster of its walks."""
    text = urdf_of(QUADRUPEDS["a1"]).read_text(encoding="utf-8")
    proposal = propose_robot(text, "a1", "dc")
    return RobotFiles(toml=proposal.toml, urdf=proposal.urdf), proposal.job["scenarios"][1]


@pytest.mark.thorough("test_a_walk_is_the_same_in_mujoco_to_rounding, with another robot")
def test_a_cycle_of_a1_is_the_same_in_mujoco(
    files: tuple[RobotFiles, dict[str, Any]],
) -> None:
    """To rounding in our own steps, and within two percent in MuJoCo's."""
    robot: Robot = load_robot(files[0])
    scenario = Scenario.model_validate(files[1] | {"cycles": 1.0})
    walked = simulate(
        scenario, "pi", list(DESIGN), np.array([list(DESIGN.values())]), robot=robot, log=True
    )
    assert walked.outcome.statuses.tolist() == [Status.OK]
    objectives, (log,) = walked.outcome.objectives[0], walked.logs
    assert log is not None
    # Every foot is lifted.
    assert (log.foot_force[:, :, 2].min(axis=0) == 0.0).all()
    trace = walk(robot, scenario, log, Pi(robot, log, DESIGN))
    for name in ("base_position", "base_orientation", "joint_angle"):
        np.testing.assert_allclose(getattr(trace, name), getattr(log, name), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(trace.foot_force, log.foot_force, atol=1e-5)
    np.testing.assert_allclose(trace.objectives, objectives, rtol=1e-8)
    found, _ = walk_in_mujoco(files[0], scenario, "pi", DESIGN)
    np.testing.assert_allclose(found[:5], objectives[:5], rtol=0.02)
