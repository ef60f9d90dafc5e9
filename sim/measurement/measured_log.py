"""Quantities measured on a walking robot (thesis table 2.2), and synchronisation of its logs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any, Final, Literal, Self

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.catalogue import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import MeasuredLogError, SimulationInputError
from gaitswarm.sim.kernel.observation import WalkLog, sensed_currents
from gaitswarm.sim.kernel.parameters import GRAVITY
from gaitswarm.sim.memory import require_room_for_scipy
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import check_reach, simulate

AXES: Final = ("x", "y", "z")
"""Of the body: forward, left, up."""

BATTERY: Final = ("battery",)

ORIGIN: Final = "origin"
SYNTHETIC: Final = "synthetic"
"""Value of `ORIGIN` in the metadata of a log that was computed instead of measured."""


class Quantity(StrEnum):
    """A row of table 2.2, by its symbol."""

    unit: str
    per: Literal["joint", "leg", "axis", "battery"]  # each of which has one channel
    column: str  # attribute of `MeasuredLog`
    meaning: str  # for headings and documentation

    DESIRED_ANGLE = "q_D", "rad", "joint", "desired_angle", "desired joint angle"
    CONTROL_VOLTAGE = "U_P", "V", "joint", "control_voltage", "control signal of the PWM amplifier"
    JOINT_ANGLE = "q", "rad", "joint", "joint_angle", "joint angle by the motor encoder"
    CURRENT = "I_M", "A", "joint", "current", "absolute motor current"
    SUPPLY = "U_S", "V", "leg", "supply", "supply voltage at the leg's board"
    POTENTIOMETER = "q_POT", "rad", "joint", "potentiometer", "joint angle behind the backlash"
    BODY_ACCELERATION = (
        "a_BODY",
        "g",
        "axis",
        "body_acceleration",
        "acceleration of the body, without gravity",
    )
    BODY_RATE = "w_BODY", "rad/s", "axis", "body_rate", "angular rate of the body by the gyroscope"
    BATTERY_CURRENT = "I_B", "A", "battery", "battery_current", "current of the battery"
    TORQUE = "tau_M", "N m", "joint", "torque", "torque of the actuator by its current"

    def __new__(
        cls,
        symbol: str,
        unit: str,
        per: Literal["joint", "leg", "axis", "battery"],
        column: str,
        meaning: str,
    ) -> Self:
        quantity = str.__new__(cls, symbol)
        quantity._value_ = symbol
        quantity.unit, quantity.per = unit, per
        quantity.column, quantity.meaning = column, meaning
        return quantity

    @property
    def digital(self) -> bool:
        """Whether the robot computes it, instead of measuring it."""
        return self in (Quantity.DESIRED_ANGLE, Quantity.CONTROL_VOLTAGE)

    @property
    def optional(self) -> bool:
        """Whether it is supplementary in table 2.2, or not in it."""
        return self in (
            Quantity.POTENTIOMETER,
            Quantity.BODY_ACCELERATION,
            Quantity.BODY_RATE,
            Quantity.BATTERY_CURRENT,
            Quantity.TORQUE,
        )


def channels_by_kind(
    joints: tuple[str, ...], legs: tuple[str, ...]
) -> dict[Literal["joint", "leg", "axis", "battery"], tuple[str, ...]]:
    return {"joint": joints, "leg": legs, "axis": AXES, "battery": BATTERY}


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredLog:
    """A log with the quantities of table 2.2, measured, simulated or synthetic; T rows.

    Raises SimulationInputError if shapes do not match.
    """

    joints: tuple[str, ...]  # J names in the robot's order, three joints per leg
    legs: tuple[str, ...]  # L names in the robot's order
    time: Floats  # from any start, one row per 2 ms, (T,) [s]
    desired_angle: Floats  # (T, J) [rad]
    control_voltage: Floats | None  # (T, J) [V]; None of torque-controlled robots
    joint_angle: Floats  # (T, J) [rad]
    current: Floats  # absolute, (T, J) [A]
    supply: Floats | None  # (T, L) [V]; None if not measured, of torque-controlled robots
    potentiometer_joints: tuple[str, ...] = ()  # names of the K joints with a potentiometer
    potentiometer: Floats | None = None  # (T, K) [rad]; None if K is 0
    # in the body's frame, without gravity, (T, 3) [g]; None if not measured
    body_acceleration: Floats | None = None
    body_rate: Floats | None = None  # in the body's frame, (T, 3) [rad/s]; None if not measured
    # discharging is positive, (T, 1) [A]; None if not measured
    battery_current: Floats | None = None
    # of torque-controlled actuators, at the joint, signed, before friction, (T, J) [N m]; None if
    # not measured
    torque: Floats | None = None
    metadata: Mapping[str, str] = field(default_factory=dict)  # of the file, by name

    def __post_init__(self) -> None:
        for quantity in Quantity:
            expected = (len(self.time), len(self.channels(quantity)))
            if self.values(quantity).shape != expected:
                raise SimulationInputError(
                    f"{quantity}: shape {self.values(quantity).shape} is not {expected}"
                )
        if len(self.joints) != JOINTS_PER_LEG * len(self.legs):
            raise SimulationInputError(
                f"joints: {len(self.joints)} for {len(self.legs)} legs, each of which must have"
                f" {JOINTS_PER_LEG}"
            )
        for joint in self.potentiometer_joints:
            if joint not in self.joints:
                raise SimulationInputError(f"q_POT: no joint {joint!r}")

    @property
    def synthetic(self) -> bool:
        """Whether the log was computed: such a log validates nothing but the tools."""
        return self.metadata.get(ORIGIN) == SYNTHETIC

    def channels(self, quantity: Quantity) -> tuple[str, ...]:
        if quantity is Quantity.POTENTIOMETER:
            return self.potentiometer_joints
        if getattr(self, quantity.column) is None:
            return ()
        return channels_by_kind(self.joints, self.legs)[quantity.per]

    def values(self, quantity: Quantity) -> Floats:
        """A quantity's columns (T, channels), in its unit."""
        columns: Floats | None = getattr(self, quantity.column)
        return np.empty((len(self.time), 0)) if columns is None else columns

    def link_of(self, joint: str) -> int:
        """Number of the leg's link that a joint moves."""
        return self.joints.index(joint) % JOINTS_PER_LEG + 1

    def mapped(self, function: Callable[[Floats], Floats]) -> MeasuredLog:
        """Return the log with other columns."""
        columns: dict[str, Any] = {
            quantity.column: function(column)
            for quantity in Quantity
            if (column := getattr(self, quantity.column)) is not None
        }
        return replace(self, time=function(self.time), **columns)

    def rows(self, start: int, stop: int) -> MeasuredLog:
        return self.mapped(lambda column: column[start:stop])


