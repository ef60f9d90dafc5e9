"""A robot at rest: where its feet and its centre of mass are, and at which height it stands."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.robot.chain import chain_of
from gaitswarm.sim.robot.legs import turned
from gaitswarm.sim.robot.limbs import limbs_of
from gaitswarm.sim.robot.robot import Robot

Floats = NDArray[np.float64]


def feet_in_body(robot: Robot, joints: Floats) -> Floats:
    """Where every foot is in the body's frame.

    Args:
        joints: Angles, (J,) [rad].

    Returns:
        (L, 3) [m].
    """
    angles = joints.reshape(-1, 3).tolist()
    return np.array([leg.foot(of) for leg, of in zip(robot.legs, angles, strict=True)])


def feet_below_body(robot: Robot, joints: Floats) -> Floats:
    """Height of every foot in the body's frame.

    Args:
        joints: Angles, (J,) [rad].

    Returns:
        (L,) [m], mostly negative.
    """
    return np.asarray(feet_in_body(robot, joints)[:, 2])


def leg_points(robot: Robot, joints: Floats) -> Floats:
    """Where every leg's joints and its foot are in the body's frame.

    Args:
        joints: Angles, (J,) [rad].

    Returns:
        (L, 4, 3) [m]: three joints from the body on, and the foot.
    """
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
    """Where feet and centre of mass are in many postures.

    Args:
        joints: Angles, (T, J) [rad].
        load: Mass carried on the body [kg].

    Returns:
        In the body's frame: the feet (T, L, 3) and the centre of mass (T, 3) [m].
    """
    body = robot.body
    at_load = np.array([0.0, 0.0, robot.description.load_height])
    moment = np.tile(body.mass * body.centre + load * at_load, (len(joints), 1))
    feet = []
    for number, limb in enumerate(limbs_of(robot)):
        angles = joints[:, 3 * number : 3 * number + 3]
        foot = np.tile(np.array(limb.foot), (len(joints), 1))
        mass, of_leg = 0.0, np.zeros_like(foot)
        # From the foot inwards: each joint turns all that is behind it.
        for joint, angle in zip(reversed(limb.joints), reversed(angles.T), strict=True):
            mass, of_leg = mass + joint.mass, of_leg + np.array(joint.moment)
            axis, rotation, offset = map(np.array, (joint.axis, joint.rotation, joint.offset))
            sine, cosine = np.sin(joint.sign * angle), np.cos(angle)
            foot = turned(foot, axis, sine, cosine) @ rotation.T + offset
            of_leg = turned(of_leg, axis, sine, cosine) @ rotation.T + mass * offset
        moment += of_leg
        feet.append(foot)
    return np.stack(feet, axis=1), moment / (robot.mass + load)


def _turn(axis: Floats, angle: float) -> Floats:
    """Rotation about a unit vector, by Rodrigues' formula."""
    x, y, z = axis.tolist()
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn = np.eye(3) + math.sin(angle) * across + (1.0 - math.cos(angle)) * (across @ across)
    return np.asarray(turn)


def resting_height(robot: Robot, joints: Floats, weight: float) -> float:
    """Height of a level body at which the feet's springs carry a weight.

    Args:
        joints: Angles, (J,) [rad].
        weight: To be carried [N].

    Returns:
        [m].
    """
    contacts = robot.contacts()
    reach = np.array([c.sole for c in contacts]) - feet_below_body(robot, joints)
    return height_on_soles(reach, np.array([c.stiffness for c in contacts]), weight)


def height_on_soles(reach: Floats, stiffness: Floats, weight: float) -> float:
    """Height of a body at which springs under it carry a weight.

    The springs' force is piecewise linear in height; feet are loaded from the lowest up until the
    balance leaves the next one in the air.

    Args:
        reach: How far the soles' unloaded ends lie below the body, (L,) [m].
        stiffness: Of the soles, (L,) [N/m].
        weight: To be carried [N].

    Returns:
        [m].
    """
    order = np.argsort(-reach)
    reach, stiffness = reach[order], stiffness[order]
    # Height at which the n lowest feet balance the weight, for every n.
    heights = (np.cumsum(stiffness * reach) - weight) / np.cumsum(stiffness)
    next_reach = np.append(reach[1:], -np.inf)
    return float(heights[np.argmax(heights >= next_reach)])
