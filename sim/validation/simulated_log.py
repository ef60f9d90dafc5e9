"""A simulated walk as the robot's own instruments would have logged it, without their errors."""

from __future__ import annotations

import numpy as np

from sim.errors import SimulationInputError
from sim.kernel.observation import WalkLog
from sim.kernel.parameters import GRAVITY
from sim.robot import Robot
from sim.validation.measured_log import ORIGIN, MeasuredLog


def simulated_log(robot: Robot, walk: WalkLog) -> MeasuredLog:
    """The quantities of table 2.2 of a walk that did not end early.

    Encoders see the motors' angles, potentiometers, which every joint has, the links'; currents are
    absolute values; every leg's board sees the one battery.
    Raises SimulationInputError for a walk that ended early.
    """
    if not np.isfinite(walk.current).all():
        raise SimulationInputError("a walk that ended early cannot be compared")
    joints, legs = robot.joint_names, tuple(leg.name for leg in robot.legs)
    return MeasuredLog(
        joints=joints,
        legs=legs,
        time=walk.time,
        desired_angle=walk.desired_angle,
        control_voltage=walk.voltage,
        joint_angle=walk.motor_angle,
        current=np.abs(walk.current),
        supply=np.repeat(walk.supply[:, None], len(legs), axis=1),
        potentiometer_joints=joints,
        potentiometer=walk.joint_angle,
        body_acceleration=walk.body_acceleration() / GRAVITY,
        metadata={ORIGIN: "simulated", "robot": robot.description.name},
    )
