"""Walks by MuJoCo's kernel with the simulator's inputs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.assembly import control_steps, judge, plan_walk
from gaitswarm.sim.controllers import control_law
from gaitswarm.sim.kernel.observation import WalkLog, walk_log
from gaitswarm.sim.kernel.walk import WalkResult
from gaitswarm.sim.mujoco.kernel import MujocoKernel
from gaitswarm.sim.mujoco.mjcf import Soles
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import RobotChoice, load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario


def walk_in_mujoco(
    variant: RobotChoice | Robot,
    scenario: Scenario,
    controller: str,
    design: Mapping[str, float],
    *,
    rate: int | None = None,
    soles: Soles = "none",
) -> tuple[NDArray[np.float64], WalkLog]:
    """Objectives f1 to f6 and log of one walk to its end."""
    robot = variant if isinstance(variant, Robot) else load_robot(variant)
    coding, timestep = control_steps(robot)
    plan = plan_walk(robot, scenario, timestep)
    assert plan is not None
    setup = plan(control_law(controller, tuple(design.items())))
    (result,) = MujocoKernel(robot, rate=rate, soles=soles).walk([setup], coding, log=True)
    assert isinstance(result, WalkResult) and result.states is not None
    status, objectives = judge(setup, result, coding.substeps, timestep)
    assert status is Status.OK
    return objectives, walk_log(robot, setup, result.states)
