"""A scenario's desired joint angles: foot curve -> inverse kinematics -> hold -> FIR filter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sim.controllers.fixed_point import CONTROL_PERIOD
from sim.errors import UnreachablePose
from sim.gait.half_ellipse import half_ellipse
from sim.gait.inverse_kinematics import leg_angles
from sim.gait.low_pass import low_pass
from sim.gait.quadratic_spline import quadratic_spline
from sim.robot import Robot
from sim.scenario import Scenario

Floats = NDArray[np.float64]

_DECIMALS: Final = 12
"""Of angles in radians that are kept: a start pose is not coded, and must be the same anywhere."""

_CURVES: Final = {"half_ellipse": half_ellipse, "quadratic_spline": quadratic_spline}


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Desired angles at the control rate.

    Attributes:
        angles: (T, J) [rad]; row 0 is the pose at rest.
        miss: largest distance by which a leg's target lies outside its reach, (L,) [m].
    """

    angles: Floats
    miss: Floats

    @property
    def reachable(self) -> bool:
        """Whether every target can be reached."""
        return not self.miss.any()


def n_ticks(scenario: Scenario) -> int:
    """Control ticks of a whole walk.

    Args:
        scenario: The walk.

    Returns:
        At least one.
    """
    return max(1, round(scenario.duration / CONTROL_PERIOD))


def desired_angles(robot: Robot, scenario: Scenario) -> Trajectory:
    """A whole walk's desired angles, filtered as the robot's controller receives them.

    Args:
        robot: Whose legs are planned for.
        scenario: Gait and posture.

    Returns:
        The angles, and by how much the legs miss.
    """
    ticks = np.arange(n_ticks(scenario))
    # Signals of a slow trajectory source are held between its updates (stepped, section 5.4).
    updates = np.floor(ticks * (CONTROL_PERIOD * scenario.trajectory_rate) + 1e-9)
    time = np.where(
        scenario.trajectory_rate * CONTROL_PERIOD >= 1.0,
        ticks * CONTROL_PERIOD,
        updates / scenario.trajectory_rate,
    )
    columns, misses = [], []
    legs = zip(robot.legs, robot.description.legs, robot.planned_soles(), strict=True)
    for leg, data, sole in legs:
        forward, lift = _CURVES[scenario.curve](
            np.mod(time / scenario.cycle_time + (data.phase + scenario.start_phase), 1.0),
            stride=scenario.stride_of(leg.side),
            height=scenario.height,
            duty_factor=scenario.support_share,
        )
        if scenario.direction == "backward":
            forward = -forward
        angles, miss = leg_angles(
            leg,
            forward,
            np.full_like(forward, scenario.radius - abs(leg.hip[1])),
            lift - (scenario.hip_height - sole),
        )
        columns.append(angles)
        misses.append(float(miss.max()))
    angles = low_pass(np.concatenate(columns, axis=1), scenario.fir_ms, scenario.fir_window)
    # numpy's arc functions differ in the last bit between processors.
    return Trajectory(np.round(angles, _DECIMALS), np.array(misses))


def require_reachable(robot: Robot, scenario: Scenario) -> None:
    """Check that a robot's legs reach all of a walk.

    Args:
        robot: The robot.
        scenario: The walk.

    Raises:
        UnreachablePose: A foot's target lies outside its leg's reach; names the leg that misses by
            most.
    """
    trajectory = desired_angles(robot, scenario)
    if not trajectory.reachable:
        worst = int(np.argmax(trajectory.miss))
        raise UnreachablePose(scenario.name, robot.legs[worst].name, float(trajectory.miss[worst]))
