"""Joint torques with which the legs on the ground carry the robot."""

from __future__ import annotations

from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.gait.trajectory import Trajectory
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.legs import ChainLeg, KneeUpLeg, LegKinematics
from gaitswarm.sim.robot.robot import Robot

_ON_THE_GROUND: Final = 0.1
"""Share of a foot's lift up to which it counts as on the ground: the filter rounds its path."""

_LIFTED: Final = 1e-4
"""Height up to which no foot counts as lifted [m], for rounding errors of a standing robot."""

_DECIMALS: Final = 9
"""Decimals of torques in N m, for equal walks on all machines."""


def carrying_torques(robot: Robot, trajectory: Trajectory, gravity: float) -> Floats:
    """Feed-forward of a walk (T, J) [N m]: the feet on the ground share the robot's weight evenly.

    tau = -J^T (0, 0, f), the static part of that of Di Carlo et al. (Dynamic locomotion in the MIT
    Cheetah 3 through convex model-predictive control, 2018); the body is level, without load.
    """
    angles = trajectory.angles
    height, slopes = np.empty((len(angles), len(robot.legs))), np.empty_like(angles)
    for number, leg in enumerate(robot.legs):
        joints = slice(JOINTS_PER_LEG * number, JOINTS_PER_LEG * (number + 1))
        height[:, number], slopes[:, joints] = _height(leg, angles[:, joints])
    lowest, highest = height.min(axis=0), height.max(axis=0)
    down = height <= lowest + np.maximum(_ON_THE_GROUND * (highest - lowest), _LIFTED)
    force = robot.mass * gravity / np.maximum(down.sum(axis=1), 1)
    forces = np.repeat(down * force[:, np.newaxis], JOINTS_PER_LEG, axis=1)
    # numpy's functions of angles differ in the last bit between processors.
    return np.round(-forces * slopes, _DECIMALS)


def _height(leg: LegKinematics, angles: Floats) -> tuple[Floats, Floats]:
    """Height of the foot in the body's frame (T,) [m], and its derivatives by angle (T, 3) [m]."""
    if isinstance(leg, ChainLeg):
        at, slopes = leg.feet(angles)
        return at[:, 2], slopes[:, 2, :]
    assert isinstance(leg, KneeUpLeg)  # noqa: S101
    _, femur, tibia = leg.lengths
    first, both = angles[:, 1], angles[:, 1] + angles[:, 2]
    height = leg.hip[2] + femur * np.sin(first) + tibia * np.sin(both)
    outward = tibia * np.cos(both)
    turned = [np.zeros(len(angles)), femur * np.cos(first) + outward, outward]
    return height, np.stack(turned, axis=1)
