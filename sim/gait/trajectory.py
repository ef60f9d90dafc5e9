"""A scenario's desired joint angles: foot curve -> inverse kinematics -> hold -> FIR filter.

Also the joint torques with which the legs on the ground carry the robot.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import BeyondJointLimit, UnreachablePose
from gaitswarm.sim.gait.curves import foot_curve
from gaitswarm.sim.gait.gaits import LegGait, Sway, leg_gaits
from gaitswarm.sim.gait.inverse_kinematics import chain_angles, leg_angles
from gaitswarm.sim.memory import require_room_for_scipy
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.legs import ChainLeg, KneeUpLeg, LegKinematics
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import CurveName, Scenario

T = TypeVar("T")
Feet = TypeVar("Feet")

_BLOCK: Final = 2048
"""Ticks filtered together, so that sums stay in the processor's cache."""

FirWindow = Literal["moving_average", "hamming"]
"""Of the low-pass FIR filter (thesis section 5.4, table 3.2). `hamming` is the default of Matlab's
fir1: a windowed sinc."""


def fir_gains(fir_ms: int, window: FirWindow) -> Floats:
    """Coefficients of the filter at the control rate, (n,), oldest angle first; the sum is 1."""
    order = round(fir_ms * 1e-3 / CONTROL_PERIOD)
    taps = max(1, order) if window == "moving_average" else order + 1
    # One or two symmetric coefficients are equal, and have no cut-off below Nyquist's.
    if window == "moving_average" or taps < 3:
        return np.full(taps, 1.0 / taps)
    # Slow to import, and needed only for this window.
    require_room_for_scipy()
    from scipy.signal import firwin  # noqa: PLC0415

    return np.asarray(firwin(taps, 2.0 / taps, window="hamming"))


def low_pass(angles: Floats, fir_ms: int, window: FirWindow = "moving_average") -> Floats:
    """Filter angles (T, J) at the control rate, at rest before t = 0."""
    gains = fir_gains(fir_ms, window)
    taps, ticks = len(gains), len(angles)
    padded = np.concatenate([np.repeat(angles[:1], taps - 1, axis=0), angles])
    sums = np.zeros_like(angles) if window == "hamming" else padded[:ticks].copy()
    for begin in range(0, ticks, _BLOCK):
        end = min(begin + _BLOCK, ticks)
        block = sums[begin:end]
        if window == "hamming":
            for delay, gain in enumerate(gains):
                block += padded[begin + delay : end + delay] * gain
        else:
            # Tick by tick from the oldest on: a running sum would be faster but rounds differently.
            for delay in range(1, taps):
                block += padded[begin + delay : end + delay]
    if window == "moving_average":
        sums /= taps
    return sums


_DECIMALS: Final = 12
"""Decimals of angles in radians: a start pose is not coded, and must be equal on all machines."""

Limits = tuple[tuple[float, float], ...]

_CACHE_SIZE: Final = 64
"""Number of cached trajectories; most have a tenth of a megabyte."""

_LONGEST_CACHED: Final = 10_000
"""Longest cached trajectory [control ticks]."""

_CHECKED_TICKS: Final = 10_000
"""Control ticks checked for reachability: at least two of the longest cycles, so all of a foot's
path."""


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Desired angles at the control rate, read-only; legs that move alike share their columns."""

    columns: Floats  # (T, C) [rad]; row 0 is the pose at rest
    joints: NDArray[np.intp]  # column by joint, (J,)
    miss: Floats  # largest distance by which a leg's target lies outside its reach, (L,) [m]
    excess: Floats  # largest angle by which a joint would leave its limits, (J,) [rad]

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
        return not (self.miss.any() or self.excess.any())

    def codes(self, angle_counts: float) -> NDArray[np.int32]:
        """Encode for the controller, (T, J) [counts]."""
        coded = np.rint(self.columns * angle_counts).astype(np.int32)
        return np.asarray(coded.take(self.joints, axis=1))


@dataclass(frozen=True, slots=True)
class _Foot:
    """A leg's part in the angles. limits: of the joints [rad]."""

    gait: LegGait
    limits: Limits


@dataclass(frozen=True, slots=True)
class _KneeUpFoot(_Foot):
    """Foot of a leg like the thesis's.

    lateral: outward from the coxa's axis [m]. ground: below it [m]. side: 0 if irrelevant.
    """

    lengths: tuple[float, float, float]
    lateral: float
    ground: float
    side: float

    def angles(self, forward: Floats, left: Floats | None, lift: Floats) -> tuple[Floats, Floats]:
        """Angles (T, 3) [rad], and the miss (T,) [m]."""
        lateral = np.full_like(forward, self.lateral)
        if left is not None:
            lateral += self.side * left
        return leg_angles(self.lengths, forward, lateral, lift - self.ground)