def simulated_log(robot: Robot, walk: WalkLog) -> MeasuredLog:
    """A simulated walk as logged by the robot's instruments, without their errors."""
    if not np.isfinite(walk.current).all():
        raise SimulationInputError("a walk that ended early cannot be compared")
    joints, legs = robot.joint_names, tuple(leg.name for leg in robot.legs)
    return MeasuredLog(
        joints=joints,
        legs=legs,
        time=walk.time,
        desired_angle=walk.desired_angle,
        control_voltage=None if robot.is_torque_controlled else walk.voltage,
        joint_angle=walk.motor_angle,
        current=sensed_currents(robot, walk.current, walk.voltage),
        supply=np.repeat(walk.supply[:, None], len(legs), axis=1),
        potentiometer_joints=joints,
        potentiometer=walk.joint_angle,
        body_acceleration=walk.body_acceleration() / GRAVITY,
        body_rate=walk.base_velocity[:, 3:],
        battery_current=((walk.voltage * walk.current).sum(axis=1) / walk.supply)[:, None],
        torque=walk.current * robot.actuators().torque if robot.is_torque_controlled else None,
        metadata={ORIGIN: "simulated", "robot": robot.description.name},
    )


@dataclass(frozen=True, slots=True)
class MeasuredWalk:
    """The walk of a measured log: a design in a scenario of a robot, within its legs' reach."""

    robot: Robot
    scenario: Scenario
    controller: str
    design: Mapping[str, float]  # of the controller and the gait, by variable
    cycle_time: float  # the design's, if it has one, else the scenario's [s]

    @classmethod
    def of(
        cls, robot: Robot, scenario: Scenario, controller: str, design: Mapping[str, float]
    ) -> MeasuredWalk:
        """Create the walk after checking that the legs reach all of it."""
        gait = {name: value for name, value in design.items() if name in GAIT_CATALOGUE}
        walked = with_gait(scenario, gait)
        check_reach(walked, [], [], robot=robot)
        return cls(robot, scenario, controller, design, walked.cycle_time)

    def simulated(self) -> MeasuredLog:
        """Simulate the walk as logged by the robot's instruments, without their errors."""
        designs = np.array([list(self.design.values())], dtype=np.float64)
        result = simulate(
            self.scenario, self.controller, list(self.design), designs, robot=self.robot, log=True
        )
        status, log = Status(int(result.outcome.statuses[0])), result.logs[0]
        if log is None or status not in (Status.OK, Status.STALLED):
            raise SimulationInputError(f"the simulated walk cannot be compared: {status.phrase}")
        return simulated_log(self.robot, log)


