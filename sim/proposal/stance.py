"""Choice of a stance for a robot of unknown design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.gait.inverse_kinematics import chain_angles
from gaitswarm.sim.proposal.legs import tried_angles
from gaitswarm.sim.robot.legs import ChainLeg

Floats = NDArray[np.float64]

_HEIGHT: Final = 0.75
"""Height of the hips in the stance, relative to stretched legs."""

_MARGIN: Final = 0.15
"""Distance from a joint's limits below which a stance is penalized [rad]."""

_BAND: Final = 0.06
"""Accepted deviation of candidate feet from the intended height, relative to it."""

_TURN, _SHIFT = 0.35, 0.15
"""Limits for moving all feet to one distance from the body's long axis: rotation of a hip [rad],
and shift of a foot relative to its leg's length."""


@dataclass(frozen=True, slots=True)
class Stance:
    """A stance of a robot."""

    angles: tuple[tuple[float, float, float], ...]  # of each leg's joints [rad]
    height: float  # of the highest hip above the feet [m]
    radii: tuple[float, ...]  # lateral distance of each foot from the body's long axis [m]

    @property
    def radius(self) -> float:
        return float(np.median(self.radii))


def choose_stance(legs: Sequence[ChainLeg]) -> Stance:
    """Choose a stance: feet below or next to their hips, at three quarters of the legs' reach.

    Among angles that put a foot there, prefer those at which it moves freely in all directions,
    with little torque, and away from the joints' limits. All feet get one distance from the body's
    long axis, unless that would twist legs as they are mounted: those of a round robot point
    outwards.
    """
    tried = [(angles := tried_angles(leg), leg.ends(angles)) for leg in legs]
    hips = max(leg.hip[2] for leg in legs)
    ground = hips - _HEIGHT * (hips - max(float(feet[:, 2].min()) for _, feet in tried))
    chosen = [_best(leg, *of, ground, hips - ground) for leg, of in zip(legs, tried, strict=True)]
    feet = np.array([leg.foot(angles.tolist()) for leg, angles in zip(legs, chosen, strict=True)])
    radius = float(np.median(np.abs(feet[:, 1])))
    aside = [_moved_aside(*of, radius, ground) for of in zip(legs, chosen, feet, strict=True)]
    if all(angles is not None for angles in aside):
        even = tuple(_rounded(angles) for angles in aside if angles is not None)
        return Stance(even, hips - ground, (radius,) * len(legs))
    apart = []
    for leg, angles, (x, y, _) in zip(legs, chosen, feet, strict=True):
        level = _reached(leg, angles, np.array([x, y, ground]))
        apart.append(_rounded(angles if level is None else level))
    radii = (abs(leg.foot(angles)[1]) for leg, angles in zip(legs, apart, strict=True))
    return Stance(tuple(apart), hips - ground, tuple(radii))


def _best(leg: ChainLeg, angles: Floats, feet: Floats, ground: float, height: float) -> Floats:
    near = np.abs(feet[:, 2] - ground) < _BAND * height
    if not near.any():
        raise RobotFileError(
            f"robot.urdf: joint {leg.name!r} begins a leg whose foot cannot be level"
            f" with the others: its joint limits keep it from {height:.3f} m below the highest hip,"
            " three quarters of all legs' reach; check these and where it is mounted"
        )
    angles = angles[near]
    feet, slopes = leg.feet(angles)
    length = sum(leg.lengths)
    # Freedom: volume swept by small rotations of all joints; torque: of a vertical unit force.
    freedom = np.log(np.maximum(np.abs(np.linalg.det(slopes)) / length**3, 1e-12))
    torque = (slopes[:, 2, :] ** 2).sum(axis=1) / length**2
    to_limits = np.minimum(angles - leg.limits[:, 0], leg.limits[:, 1] - angles).min(axis=1)
    tight = np.maximum(0.0, 1.0 - to_limits / _MARGIN)
    # A leg with a vertical hip axis points where it is mounted.
    ahead = np.zeros(len(feet)) if leg.is_upright else ((feet[:, 0] - leg.hip[0]) / length) ** 2
    # A hip rotated from the file's zero spreads or crosses the legs.
    spread, folded = angles[:, 0] ** 2, (angles[:, 1:] ** 2).sum(axis=1)
    worth = freedom - 20.0 * torque - 5.0 * tight - 20.0 * ahead - 40.0 * spread - 0.02 * folded
    return np.asarray(angles[int(worth.argmax())])


def _moved_aside(
    leg: ChainLeg, angles: Floats, foot: Floats, radius: float, ground: float
) -> Floats | None:
    """Return angles with the foot at the common radius; None if the mounting forbids it."""
    if leg.is_upright and abs(abs(foot[1]) - radius) > _SHIFT * sum(leg.lengths):
        return None
    # First below the hip, where most legs are at rest, else where the foot is.
    for x in (leg.hip[0], foot[0]):
        found = _reached(leg, angles, np.array([x, np.copysign(radius, foot[1]), ground]))
        if found is not None and not (leg.is_upright and abs(found[0] - angles[0]) > _TURN):
            return found
    # A hanging leg keeps its angles.
    return None if leg.is_upright else angles


def _reached(leg: ChainLeg, angles: Floats, target: Floats) -> Floats | None:
    """Return nearby angles with the foot at a target, or None if it is out of reach."""
    angles_at_target, miss = chain_angles(replace(leg, stance=angles), target[None])
    within = (angles_at_target >= leg.limits[:, 0]) & (angles_at_target <= leg.limits[:, 1])
    return np.asarray(angles_at_target[0]) if within.all() and not miss.any() else None


def _rounded(angles: Floats) -> tuple[float, float, float]:
    first, second, third = np.round(angles, 6).tolist()
    return first, second, third