@dataclass(frozen=True, slots=True)
class _ChainFoot(_Foot):
    """Of any other leg. rest: position of the foot in the body's frame in mid-support, (3,) [m]."""

    leg: ChainLeg
    rest: tuple[float, float, float]

    def angles(self, forward: Floats, left: Floats | None, lift: Floats) -> tuple[Floats, Floats]:
        x, y, z = self.rest
        aside = np.full_like(forward, y) if left is None else y + left
        targets = np.stack([x + forward, aside, z + lift], axis=1)
        return chain_angles(self.leg, targets)


@dataclass(frozen=True, slots=True)
class _Gait:
    """The scenario's part in the angles, common to all legs. ticks: of the whole walk."""

    ticks: int
    cycle_time: float
    sway: Sway | None
    curve: CurveName
    backward: bool
    trajectory_rate: float
    fir_ms: int
    fir_window: FirWindow

    @classmethod
    def of(cls, scenario: Scenario) -> _Gait:
        return cls(
            ticks=n_ticks(scenario),
            cycle_time=scenario.cycle_time,
            sway=Sway.of(scenario),
            curve=scenario.curve,
            backward=scenario.direction == "backward",
            trajectory_rate=scenario.trajectory_rate,
            fir_ms=scenario.fir_ms,
            fir_window=scenario.fir_window,
        )

    def time(self) -> Floats:
        """Time at which a tick's target was planned, (T,) [s]."""
        ticks = np.arange(self.ticks)
        if self.trajectory_rate * CONTROL_PERIOD >= 1.0:
            return np.asarray(ticks * CONTROL_PERIOD)
        # Targets of a slow source are held between its updates (stepped, section 5.4).
        updates = np.floor(ticks * (CONTROL_PERIOD * self.trajectory_rate) + 1e-9)
        return np.asarray(updates / self.trajectory_rate)


def n_ticks(scenario: Scenario) -> int:
    return max(1, round(scenario.duration / CONTROL_PERIOD))


def desired_angles(robot: Robot, scenario: Scenario) -> Trajectory:
    """Return a whole walk's desired angles, filtered as the robot's controller receives them."""
    return _trajectory(_feet(robot, scenario), _Gait.of(scenario))


def stance_angles(robot: Robot, scenario: Scenario) -> Floats:
    """Return the angles with all feet on the ground in mid-support, (J,) [rad]."""
    rest = np.zeros(1)
    angles = [foot.angles(rest, None, rest)[0][0] for foot in _feet(robot, scenario)]
    return np.round(np.concatenate(angles), _DECIMALS)


def _feet(robot: Robot, scenario: Scenario) -> tuple[_KneeUpFoot | _ChainFoot, ...]:
    legs = zip(robot.legs, leg_gaits(robot, scenario), robot.planned_soles(), strict=True)
    hips = max(leg.hip[2] for leg in robot.legs)
    return tuple(_foot(leg, gait, scenario, sole, hips) for leg, gait, sole in legs)


def _foot(
    leg: LegKinematics, gait: LegGait, scenario: Scenario, sole: float, hips: float
) -> _KneeUpFoot | _ChainFoot:
    """hips: height of the highest hip in the body's frame [m]."""
    ground = scenario.hip_height - sole
    limits = tuple((lower, upper) for lower, upper in leg.limits.tolist())
    if isinstance(leg, ChainLeg):
        rest = (leg.stand[0], leg.side * gait.radius, hips - ground)
        return _ChainFoot(gait=gait, limits=limits, leg=leg, rest=rest)
    return _KneeUpFoot(
        gait=gait,
        limits=limits,
        lengths=leg.lengths,
        lateral=gait.radius - abs(leg.hip[1]),
        ground=ground,
        side=leg.side if scenario.sway_lateral else 0.0,
    )


def _cached_if_short(plan: Callable[[Feet, _Gait], T]) -> Callable[[Feet, _Gait], T]:
    cached = lru_cache(maxsize=_CACHE_SIZE)(plan)
    return lambda feet, gait: (cached if gait.ticks <= _LONGEST_CACHED else plan)(feet, gait)


@_cached_if_short
def _trajectory(feet: tuple[_KneeUpFoot | _ChainFoot, ...], gait: _Gait) -> Trajectory:
    alike = {foot: number for number, foot in enumerate(dict.fromkeys(feet))}
    planned = [_planned(foot, gait) for foot in alike]
    angles, misses, excesses = zip(*planned, strict=True)
    smoothed = low_pass(np.concatenate(angles, axis=1), gait.fir_ms, gait.fir_window)
    # numpy's arc functions differ in the last bit between processors.
    columns = np.round(smoothed, _DECIMALS)
    of_leg = np.array([alike[foot] for foot in feet])
    joints = np.add.outer(JOINTS_PER_LEG * of_leg, np.arange(JOINTS_PER_LEG)).ravel()
    miss, excess = np.array(misses)[of_leg], np.array(excesses)[of_leg].ravel()
    for array in (columns, joints, miss, excess):
        array.flags.writeable = False
    return Trajectory(columns, joints, miss, excess)


