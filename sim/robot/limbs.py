"""Limbs as numbers: geometry, inertias and motors of every leg."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.robot.chain import Placement, chain_of, check_joints
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.inertia import parallel_axis
from gaitswarm.sim.robot.robot import Robot

_NOISE: Final = 1e-14

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]


@dataclass(frozen=True, slots=True)
class LimbJoint:
    """A joint, the link beyond it and its motor."""

    axis: Vector  # in the link's frame; parallel to one of its axes, it points along that
    sign: float  # -1 if the joint rotates against `axis`, else 1
    rotation: Matrix  # of the joint in the previous frame, at angle 0
    offset: Vector  # of the joint in the previous frame [m]
    mass: float  # of the link [kg]
    moment: Vector  # first moment of the link's mass [kg m]
    # of the link about its origin: xx, yy, zz, xy, xz, yz [kg m2]
    angular: tuple[float, float, float, float, float, float]
    torque: float  # r K_M [N m/A]
    resistance: float  # of the motor [ohm]
    conductance: float  # its inverse [1/ohm]
    armature: float  # of the rotor at the joint [kg m2]
    shaft_stiffness: float  # of the closed play [N m/rad]
    shaft_damping: float  # of the closed play [N m s/rad]
    # 1 / (r K_M) of a torque-controlled actuator; 0 for a DC motor [A/(N m)]
    inverse_torque: float = 0.0
    torque_limit: float = 0.0  # of a torque-controlled actuator; 0 for a DC motor [N m]
    stall_torque: float = 0.0  # of the line by which speed limits its torque, at rest [N m]
    # the same where the battery's voltage makes that line [N m/V]
    stall_torque_per_volt: float = 0.0
    torque_drop: float = 0.0  # by which that line falls with the rate [N m s/rad]


@dataclass(frozen=True, slots=True)
class Limb:
    """A leg."""

    joints: tuple[LimbJoint, ...]  # from the body to the foot
    foot: Vector  # in the last link's frame [m]
    # upper bound of how fast a force accelerates the foot against the rotors' inertia, which is
    # most of a geared leg's: with the body held and the leg stretched [1/kg]
    mobility: float


@lru_cache(maxsize=64)
def limbs_of(robot: Robot) -> tuple[Limb, ...]:
    chains = [chain_of(robot.urdf, leg) for leg in robot.description.legs]
    check_joints(robot.urdf, robot.description.legs)
    return tuple(
        limb_of(robot, number, chain.placements, chain.foot) for number, chain in enumerate(chains)
    )


def limb_of(robot: Robot, number: int, placements: Sequence[Placement], foot: Floats) -> Limb:
    """Build a limb from placements, motors and the foot (3,) [m] in the last link's frame."""
    actuators = robot.actuators()
    joints = []
    for index, place in enumerate(placements, start=JOINTS_PER_LEG * number):
        axis = _without_noise(place.axis)
        sign = -1.0 if sorted(axis.tolist()) == [-1.0, 0.0, 0.0] else 1.0
        link = place.inertia
        about = link.rotational + link.mass * parallel_axis(link.centre)
        resistance, armature = float(actuators.resistance[index]), float(actuators.armature[index])
        joints.append(
            LimbJoint(
                axis=_triple(sign * axis + 0.0),
                sign=sign,
                rotation=tuple(map(_triple, _without_noise(place.rotation))),  # type: ignore[arg-type]
                offset=_triple(_without_noise(place.offset)),
                mass=link.mass,
                moment=_triple(link.mass * link.centre),
                angular=tuple(about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()),
                torque=float(actuators.torque[index]),
                resistance=resistance,
                conductance=1.0 / resistance,
                armature=armature,
                shaft_stiffness=float(actuators.shaft_stiffness[index]),
                shaft_damping=float(actuators.shaft_damping[index]),
                inverse_torque=1.0 / float(actuators.torque[index])
                if robot.is_torque_controlled
                else 0.0,
                torque_limit=float(actuators.torque_limit[index]),
                stall_torque=float(actuators.stall_torque[index]),
                stall_torque_per_volt=float(actuators.stall_torque_per_volt[index]),
                torque_drop=float(actuators.torque_drop[index]),
            )
        )
    at = _without_noise(foot)
    parts = [_triple(at), *(joint.offset for joint in reversed(joints[1:]))]
    lengths = [math.hypot(*part) for part in parts]
    mobility = sum(
        reach**2 / joint.armature
        for reach, joint in zip(itertools.accumulate(lengths), reversed(joints), strict=True)
    )
    return Limb(tuple(joints), _triple(at), mobility)


def is_torque_controlled(joint: LimbJoint) -> bool:
    limit: object = joint.torque_limit
    return not (isinstance(limit, float) and limit == 0.0)


def electrical_constants(joints: Sequence[LimbJoint]) -> list[float]:
    """Return by joint 1/R [1/ohm] or R / k^2 [W/(N m)^2], and r K_M [N m/A] or the torque limit."""
    if is_torque_controlled(joints[0]):
        loss = [joint.resistance * joint.inverse_torque * joint.inverse_torque for joint in joints]
        return [*loss, *(joint.torque_limit for joint in joints)]
    return [*(joint.conductance for joint in joints), *(joint.torque for joint in joints)]


def _triple(values: Floats) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def _without_noise(values: Floats) -> Floats:
    """Round numbers that are integers up to rounding errors: structural zeros and ones."""
    nearest = np.rint(values)
    return np.where(np.abs(values - nearest) < _NOISE, nearest, values) + 0.0
