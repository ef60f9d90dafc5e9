"""A scenario's desired joint angles: foot curve -> inverse kinematics -> hold -> FIR filter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import BeyondJointLimit, UnreachablePose
from gaitswarm.sim.gait.cycloid import cycloid
from gaitswarm.sim.gait.gaits import LegGait, Sway, leg_gaits
from gaitswarm.sim.gait.half_ellipse import half_ellipse
from gaitswarm.sim.gait.inverse_kinematics import chain_angles, leg_angles
from gaitswarm.sim.gait.quadratic_spline import quadratic_spline
from gaitswarm.sim.memory import require_room_for_scipy
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.legs import ChainLeg, LegKinematics
from gaitswarm.sim.scenario import Scenario

Floats = NDArray[np.float64]

_BLOCK: Final = 2048
"""Ticks that are filtered together: their sums stay in the processor's cache, however long a walk
is."""

FirWindow = Literal["moving_average", "hamming"]
"""`hamming` is the default of Matlab's fir1: a windowed sinc."""


def fir_gains(fir_ms: int, window: FirWindow) -> Floats:
    """Coefficients of the filter at the control rate; their sum, the gain at 0 Hz, is 1.

    Args:
        fir_ms: Length of the filter [ms].
        window: `moving_average`: equal coefficients, one a control period. `hamming`: as
            fir1(order, cut-off), order being the number of control periods, so that the delay is
            half of the length. The cut-off is one over the number of coefficients times the
            control period: the main lobe of the ideal low-pass then just fills the filter.

    Returns:
        (n,), oldest angle first.
    """
    order = round(fir_ms * 1e-3 / CONTROL_PERIOD)
    taps = max(1, order) if window == "moving_average" else order + 1
    # One or two coefficients that are symmetric are equal, and have no cut-off below Nyquist's.
    if window == "moving_average" or taps < 3:
        return np.full(taps, 1.0 / taps)
    # Slow to import, and only for this window.
    require_room_for_scipy()
    from scipy.signal import firwin  # noqa: PLC0415

    return np.asarray(firwin(taps, 2.0 / taps, window="hamming"))


def low_pass(angles: Floats, fir_ms: int, window: FirWindow = "moving_average") -> Floats:
    """Filtered angles, at rest before t = 0.

    Args:
        angles: At the control rate, (T, J).
        fir_ms: Length of the filter [ms].

    Returns:
        (T, J).
    """
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
            # Tick by tick from the oldest on: a running sum would be faster still, but rounds
            # otherwise.
            for delay in range(1, taps):
                block += padded[begin + delay : end + delay]
    if window == "moving_average":
        sums /= taps
    return sums


_DECIMALS: Final = 12
"""Of angles in radians that are kept: a start pose is not coded, and must be the same anywhere."""

_CURVES: Final = {
    "half_ellipse": half_ellipse,
    "quadratic_spline": quadratic_spline,
    "cycloid": cycloid,
}


Limits = tuple[tuple[float, float], ...]

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
        excess: largest angle by which a joint would leave its limits, (J,) [rad].
    """

    columns: Floats
    joints: NDArray[np.intp]
    miss: Floats
    excess: Floats

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
        """Whether every target can be reached within the joints' limits."""
        return not (self.miss.any() or self.excess.any())

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
    """What any leg's angles depend on besides what all legs have in common.

    limits: of the joints [rad].
    """

    gait: LegGait
    limits: Limits


@dataclass(frozen=True, slots=True)
class _KneeUpFoot(_Foot):
    """Of a leg as the thesis's. lengths: of its links. lateral: outward from the coxa's axis.
    ground: below it [m]. side: of the leg, 0 if it makes no difference.
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
    """Of any other leg. rest: where the foot is in the body's frame in mid-support, (3,) [m]."""

    leg: ChainLeg
    rest: tuple[float, float, float]

    def angles(self, forward: Floats, left: Floats | None, lift: Floats) -> tuple[Floats, Floats]:
        """Angles (T, 3) [rad], and the miss (T,) [m]."""
        x, y, z = self.rest
        aside = np.full_like(forward, y) if left is None else y + left
        targets = np.stack([x + forward, aside, z + lift], axis=1)
        return chain_angles(self.leg, targets)