@_cached_if_short
def _planned(foot: _KneeUpFoot | _ChainFoot, gait: _Gait) -> tuple[Floats, float, Floats]:
    """Angles (T, 3) [rad], the largest miss [m], and by joint the largest excess (3,) [rad]."""
    cycles, leg = gait.time() / gait.cycle_time, foot.gait
    forward, lift = foot_curve(
        gait.curve,
        np.mod(cycles + leg.phase, 1.0),
        stride=leg.stride,
        height=leg.height,
        duty_factor=leg.support_share,
    )
    left = None
    if gait.sway is not None:
        # Relative to the body, the feet move in the opposite direction.
        ahead, aside = gait.sway.body(cycles)
        forward, left = forward - ahead, -aside
    if gait.backward:
        forward = -forward
    angles, miss = foot.angles(forward, left, lift)
    lower, upper = np.array(foot.limits).T
    excess = np.maximum(lower - angles.min(axis=0), angles.max(axis=0) - upper)
    return angles, float(miss.max()), np.maximum(0.0, excess)


# Cached: most jobs have the same scenarios.
@lru_cache(maxsize=_CACHE_SIZE)
def require_reachable(robot: Robot, scenario: Scenario) -> None:
    """Check that the legs reach the planned feet; takes no longer for a long walk."""
    gait = _Gait.of(scenario)
    gait = replace(gait, ticks=min(gait.ticks, _CHECKED_TICKS))
    feet = _feet(robot, scenario)
    # Without the filter, which only smooths angles.
    planned = {foot: _planned(foot, gait)[1:] for foot in dict.fromkeys(feet)}
    worst = max(range(len(feet)), key=lambda leg: planned[feet[leg]][0])
    miss, _ = planned[feet[worst]]
    if miss > 0.0:
        raise UnreachablePose(scenario.name, robot.legs[worst].name, miss)
    excess = np.concatenate([planned[foot][1] for foot in feet])
    joint = int(excess.argmax())
    if excess[joint] > 0.0:
        leg = robot.legs[joint // JOINTS_PER_LEG].name
        name = robot.joint_names[joint]
        raise BeyondJointLimit(scenario.name, leg, name, float(excess[joint]))


def carrying_torques(robot: Robot, trajectory: Trajectory, gravity: float) -> Floats:
    """Feed-forward of a walk (T, J) [N m]: the feet on the ground share the robot's weight evenly.

    tau = -J^T (0, 0, f), the static part of that of Di Carlo et al. (Dynamic locomotion in the MIT
    Cheetah 3 through convex model-predictive control, 2018); the body is level, without load.
    """
    angles = trajectory.angles
    height, slopes = np.empty((len(angles), len(robot.legs))), np.empty_like(angles)
    for number, leg in enumerate(robot.legs):
        joints = slice(JOINTS_PER_LEG * number, JOINTS_PER_LEG * (number + 1))
        height[:, number], slopes[:, joints] = _height(leg, angles[:, joints])
    lowest, highest = height.min(axis=0), height.max(axis=0)
    # The filter rounds a foot's path; 0.1 mm is more than the rounding errors of a standing robot.
    down = height <= lowest + np.maximum(0.1 * (highest - lowest), 1e-4)
    force = robot.mass * gravity / np.maximum(down.sum(axis=1), 1)
    forces = np.repeat(down * force[:, np.newaxis], JOINTS_PER_LEG, axis=1)
    # numpy's functions of angles differ in the last bit between processors.
    return np.round(-forces * slopes, 9)


def _height(leg: LegKinematics, angles: Floats) -> tuple[Floats, Floats]:
    """Height of the foot in the body's frame (T,) [m], and its derivatives by angle (T, 3) [m]."""
    if isinstance(leg, ChainLeg):
        at, slopes = leg.feet(angles)
        return at[:, 2], slopes[:, 2, :]
    assert isinstance(leg, KneeUpLeg)  # noqa: S101
    _, femur, tibia = leg.lengths
    first, both = angles[:, 1], angles[:, 1] + angles[:, 2]
    height = leg.hip[2] + femur * np.sin(first) + tibia * np.sin(both)
    outward = tibia * np.cos(both)
    turned = [np.zeros(len(angles)), femur * np.cos(first) + outward, outward]
    return height, np.stack(turned, axis=1)
