"""Inverse kinematics: in closed form (appendix, eq. 4, misprints corrected), or by Gauss-Newton"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.robot.legs import ChainLeg

_MAX_STEPS: Final = 60
"""Limit of Gauss-Newton steps; a reachable target takes about six."""

_FIRST_DAMPING, _MAX_DAMPING = 1e-3, 1e9
"""In units of the trace of the squared Jacobian."""

_REACHED: Final = 1e-9
"""Distance from a target at which it counts as reached [m]."""

_EXACT: Final = 1e-14
"""Distance from all targets [m], or change of all angles [rad], at which the steps end."""


def leg_angles(
    lengths: tuple[float, float, float], forward: Floats, lateral: Floats, vertical: Floats
) -> tuple[Floats, Floats]:
    """Knee-up angles (T, 3) [rad] for a tibia end (T,) relative to the coxa axis [m].

    Also the miss (T,) [m] by which it lies outside the leg's reach; angles then point towards it.
    """
    coxa, femur, tibia = lengths
    alpha = np.arctan2(forward, lateral)
    outward = np.hypot(forward, lateral) - coxa
    distance = np.hypot(outward, vertical)
    longest, shortest = femur + tibia, abs(femur - tibia)
    miss = np.maximum(0.0, np.maximum(distance - longest, shortest - distance))
    # Cosine rule; clipping keeps a missed target's angles finite.
    cos_knee = (distance**2 - femur**2 - tibia**2) / (2.0 * femur * tibia)
    theta2 = -np.arccos(np.clip(cos_knee, -1.0, 1.0))
    theta1 = np.arctan2(vertical, outward) - np.arctan2(
        tibia * np.sin(theta2), femur + tibia * np.cos(theta2)
    )
    return np.stack([alpha, theta1, theta2], axis=-1), miss


def chain_angles(leg: ChainLeg, targets: Floats) -> tuple[Floats, Floats]:
    """Angles of any other leg, on the branch of its stance, for feet (T, 3), and the miss.

    Levenberg-Marquardt steps from the stance, first half of the way, so that a knee does not flip.
    """
    # Equal targets are solved once. However, numpy rounds a single row differently than several, so
    # equal rows of a constant target stay together.
    rows = np.ascontiguousarray(targets).view(f"V{targets.itemsize * 3}")[:, 0]
    _, first, where = np.unique(rows, return_index=True, return_inverse=True)
    if len(first) == 1:
        first, where = np.arange(len(targets)), np.arange(len(targets))
    targets = targets[first]
    angles = np.tile(leg.stance, (len(targets), 1))
    pose = _Pose(angles, *leg.feet(angles))
    pose = _stepped(leg, pose, 0.5 * (pose.at + targets))
    pose = _stepped(leg, pose, targets)
    missed = np.linalg.norm(targets - pose.at, axis=1)
    return pose.angles[where], np.where(missed > _REACHED, missed, 0.0)[where]


class _Pose(NamedTuple):
    """A leg at several times: angles (T, 3) [rad], foot (T, 3) [m] and its derivatives."""

    angles: Floats
    at: Floats
    jacobian: Floats


def _stepped(leg: ChainLeg, pose: _Pose, targets: Floats) -> _Pose:
    angles, at, jacobian = pose
    missed = targets - at
    squares = np.einsum("ti,ti->t", missed, missed)
    damping = np.full(len(targets), _FIRST_DAMPING)
    for _ in range(_MAX_STEPS):
        # The smallest damping keeps a stretched leg's step finite.
        normal = np.einsum("tij,tik->tjk", jacobian, jacobian)
        scale = np.einsum("tii->t", normal)
        normal += ((damping + 1e-15) * scale)[:, None, None] * np.eye(3)
        gradient = np.einsum("tij,ti->tj", jacobian, missed)
        steps = np.linalg.solve(normal, gradient[:, :, None])[:, :, 0]
        tried = angles + steps
        reached, slopes = leg.feet(tried)
        left = targets - reached
        better = np.einsum("ti,ti->t", left, left)
        good = better < squares
        angles = np.where(good[:, None], tried, angles)
        at = np.where(good[:, None], reached, at)
        jacobian = np.where(good[:, None, None], slopes, jacobian)
        missed = np.where(good[:, None], left, missed)
        squares = np.where(good, better, squares)
        damping = np.where(good, 0.1 * damping, np.minimum(10.0 * damping, _MAX_DAMPING))
        damping = np.where(squares < _REACHED**2, 0.0, damping)
        if squares.max() < _EXACT**2 or np.abs(steps).max() < _EXACT:
            break
    return _Pose(angles, at, jacobian)