@dataclass(frozen=True, slots=True)
class _Gait:
    """What all legs have in common, as the scenario has it. ticks: of the whole walk."""

    ticks: int
    cycle_time: float
    sway: Sway | None
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
            sway=Sway.of(scenario),
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
    """Control ticks of a whole walk."""
    return max(1, round(scenario.duration / CONTROL_PERIOD))


def desired_angles(robot: Robot, scenario: Scenario) -> Trajectory:
    """A whole walk's desired angles, filtered as the robot's controller receives them."""
    feet, gait = _feet(robot, scenario), _Gait.of(scenario)
    return _kept(feet, gait) if gait.ticks <= _LONGEST_KEPT else _trajectory(feet, gait)


def _feet(robot: Robot, scenario: Scenario) -> tuple[_KneeUpFoot | _ChainFoot, ...]:
    legs = zip(robot.legs, leg_gaits(robot, scenario), robot.planned_soles(), strict=True)
    hips = max(leg.hip[2] for leg in robot.legs)
    return tuple(_foot(leg, gait, scenario, sole, hips) for leg, gait, sole in legs)


def _foot(
    leg: LegKinematics, gait: LegGait, scenario: Scenario, sole: float, hips: float
) -> _KneeUpFoot | _ChainFoot:
    """hips: height of the highest one in the body's frame [m]."""
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


_kept: Final = lru_cache(maxsize=_KEPT)(_trajectory)


def _planned(foot: _KneeUpFoot | _ChainFoot, gait: _Gait) -> tuple[Floats, float, Floats]:
    """As `_unfiltered`: whether a walk is in reach is asked for before it is walked."""
    plan = _unfiltered if gait.ticks <= _LONGEST_KEPT else _unfiltered.__wrapped__
    return plan(foot, gait)


@lru_cache(maxsize=_KEPT)
def _unfiltered(foot: _KneeUpFoot | _ChainFoot, gait: _Gait) -> tuple[Floats, float, Floats]:
    """Angles (T, 3) [rad], the largest miss [m], and by joint the largest excess (3,) [rad]."""
    cycles, own = gait.time() / gait.cycle_time, foot.gait
    forward, lift = _CURVES[gait.curve](
        np.mod(cycles + own.phase, 1.0),
        stride=own.stride,
        height=own.height,
        duty_factor=own.support_share,
    )
    left = None
    if gait.sway is not None:
        # Seen from the body, the feet go the other way.
        ahead, aside = gait.sway.body(cycles)
        forward, left = forward - ahead, -aside
    if gait.backward:
        forward = -forward
    angles, miss = foot.angles(forward, left, lift)
    lower, upper = np.array(foot.limits).T
    excess = np.maximum(lower - angles.min(axis=0), angles.max(axis=0) - upper)
    return angles, float(miss.max()), np.maximum(0.0, excess)


def require_reachable(robot: Robot, scenario: Scenario) -> None:
    """Check that a robot's legs reach a walk's feet. Takes no longer for a long walk.

    Of a walk of more than 20 s the beginning is looked at, which has all of the foot's path; later
    cycles may meet it a fraction of a control tick earlier or later.
    """
    _check_reach(robot, scenario)


@lru_cache(maxsize=_KEPT)
def _check_reach(robot: Robot, scenario: Scenario) -> None:
    """`require_reachable`, which every job asks for of the scenarios that most jobs have."""
    gait = _Gait.of(scenario)
    gait = replace(gait, ticks=min(gait.ticks, _CHECKED_TICKS))
    feet = _feet(robot, scenario)
    # The filter is left out: it smooths angles, and a target is missed before.
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
