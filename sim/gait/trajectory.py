"""A scenario's desired joint angles: foot curve -> inverse kinematics -> hold -> FIR filter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sim.controllers.fixed_point import CONTROL_PERIOD
from sim.errors import UnreachablePose
from sim.gait.half_ellipse import half_ellipse
from sim.gait.inverse_kinematics import leg_angles
from sim.gait.low_pass import FirWindow, low_pass
from sim.gait.quadratic_spline import quadratic_spline
from sim.robot import Robot
from sim.robot.description import JOINTS_PER_LEG
from sim.scenario import Scenario

Floats = NDArray[np.float64]

_DECIMALS: Final = 12
"""Of angles in radians that are kept: a start pose is not coded, and must be the same anywhere."""

_CURVES: Final = {"half_ellipse": half_ellipse, "quadratic_spline": quadratic_spline}


_KEPT: Final = 64
"""Trajectories that are kept for whoever asks for the same; most have a tenth of a megabyte."""

_LONGEST_KEPT: Final = 10_000
"""Control ticks of a trajectory that is kept."""

_CHECKED_TICKS: Final = 10_000
"""Control ticks of a walk that are looked at to tell whether legs reach it: two of the longest
cycles at least, so all of a foot's path."""


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Desired angles at the control rate; arrays are read-only.

    Legs that move alike share their columns.

    Attributes:
        columns: (T, C) [rad]; row 0 is the pose at rest.
        joints: by joint its column, (J,).
        miss: largest distance by which a leg's target lies outside its reach, (L,) [m].
    """

    columns: Floats
    joints: NDArray[np.intp]
    miss: Floats

    @property
    def angles(self) -> Floats:
        """By joint, (T, J) [rad]."""
        return np.asarray(self.columns[:, self.joints])

    @property
    def start(self) -> Floats:
        """The pose at rest, (J,) [rad]."""
        return np.asarray(self.columns[0, self.joints])

    @property
    def reachable(self) -> bool:
        """Whether every target can be reached."""
        return not self.miss.any()

    def codes(self, angle_counts: float) -> NDArray[np.int32]:
        """As the controller receives them.

        Args:
            angle_counts: Code of one radian [counts/rad].

        Returns:
            (T, J) [counts].
        """
        coded = np.rint(self.columns * angle_counts).astype(np.int32)
        return np.asarray(coded.take(self.joints, axis=1))


@dataclass(frozen=True, slots=True)
class _Foot:
    """What a leg's angles depend on besides the gait. Lengths in metres.

    lateral: outward from the coxa's axis. ground: below it. phase: share of the cycle at the start.
    """

    coxa: float
    femur: float
    tibia: float
    lateral: float
    ground: float
    phase: float
    stride: float


@dataclass(frozen=True, slots=True)
class _Gait:
    """What all legs' angles depend on, as the scenario has it. ticks: of the whole walk."""

    ticks: int
    cycle_time: float
    height: float
    support_share: float
    curve: str
    backward: bool
    trajectory_rate: float
    fir_ms: int
    fir_window: FirWindow

    @classmethod
    def of(cls, scenario: Scenario) -> _Gait:
        return cls(
            ticks=n_ticks(scenario),
            cycle_time=scenario.cycle_time,
            height=scenario.height,
            support_share=scenario.support_share,
            curve=scenario.curve,
            backward=scenario.direction == "backward",
            trajectory_rate=scenario.trajectory_rate,
            fir_ms=scenario.fir_ms,
            fir_window=scenario.fir_window,
        )

    def time(self) -> Floats:
        """When what a tick asks for was planned, (T,) [s]."""
        ticks = np.arange(self.ticks)
        if self.trajectory_rate * CONTROL_PERIOD >= 1.0:
            return np.asarray(ticks * CONTROL_PERIOD)
        # Signals of a slow trajectory source are held between its updates (stepped, section 5.4).
        updates = np.floor(ticks * (CONTROL_PERIOD * self.trajectory_rate) + 1e-9)
        return np.asarray(updates / self.trajectory_rate)


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
    feet, gait = _feet(robot, scenario), _Gait.of(scenario)
    return _kept(feet, gait) if gait.ticks <= _LONGEST_KEPT else _trajectory(feet, gait)


def _feet(robot: Robot, scenario: Scenario) -> tuple[_Foot, ...]:
    legs = zip(robot.legs, robot.description.legs, robot.planned_soles(), strict=True)
    return tuple(
        _Foot(
            coxa=leg.coxa,
            femur=leg.femur,
            tibia=leg.tibia,
            lateral=scenario.radius - abs(leg.hip[1]),
            ground=scenario.hip_height - sole,
            phase=data.phase + scenario.start_phase,
            stride=scenario.stride_of(leg.side),
        )
        for leg, data, sole in legs
    )


def _trajectory(feet: tuple[_Foot, ...], gait: _Gait) -> Trajectory:
    alike = {foot: number for number, foot in enumerate(dict.fromkeys(feet))}
    time = gait.time()
    angles, misses = zip(*(_unfiltered(foot, gait, time) for foot in alike), strict=True)
    smoothed = low_pass(np.concatenate(angles, axis=1), gait.fir_ms, gait.fir_window)
    # numpy's arc functions differ in the last bit between processors.
    columns = np.round(smoothed, _DECIMALS)
    of_leg = np.array([alike[foot] for foot in feet])
    joints = np.add.outer(JOINTS_PER_LEG * of_leg, np.arange(JOINTS_PER_LEG)).ravel()
    miss = np.array(misses)[of_leg]
    for array in (columns, joints, miss):
        array.flags.writeable = False
    return Trajectory(columns, joints, miss)


_kept: Final = lru_cache(maxsize=_KEPT)(_trajectory)


def _unfiltered(foot: _Foot, gait: _Gait, time: Floats) -> tuple[Floats, float]:
    """Angles (T, 3) [rad], and the largest miss [m]."""
    forward, lift = _CURVES[gait.curve](
        np.mod(time / gait.cycle_time + foot.phase, 1.0),
        stride=foot.stride,
        height=gait.height,
        duty_factor=gait.support_share,
    )
    if gait.backward:
        forward = -forward
    lateral = np.full_like(forward, foot.lateral)
    angles, miss = leg_angles(foot, forward, lateral, lift - foot.ground)
    return angles, float(miss.max())


def require_reachable(robot: Robot, scenario: Scenario) -> None:
    """Check that a robot's legs reach a walk's feet. Takes no longer for a long walk.

    Of a walk of more than 20 s the beginning is looked at, which has all of the foot's path; later
    cycles may meet it a fraction of a control tick earlier or later.

    Args:
        robot: The robot.
        scenario: The walk.

    Raises:
        UnreachablePose: A foot's target lies outside its leg's reach; names the leg that misses by
            most.
    """
    gait = _Gait.of(scenario)
    gait = replace(gait, ticks=min(gait.ticks, _CHECKED_TICKS))
    time, feet = gait.time(), _feet(robot, scenario)
    # The filter is left out: it smooths angles, and a target is missed before.
    miss_of = {foot: _unfiltered(foot, gait, time)[1] for foot in dict.fromkeys(feet)}
    worst = max(range(len(feet)), key=lambda leg: miss_of[feet[leg]])
    if miss_of[feet[worst]] > 0.0:
        raise UnreachablePose(scenario.name, robot.legs[worst].name, miss_of[feet[worst]])
