"""What every leg does of a gait: when it stands, how far and how high it steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.gait.gaits import phases_of
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.robot.leg_groups import values_by_leg
from gaitswarm.sim.scenario import BY_LEG_GROUP, Scenario
from gaitswarm.sim.variables import split_name

Floats = NDArray[np.float64]

_NONE: Final[dict[int, float]] = {}


@dataclass(frozen=True, slots=True)
class LegGait:
    """One leg's part of a gait.

    Attributes:
        phase: share of the cycle since the start of its support when the walk begins, 0 or more.
        support_share: support's share of the cycle [1].
        stride: length of the support, with the scenario's turn [m].
        height: of the swing [m].
        radius: lateral distance of the foot from the body's long axis [m].
    """

    phase: float
    support_share: float
    stride: float
    height: float
    radius: float


@dataclass(frozen=True, slots=True)
class Sway:
    """How the body moves beside its way, while the feet keep their places on the ground.

    Attributes:
        lateral: amplitude to the left and right, once a cycle [m].
        longitudinal: amplitude along the way, twice a cycle [m].
        begin: share of the cycle at the start of the walk since the body was furthest left.
    """

    lateral: float
    longitudinal: float
    begin: float

    @classmethod
    def of(cls, scenario: Scenario) -> Sway | None:
        """The sway of a scenario's body."""
        if not scenario.sway_lateral and not scenario.sway_longitudinal:
            return None
        begin = scenario.start_phase - scenario.sway_phase
        return cls(scenario.sway_lateral, scenario.sway_longitudinal, begin)

    def body(self, cycles: Floats) -> tuple[Floats, Floats]:
        """Where the body is, seen from where it would be.

        Args:
            cycles: Time in cycles, (T,).

        Returns:
            Along the way and to the left, (T,) each [m].
        """
        angle = 2.0 * np.pi * (cycles + self.begin)
        # Forward while a left hind leg steps, back while the left front leg does: a lying eight.
        return -self.longitudinal * np.sin(2.0 * angle), self.lateral * np.cos(angle)


def leg_gaits(robot: Robot, scenario: Scenario) -> tuple[LegGait, ...]:
    """What every leg of a robot does in a scenario."""
    own = _by_parameter(robot, scenario)
    strides, heights = own.get("stride", _NONE), own.get("height", _NONE)
    duties, begins = own.get("duty_factor", _NONE), own.get("start_phase", _NONE)
    radii = own.get("radius", _NONE)
    return tuple(
        LegGait(
            phase=phase + begins.get(k, scenario.start_phase),
            support_share=scenario.support_share_of(duties.get(k, scenario.duty_factor)),
            stride=scenario.stride_of(leg.side, strides.get(k)),
            height=heights.get(k, scenario.height),
            radius=radii.get(k, scenario.radius),
        )
        for k, (leg, phase) in enumerate(zip(robot.legs, phases_of(robot, scenario), strict=True))
    )


def _by_parameter(robot: Robot, scenario: Scenario) -> dict[str, dict[int, float]]:
    """Values of legs whose groups have some of their own, by parameter and leg."""
    of_groups: dict[str, dict[str, float]] = {}
    for name, value in (scenario.by_group or {}).items():
        parameter, group = split_name(name)
        of_groups.setdefault(parameter, {})[str(group)] = value
    return {
        parameter: values_by_leg(robot, of_groups[parameter], parameter)
        for parameter in BY_LEG_GROUP
        if parameter in of_groups
    }


def supporting(gaits: Sequence[LegGait], cycles: Floats) -> NDArray[np.bool_]:
    """Which feet stand by plan.

    Args:
        cycles: Time since the start in cycles, (T,).

    Returns:
        (T, L).
    """
    phases = np.array([gait.phase for gait in gaits])
    shares = np.array([gait.support_share for gait in gaits])
    return np.asarray(np.mod(cycles[:, None] + phases, 1.0) < shares)