_TIE: Final = 1e-6
"""Relative difference of correlations up to which lags count as equally good."""


@dataclass(frozen=True, slots=True, eq=False)
class Synchronised:
    """The same whole cycles of a walk, measured and simulated, with the same rows."""

    measured: MeasuredLog
    simulated: MeasuredLog
    lag: int  # rows by which the walk begins later in the measured log than in the simulated one
    # number of whole walking cycles, the last of the common part, as a walk starts at rest
    cycles: int
    cycle_time: float  # [s]
    correlation: float  # of the desired angles over the common part, 1 for equal gaits

    @property
    def lag_seconds(self) -> float:
        """`lag` as time [s]."""
        return self.lag * CONTROL_PERIOD


def synchronise(measured: MeasuredLog, simulated: MeasuredLog, cycle_time: float) -> Synchronised:
    """Find the lag between two logs and trim both to their common whole cycles."""
    if measured.joints != simulated.joints:
        raise MeasuredLogError("the two logs have different joints")
    cycle = round(cycle_time / CONTROL_PERIOD)
    shortest = min(len(measured.time), len(simulated.time))
    if shortest < cycle:
        raise MeasuredLogError(
            f"{shortest * CONTROL_PERIOD:g} s are shorter than a walking cycle of {cycle_time:g} s"
        )
    lag, correlation = find_lag(measured.desired_angle, simulated.desired_angle, cycle)
    first, common = _common(lag, len(measured.time), len(simulated.time))
    # A cycle need not be a whole number of rows.
    cycles = int((common + 0.5) * CONTROL_PERIOD / cycle_time + 1e-9)
    kept = min(common, round(cycles * cycle_time / CONTROL_PERIOD))
    end = first + common
    return Synchronised(
        measured=measured.rows(end - kept, end),
        simulated=simulated.rows(end - kept - lag, end - lag),
        lag=lag,
        cycles=cycles,
        cycle_time=cycle_time,
        correlation=correlation,
    )


def find_lag(measured: Floats, simulated: Floats, cycle: int) -> tuple[int, float]:
    """Return the lag k [rows] with measured[t + k] = simulated[t], and the correlation there."""
    mean = simulated.mean(axis=0)
    x, y = measured - mean, simulated - mean
    if not (np.ptp(x, axis=0).any() and np.ptp(y, axis=0).any()):
        raise MeasuredLogError("the desired angles are constant and cannot be aligned")
    lags = np.arange(-(len(y) - 1), len(x))
    # Rows of x in the overlap are [start, stop), those of y [start - k, stop - k).
    start, stop = np.maximum(lags, 0), np.minimum(len(x), len(y) + lags)
    long_enough = stop - start >= cycle
    lags, start, stop = lags[long_enough], start[long_enough], stop[long_enough]
    product = _cross_correlation(x, y)[lags + len(y) - 1]
    energy_x, energy_y = _cumulated_energy(x), _cumulated_energy(y)
    of_x = energy_x[stop] - energy_x[start]
    of_y = energy_y[stop - lags] - energy_y[start - lags]
    best = np.flatnonzero(product >= product.max() - _TIE * abs(product.max()))
    coarse = lags[best[np.argmin(np.abs(lags[best]))]]
    near = np.flatnonzero(np.abs(lags - coarse) <= cycle // 4)
    difference = (of_x + of_y - 2.0 * product)[near] / (stop - start)[near]
    chosen = near[np.argmin(difference)]
    scale = float(np.sqrt(of_x[chosen] * of_y[chosen]))
    return int(lags[chosen]), float(product[chosen]) / scale if scale > 0.0 else 0.0


def _cross_correlation(x: Floats, y: Floats) -> Floats:
    """sum over rows and columns of x[t + k] y[t], for k from -(len(y) - 1) to len(x) - 1."""
    # Slow to import, and not needed to show recordings.
    require_room_for_scipy()
    from scipy.signal import fftconvolve  # noqa: PLC0415

    product: Floats = fftconvolve(x, y[::-1], axes=0).sum(axis=1)
    return product


def _cumulated_energy(x: Floats) -> Floats:
    return np.concatenate([[0.0], np.cumsum((x**2).sum(axis=1))])


def _common(lag: int, measured: int, simulated: int) -> tuple[int, int]:
    """First row of the overlap in the measured log, and its length."""
    first = max(lag, 0)
    return first, min(measured, simulated + lag) - first
