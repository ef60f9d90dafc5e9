"""A robot at rest: forward kinematics of the feet and the height at which it stands."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
