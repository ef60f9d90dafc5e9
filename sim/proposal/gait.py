"""Proposed phases and scenarios, scaled by a robot's height."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from pydantic import ValidationError

from gaitswarm.sim.errors import BeyondJointLimit, RobotFileError, UnreachablePose
from gaitswarm.sim.gait.gaits import GAITS, lags_of
from gaitswarm.sim.gait.trajectory import require_reachable
from gaitswarm.sim.input import message_of
from gaitswarm.sim.kernel.parameters import GRAVITY
from gaitswarm.sim.proposal.stance import Stance
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.scenario import Scenario

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
    raise RobotFileError(_no_room(robot, refused))


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
