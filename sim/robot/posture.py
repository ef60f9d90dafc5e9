"""Postures of a robot: feet, centre of mass and height at rest."""

from __future__ import annotations

import math

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.robot.chain import chain_of
from gaitswarm.sim.robot.legs import turned
from gaitswarm.sim.robot.limbs import limbs_of
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.terrain import HeightGrid


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
