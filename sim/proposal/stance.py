"""Stance of a robot of unknown design, and walks scaled by its height."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from pydantic import ValidationError

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import BeyondJointLimit, RobotFileError, UnreachablePose
from gaitswarm.sim.gait.gaits import GAITS, lags_of
from gaitswarm.sim.gait.inverse_kinematics import chain_angles
from gaitswarm.sim.gait.trajectory import require_reachable
from gaitswarm.sim.input import message_of
from gaitswarm.sim.kernel.parameters import GRAVITY
from gaitswarm.sim.proposal.legs import tried
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario

HEIGHTS: Final = (0.75, 0.7, 0.8, 0.65, 0.85, 0.6, 0.9)
"""Heights of the hips in a stance, relative to stretched legs, in the order of trial."""

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


class NoStance(RobotFileError):
    """Joint limits rule out a stance of some height."""


def choose_stance(legs: Sequence[ChainLeg], height: float = HEIGHTS[0]) -> Stance:
    """Choose a stance: feet below or next to their hips, at a share of the legs' reach.

    Among angles that put a foot there, prefer those at which it moves freely in all directions,
    with little torque, and away from the joints' limits. All feet get one distance from the body's
    long axis, unless that would twist legs as they are mounted: those of a round robot point
    outwards.
    """
    grids = [tried(leg) for leg in legs]
    hips = max(leg.hip[2] for leg in legs)
    ground = hips - height * (hips - max(float(feet[:, 2].min()) for _, feet in grids))
    middle = np.mean([leg.hip for leg in legs], axis=0)
    chosen = [
        _best(leg, *of, ground, hips - ground, middle) for leg, of in zip(legs, grids, strict=True)
    ]
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


def _best(
    leg: ChainLeg, angles: Floats, feet: Floats, ground: float, height: float, middle: Floats
) -> Floats:
    """middle: of the hips [m]."""
    near = np.abs(feet[:, 2] - ground) < _BAND * height
    if not near.any():
        raise NoStance(
            f"robot.urdf: joint {leg.name!r} begins a leg whose foot cannot be level"
            f" with the others: its joint limits keep it from {height:.3f} m below the highest"
            " hip; check these and where it is mounted"
        )
    angles = angles[near]
    feet, slopes = leg.feet(angles)
    length = sum(leg.lengths)
    # Freedom: volume swept by small rotations of all joints; torque: of a vertical unit force.
    freedom = np.log(np.maximum(np.abs(np.linalg.det(slopes)) / length**3, 1e-12))
    torque = (slopes[:, 2, :] ** 2).sum(axis=1) / length**2
    to_limits = np.minimum(angles - leg.limits[:, 0], leg.limits[:, 1] - angles).min(axis=1)
    tight = np.maximum(0.0, 1.0 - to_limits / _MARGIN)
    reach = (feet - leg.hip) / length
    if leg.is_upright:
        # A leg with a vertical hip axis points where it is mounted, but not below the body.
        mounted = (leg.hip - middle)[:2]
        astray = np.minimum(reach[:, :2] @ mounted / max(math.hypot(*mounted), 1e-9), 0.0)
    else:
        astray = reach[:, 0]
    # A hip rotated from the file's zero spreads or crosses the legs.
    spread, folded = angles[:, 0] ** 2, (angles[:, 1:] ** 2).sum(axis=1)
    worth = freedom - 20.0 * torque - 5.0 * tight - 20.0 * astray**2 - 40.0 * spread - 0.02 * folded
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


_WALKS: Final = {"slow": (0.9, 0.25), "fast": (0.6, 0.35)}
"""Cycle time relative to a pendulum of the hips' height, stride relative to that height; for robots
that stand on half their legs, at least three."""

_TIPPING_WALKS: Final = {"slow": (0.4, 0.2), "fast": (0.4, 0.35)}
"""The same for robots with fewer legs. While half of these swing, the body tips about the line
between the others, by a factor e in sqrt(height/gravity), 0.16 of the pendulum's time: a swing of
0.4 of the cycle ends by then."""

_LIFT: Final = 0.2
"""Height of the swing relative to the hips' height."""

_DUTY: Final = 0.6

_SHARES: Final = (1.0, 0.85, 0.7, 0.55, 0.4, 0.25)
"""Shares of stride and lift to try for legs of short reach."""

_SAME: Final = 1e-4
"""Difference of two feet's lateral distances that counts as zero [m]."""


def alternating_phases(legs: Sequence[ChainLeg]) -> list[float]:
    """Return phases of a gait in which neighbours alternate: trot on four legs, tripod on six."""
    return [(1.0 - lag) % 1.0 for lag in lags_of(GAITS["alternating"], legs)]


def propose_scenarios(stance: Stance, sole: float, names: Sequence[str]) -> list[dict[str, Any]]:
    """Propose a slow and a fast scenario on level ground, for soles of a length [m]."""
    height = stance.height + sole
    walks = _WALKS if len(names) // 2 >= 3 else _TIPPING_WALKS
    own = {
        f"radius[{name}]": round(radius, 4)
        for name, radius in zip(names, stance.radii, strict=True)
        # A foot on the body's long axis has no radius.
        if radius > _SAME and abs(radius - stance.radius) > _SAME
    }
    pendulum = 2.0 * math.pi * math.sqrt(height / GRAVITY)
    return [
        {
            "name": name,
            "cycle_time": round(max(0.2, cycle * pendulum), 2),
            "radius": round(stance.radius, 4),
            "hip_height": round(height, 4),
            "stride": round(stride * height, 4),
            "height": round(_LIFT * height, 4),
            "duty_factor": _DUTY,
            **({"by_group": own} if own else {}),
        }
        for name, (cycle, stride) in walks.items()
    ]


def walk_within_reach(robot: Robot, values: Mapping[str, Any]) -> tuple[dict[str, Any], str]:
    refused: UnreachablePose | BeyondJointLimit | None = None
    for share in _SHARES:
        steps = {name: round(share * values[name], 4) for name in ("stride", "height")}
        try:
            require_reachable(robot, walk_of_robot({**values, **steps}, "robot.urdf"))
        except (UnreachablePose, BeyondJointLimit) as error:
            refused = error
            continue
        note = f"the walk {values['name']!r} has {share:.0%} of the usual stride and lift, as legs"
        return {**values, **steps}, "" if share == 1.0 else f"{note} reach no further"
    raise NoStance(_no_room(robot, refused))


def _no_room(robot: Robot, refused: UnreachablePose | BeyondJointLimit | None) -> str:
    leg = next(leg for leg in robot.description.legs if refused and leg.name == refused.leg)
    if isinstance(refused, BeyondJointLimit):
        joint, mend = refused.joint, "this joint's limits"
    else:
        joint, mend = leg.joints[0], "the limits and lengths of the leg that it begins"
    return (
        f"robot.urdf: joint {joint!r}: legs cannot step around their stance,"
        f" not even with a quarter of the usual length: {refused.reason if refused else ''}; check"
        f" {mend}"
    )


def walk_of_robot(values: Mapping[str, Any], file: str) -> Scenario:
    try:
        return Scenario.model_validate(dict(values))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        if not first["loc"]:
            problem = message_of(first)
        else:
            problem = (
                f"a walk of this robot has a {first['loc'][0]} of {first['input']:.4g}, which"
                f" {first['msg'].removeprefix('Input ')}"
            )
        raise RobotFileError(
            f"{file}: {problem}; lengths are in metres: check those of the legs, the stance and"
            " contact.sole"
        ) from error
