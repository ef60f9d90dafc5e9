"""Limbs as numbers: geometry, inertias and motors of every leg, and postures of a robot."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.legs import Placement, chain_of, check_joints, turned
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.urdf import parallel_axis
from gaitswarm.sim.terrain import HeightGrid

_NOISE: Final = 1e-14

_OF_ACTUATORS: Final = (
    *("torque", "resistance", "armature", "shaft_stiffness", "shaft_damping"),
    *("torque_limit", "stall_torque", "stall_torque_per_volt", "torque_drop"),
)
"""Numbers of a joint's actuator."""

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
        numbers = {name: float(getattr(actuators, name)[index]) for name in _OF_ACTUATORS}
        joints.append(
            LimbJoint(
                axis=_triple(sign * axis + 0.0),
                sign=sign,
                rotation=tuple(map(_triple, _without_noise(place.rotation))),  # type: ignore[arg-type]
                offset=_triple(_without_noise(place.offset)),
                mass=link.mass,
                moment=_triple(link.mass * link.centre),
                angular=tuple(about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()),
                conductance=1.0 / numbers["resistance"],
                inverse_torque=1.0 / numbers["torque"] if robot.is_torque_controlled else 0.0,
                **numbers,
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


def feet_in_body(robot: Robot, joints: Floats) -> Floats:
    """Return all feet in the body's frame, (L, 3) [m], at joint angles (J,) [rad]."""
    angles = joints.reshape(-1, 3).tolist()
    return np.array([leg.foot(of) for leg, of in zip(robot.legs, angles, strict=True)])


def feet_below_body(robot: Robot, joints: Floats) -> Floats:
    """Return the height of all feet in the body's frame, (L,) [m], mostly negative."""
    return np.asarray(feet_in_body(robot, joints)[:, 2])


def leg_points(robot: Robot, joints: Floats) -> Floats:
    """Return three joints and the foot of each leg in the body's frame, (L, 4, 3) [m]."""
    legs = []
    for leg, angles in zip(robot.description.legs, joints.reshape(-1, 3), strict=True):
        chain = chain_of(robot.urdf, leg)
        rotation, at, points = np.eye(3), np.zeros(3), []
        for place, angle in zip(chain.placements, angles.tolist(), strict=True):
            at = at + rotation @ place.offset
            points.append(at)
            rotation = rotation @ place.rotation @ _turn(place.axis, angle)
        legs.append([*points, at + rotation @ chain.foot])
    return np.array(legs)


def feet_and_centre_of_mass(robot: Robot, joints: Floats, load: float) -> tuple[Floats, Floats]:
    """Return feet (T, L, 3) and centre of mass (T, 3) in the body's frame [m], with a load [kg]."""
    body = robot.body
    at_load = np.array([0.0, 0.0, robot.description.load_height])
    moment = np.tile(body.mass * body.centre + load * at_load, (len(joints), 1))
    feet = []
    for number, limb in enumerate(limbs_of(robot)):
        angles = joints[:, 3 * number : 3 * number + 3]
        foot = np.tile(np.array(limb.foot), (len(joints), 1))
        mass, of_leg = 0.0, np.zeros_like(foot)
        # From the foot inwards: each joint rotates everything beyond it.
        for joint, angle in zip(reversed(limb.joints), reversed(angles.T), strict=True):
            mass, of_leg = mass + joint.mass, of_leg + np.array(joint.moment)
            axis, rotation, offset = map(np.array, (joint.axis, joint.rotation, joint.offset))
            sine, cosine = np.sin(joint.sign * angle), np.cos(angle)
            foot = turned(foot, axis, sine, cosine) @ rotation.T + offset
            of_leg = turned(of_leg, axis, sine, cosine) @ rotation.T + mass * offset
        moment += of_leg
        feet.append(foot)
    return np.stack(feet, axis=1), moment / (robot.mass + load)


def rotated(quaternion: Floats, points: Floats) -> Floats:
    """Return points (n, 3) turned by a quaternion x y z w."""
    axis, w = quaternion[:3], quaternion[3]
    turn = 2.0 * np.cross(axis, points)
    return np.asarray(points + w * turn + np.cross(axis, turn))


def _turn(axis: Floats, angle: float) -> Floats:
    """Rotation matrix about a unit vector, by Rodrigues' formula."""
    x, y, z = axis.tolist()
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn = np.eye(3) + math.sin(angle) * across + (1.0 - math.cos(angle)) * (across @ across)
    return np.asarray(turn)


def resting_height(
    robot: Robot, joints: Floats, weight: float, grid: HeightGrid | None = None
) -> float:
    """Return the height [m] of a level body on a grid at which its feet's springs carry it."""
    contacts = robot.contacts()
    reach = np.array([c.sole for c in contacts]) - feet_below_body(robot, joints)
    if grid is not None:
        x, y, _ = feet_in_body(robot, joints).T
        reach = reach + grid.height(x, y)
    return height_on_soles(reach, np.array([c.stiffness for c in contacts]), weight)


def height_on_soles(reach: Floats, stiffness: Floats, weight: float) -> float:
    """Return the height [m] of a body at which springs below it carry a weight [N].

    The lowest feet, `reach` below (L,) [m], are loaded until the next one stays in the air.
    """
    order = np.argsort(-reach)
    reach, stiffness = reach[order], stiffness[order]
    # Height at which the n lowest feet balance the weight, for every n.
    heights = (np.cumsum(stiffness * reach) - weight) / np.cumsum(stiffness)
    next_reach = np.append(reach[1:], -np.inf)
    return float(heights[np.argmax(heights >= next_reach)])
