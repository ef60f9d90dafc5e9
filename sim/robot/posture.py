"""A robot at rest: where its legs and its mass are, and the height at which it stands."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sim.robot.chain import chain_of
from sim.robot.robot import Robot

Floats = NDArray[np.float64]


def feet_in_body(robot: Robot, joints: Floats) -> Floats:
    """Where every foot is in the body's frame.

    Args:
        robot: The robot.
        joints: Angles, (J,) [rad].

    Returns:
        (L, 3) [m].
    """
    angles = joints.reshape(-1, 3).tolist()
    return np.array([leg.foot(of) for leg, of in zip(robot.legs, angles, strict=True)])


def feet_below_body(robot: Robot, joints: Floats) -> Floats:
    """Height of every foot in the body's frame.

    Args:
        robot: The robot.
        joints: Angles, (J,) [rad].

    Returns:
        (L,) [m], mostly negative.
    """
    return np.asarray(feet_in_body(robot, joints)[:, 2])


def leg_points(robot: Robot, joints: Floats) -> Floats:
    """Where every leg's joints and its foot are in the body's frame.

    Args:
        robot: The robot.
        joints: Angles, (J,) [rad].

    Returns:
        (L, 4, 3) [m]: three joints from the body on, and the foot.
    """
    return np.array([points for points, _ in _chains(robot, joints)])


def centre_of_mass(robot: Robot, joints: Floats) -> Floats:
    """Where the centre of mass of the whole robot without load is in the body's frame.

    Args:
        robot: The robot.
        joints: Angles, (J,) [rad].

    Returns:
        (3,) [m].
    """
    moment, mass = robot.body.mass * robot.body.centre, robot.body.mass
    for _, (of_leg, moment_of_leg) in _chains(robot, joints):
        mass, moment = mass + of_leg, moment + moment_of_leg
    return np.asarray(moment / mass)


def _chains(robot: Robot, joints: Floats) -> Iterator[tuple[Floats, tuple[float, Floats]]]:
    """Of each leg its points (4, 3), its mass and its mass times where this is."""
    for leg, angles in zip(robot.description.legs, joints.reshape(-1, 3), strict=True):
        chain = chain_of(robot.urdf, leg)
        rotation, at = np.eye(3), np.zeros(3)
        points, mass, moment = [], 0.0, np.zeros(3)
        for place, angle in zip(chain.placements, angles.tolist(), strict=True):
            at = at + rotation @ place.offset
            points.append(at)
            rotation = rotation @ place.rotation @ _turn(place.axis, angle)
            mass += place.inertia.mass
            moment = moment + place.inertia.mass * (at + rotation @ place.inertia.centre)
        points.append(at + rotation @ chain.foot)
        yield np.array(points), (mass, moment)


def _turn(axis: Floats, angle: float) -> Floats:
    """Rotation about a unit vector, by Rodrigues' formula."""
    x, y, z = axis.tolist()
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * across + (1.0 - math.cos(angle)) * (across @ across)


def resting_height(robot: Robot, joints: Floats, weight: float) -> float:
    """Height of a level body at which the feet's springs carry a weight.

    Args:
        robot: The robot.
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
