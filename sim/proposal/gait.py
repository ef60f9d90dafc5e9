"""Phases and walks for a robot of unknown design, scaled by how it swings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from pydantic import ValidationError

from sim.errors import RobotFileError
from sim.gait.gaits import GAITS, lags_of
from sim.proposal.drive import GRAVITY
from sim.proposal.stance import Stance
from sim.robot.legs import ChainLeg
from sim.scenario import Scenario

_WALKS: Final = {"slow": (0.9, 0.25), "fast": (0.6, 0.35)}
"""Cycle time in units of a pendulum's of the hips' height, stride in units of the height; of robots
that half their legs hold upright, which are three and more."""

_TIPPING_WALKS: Final = {"slow": (0.4, 0.2), "fast": (0.4, 0.35)}
"""The same of robots with fewer legs. While half of these swing, the body tips about the line
between the others, by a factor e in sqrt(height/gravity), 0.16 of the pendulum's time: a swing of
0.4 of the cycle ends by then."""

_LIFT: Final = 0.2
"""Height of the swing in units of the hips' height."""

_DUTY: Final = 0.6


def alternating_phases(legs: Sequence[ChainLeg]) -> list[float]:
    """Phases of a gait in which neighbours alternate: trot on four legs, tripod on six.

    Args:
        legs: Of the robot.

    Returns:
        By leg the start of its support, as a share of the cycle.
    """
    return [(1.0 - lag) % 1.0 for lag in lags_of(GAITS["alternating"], legs)]


def propose_scenarios(stance: Stance, sole: float, legs: int) -> list[dict[str, Any]]:
    """A slow and a fast walk on level ground.

    Args:
        stance: Of the robot.
        sole: Length of the soles [m].
        legs: How many it has.

    Returns:
        Scenarios, as a job has them.
    """
    height = stance.height + sole
    walks = _WALKS if legs // 2 >= 3 else _TIPPING_WALKS
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
        }
        for name, (cycle, stride) in walks.items()
    ]


def walk_of_robot(values: Mapping[str, Any], file: str) -> Scenario:
    """A scenario whose lengths are a robot's own.

    Args:
        values: Of the scenario's fields.
        file: Of the robot, that the lengths come from.

    Returns:
        The scenario.

    Raises:
        RobotFileError: The robot is larger than scenarios may be, or its feet are over its hips;
            names file and field.
    """
    try:
        return Scenario.model_validate(dict(values))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = str(first["loc"][0]) if first["loc"] else "scenario"
        raise RobotFileError(
            f"{file}: a walk of this robot has a {field} of {first['input']:.4g}, which"
            f" {first['msg'].removeprefix('Input ')}; lengths are metres: look at those of the"
            " legs, at the stance and at contact.sole"
        ) from error
