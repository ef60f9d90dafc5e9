"""At which angles a robot of unknown design stands well."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sim.errors import RobotFileError
from sim.gait.inverse_kinematics import chain_angles
from sim.proposal.legs import tried_angles
from sim.robot.legs import ChainLeg

Floats = NDArray[np.float64]

_HEIGHT: Final = 0.75
"""Height of the hips in the stance, as a share of what stretched legs would have."""

_MARGIN: Final = 0.15
"""Angle to a joint's limits below which a stance loses worth [rad]."""

_BAND: Final = 0.06
"""How far the feet that are compared may lie from the wanted height, as a share of it."""


@dataclass(frozen=True, slots=True)
class Stance:
    """How a robot stands.

    Attributes:
        angles: of each leg's joints [rad].
        height: of the highest hip over the feet [m].
        radius: lateral distance of the feet from the body's long axis [m].
    """

    angles: tuple[tuple[float, float, float], ...]
    height: float
    radius: float


def choose_stance(legs: Sequence[ChainLeg]) -> Stance:
    """Choose a stance: feet below or beside their hips, at three quarters of the legs' reach.

    Of the angles that put a foot there those are taken that let it move freely in all directions,
    with little torque, and away from the joints' limits; all feet are as far from the middle.

    Args:
        legs: Of the robot.

    Returns:
        The stance.

    Raises:
        RobotFileError: No angles within the limits put the feet of all legs on one level.
    """
    tried = [(angles := tried_angles(leg), *leg.feet(angles)) for leg in legs]
    ground = _HEIGHT * max(float(feet[:, 2].min()) for _, feet, _ in tried)
    chosen = [_best(leg, *of, ground) for leg, of in zip(legs, tried, strict=True)]
    feet = np.array([leg.foot(angles.tolist()) for leg, angles in zip(legs, chosen, strict=True)])
    radius = float(np.median(np.abs(feet[:, 1])))
    stance = []
    for leg, angles, foot in zip(legs, chosen, feet, strict=True):
        target = np.array([foot[0], np.copysign(radius, foot[1]), ground])
        stance.append(_reached(leg, angles, target))
    hips = max(leg.hip[2] for leg in legs)
    return Stance(tuple(stance), hips - ground, radius)


def _best(leg: ChainLeg, angles: Floats, feet: Floats, slopes: Floats, ground: float) -> Floats:
    """The best of the tried angles (3,)."""
    near = np.abs(feet[:, 2] - ground) < _BAND * abs(ground)
    if not near.any():
        raise RobotFileError(
            "robot.urdf: the feet cannot be put on one level: a leg's joint limits keep its foot"
            f" from {ground:.3f} m, three quarters of what all legs reach below the body"
        )
    angles, feet, slopes = angles[near], feet[near], slopes[near]
    length = sum(leg.lengths)
    # Freedom: the volume that small turns of all joints sweep; torque: of a vertical unit force.
    freedom = np.log(np.maximum(np.abs(np.linalg.det(slopes)) / length**3, 1e-12))
    torque = (slopes[:, 2, :] ** 2).sum(axis=1) / length**2
    to_limits = np.minimum(angles - leg.limits[:, 0], leg.limits[:, 1] - angles).min(axis=1)
    tight = np.maximum(0.0, 1.0 - to_limits / _MARGIN)
    ahead = ((feet[:, 0] - leg.hip[0]) / length) ** 2
    # A hip that is turned from the file's own zero spreads or crosses the legs.
    spread, folded = angles[:, 0] ** 2, (angles[:, 1:] ** 2).sum(axis=1)
    worth = freedom - 20.0 * torque - 5.0 * tight - 20.0 * ahead - 40.0 * spread - 0.02 * folded
    return np.asarray(angles[int(worth.argmax())])


def _reached(leg: ChainLeg, angles: Floats, target: Floats) -> tuple[float, float, float]:
    """The angles at which the foot is at the target, near others; those where it cannot be."""
    at = replace(leg, stance=angles)
    # First below the hip, where the thesis's and most legs are at rest, else where they were found.
    for x in (leg.hip[0], float(target[0])):
        wanted = np.array([[x, target[1], target[2]]])
        found, miss = chain_angles(at, wanted)
        within = (found >= leg.limits[:, 0]) & (found <= leg.limits[:, 1])
        if not miss.any() and within.all():
            angles = found[0]
            break
    first, second, third = np.round(angles, 6).tolist()
    return first, second, third
