"""A robot in a scenario as a model of its own, to be looked at."""

from __future__ import annotations

import mujoco
import numpy as np

from gaitswarm.sim.gait.leg_gaits import leg_gaits
from gaitswarm.sim.gait.trajectory import desired_angles, require_reachable
from gaitswarm.sim.mujoco.mjcf import Rig, Surroundings, mjcf
from gaitswarm.sim.mujoco.model import Feet, even_drags, with_contacts
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.robot.posture import resting_height
from gaitswarm.sim.robot.shapes import visible_links
from gaitswarm.sim.scenario import Scenario


def exported(robot: Robot, scenario: Scenario, *, contacts: bool = True) -> str:
    """Write a robot in a scenario as MJCF that MuJoCo's viewer opens and steps.

    It has the scenario's load and slope, joints with the motors' voltages as controls [V], or with
    torques [N m] where these are controlled, shapes to be seen, and a keyframe `start`, the pose in
    which a walk through the scenario begins. Backlash, limits of torque by speed, the battery's sag
    and static friction are not in it.
    """
    require_reachable(robot, scenario)
    surroundings = Surroundings.of(robot, scenario)
    joints = desired_angles(robot, scenario).start
    mass = robot.mass + scenario.load
    height = resting_height(robot, joints, mass * -float(surroundings.gravity[2]))
    rig = Rig(
        voltage_motors=True,
        looks=visible_links(robot, scenario.load),
        start=np.array([0.0, 0.0, height + scenario.drop, 1.0, 0.0, 0.0, 0.0, *joints]),
    )
    if contacts:
        standing = sum(gait.support_share for gait in leg_gaits(robot, scenario))
        feet = Feet(even_drags(robot, surroundings, standing))
        rig = with_contacts(robot, surroundings, rig, feet)
    text = mjcf(robot, surroundings, rig)
    mujoco.MjModel.from_xml_string(text)
    return text
