"""A simulated walk as the robot's own instruments would have logged it, without their errors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.errors import SimulationInputError
from sim.kernel.observation import WalkLog
from sim.kernel.parameters import GRAVITY
from sim.robot import Robot
from sim.validation.measured_log import ORIGIN, MeasuredLog

Floats = NDArray[np.float64]


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
        body_acceleration=body_acceleration(walk),
        metadata={ORIGIN: "simulated", "robot": robot.description.name},
    )


def body_acceleration(walk: WalkLog) -> Floats:
    """(T, 3) acceleration of the body's origin in its own frame, without gravity [g].

    dv/dt + omega x v of the logged twist, dv/dt by central differences over 4 ms.
    """
    linear, angular = walk.base_velocity[:, :3], walk.base_velocity[:, 3:]
    rate = np.gradient(linear, walk.time, axis=0)
    return (rate + np.cross(angular, linear)) / GRAVITY
