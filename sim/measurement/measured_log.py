"""Quantities measured on a walking robot (thesis table 2.2), 500 rows per second, and the walk."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait_variables import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.kernel.observation import WalkLog, sensed_currents
from gaitswarm.sim.kernel.parameters import GRAVITY
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import check_reach, simulate

Floats = NDArray[np.float64]

AXES: Final = ("x", "y", "z")
"""Of the body: forward, left, up."""

ORIGIN: Final = "origin"
SYNTHETIC: Final = "synthetic"
"""Value of `ORIGIN` in the metadata of a log that was computed instead of measured."""


class Quantity(StrEnum):
    """A row of table 2.2, by its symbol."""

    DESIRED_ANGLE = "q_D"
    CONTROL_VOLTAGE = "U_P"
    JOINT_ANGLE = "q"
    CURRENT = "I_M"
    SUPPLY = "U_S"
    POTENTIOMETER = "q_POT"
    BODY_ACCELERATION = "a_BODY"

    @property
    def unit(self) -> str:
        return _FACTS[self].unit

    @property
    def per(self) -> Literal["joint", "leg", "axis"]:
        """Each of these has one channel."""
        return _FACTS[self].per

    @property
    def meaning(self) -> str:
        """For headings and documentation."""
        return _FACTS[self].meaning

    @property
    def optional(self) -> bool:
        """Whether it is supplementary in table 2.2."""
        return self in (Quantity.POTENTIOMETER, Quantity.BODY_ACCELERATION)


class _Facts(NamedTuple):
    unit: str
    per: Literal["joint", "leg", "axis"]
    column: str
    meaning: str


_FACTS: Final = {
    Quantity.DESIRED_ANGLE: _Facts("rad", "joint", "desired_angle", "desired joint angle"),
    Quantity.CONTROL_VOLTAGE: _Facts(
        "V", "joint", "control_voltage", "control signal of the PWM amplifier"
    ),
    Quantity.JOINT_ANGLE: _Facts("rad", "joint", "joint_angle", "joint angle by the motor encoder"),
    Quantity.CURRENT: _Facts("A", "joint", "current", "absolute motor current"),
    Quantity.SUPPLY: _Facts("V", "leg", "supply", "supply voltage at the leg's board"),
    Quantity.POTENTIOMETER: _Facts(
        "rad", "joint", "potentiometer", "joint angle behind the backlash"
    ),
    Quantity.BODY_ACCELERATION: _Facts(
        "g", "axis", "body_acceleration", "acceleration of the body, without gravity"
    ),
}

_COLUMNS: Final = tuple(facts.column for facts in _FACTS.values())


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredLog:
    """A log with the quantities of table 2.2, measured, simulated or synthetic; T rows.

    Raises SimulationInputError if shapes do not match.

    Attributes:
        joints: J names in the robot's order, three joints per leg.
        legs: L names in the robot's order.
        time: from any start, one row per 2 ms, (T,) [s].
        desired_angle: (T, J) [rad].
        control_voltage: (T, J) [V].
        joint_angle: (T, J) [rad].
        current: absolute, (T, J) [A].
        supply: (T, L) [V].
        potentiometer_joints: names of the K joints with a potentiometer.
        potentiometer: (T, K) [rad]; None if K is 0.
        body_acceleration: in the body's frame, without gravity, (T, 3) [g]; None if not measured.
        metadata: of the file, by name.
    """

    joints: tuple[str, ...]
    legs: tuple[str, ...]
    time: Floats
    desired_angle: Floats
    control_voltage: Floats
    joint_angle: Floats
    current: Floats
    supply: Floats
    potentiometer_joints: tuple[str, ...] = ()
    potentiometer: Floats | None = None
    body_acceleration: Floats | None = None
    metadata: Mapping[str, str] = field(default_factory=dict)

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
        if quantity is Quantity.BODY_ACCELERATION and self.body_acceleration is None:
            return ()
        return {"joint": self.joints, "leg": self.legs, "axis": AXES}[quantity.per]

    def values(self, quantity: Quantity) -> Floats:
        """A quantity's columns (T, channels), in its unit."""
        columns: Floats | None = getattr(self, _FACTS[quantity].column)
        return np.empty((len(self.time), 0)) if columns is None else columns

    def link_of(self, joint: str) -> int:
        """Number of the leg's link that a joint moves."""
        return self.joints.index(joint) % JOINTS_PER_LEG + 1

    def mapped(self, function: Callable[[Floats], Floats]) -> MeasuredLog:
        """Return the log with other columns."""
        columns: dict[str, Any] = {
            name: function(column)
            for name in _COLUMNS
            if (column := getattr(self, name)) is not None
        }
        return replace(self, time=function(self.time), **columns)

    def rows(self, start: int, stop: int) -> MeasuredLog:
        return self.mapped(lambda column: column[start:stop])


def simulated_log(robot: Robot, walk: WalkLog) -> MeasuredLog:
    """A simulated walk as logged by the robot's instruments, without their errors.

    Encoders see the motors' angles, potentiometers, here on every joint, those of the links;
    currents are those of `sensed_currents`; the boards of all legs see the one battery.
    """
    if not np.isfinite(walk.current).all():
        raise SimulationInputError("a walk that ended early cannot be compared")
    joints, legs = robot.joint_names, tuple(leg.name for leg in robot.legs)
    return MeasuredLog(
        joints=joints,
        legs=legs,
        time=walk.time,
        desired_angle=walk.desired_angle,
        control_voltage=walk.voltage,
        joint_angle=walk.motor_angle,
        current=sensed_currents(robot, walk.current, walk.voltage),
        supply=np.repeat(walk.supply[:, None], len(legs), axis=1),
        potentiometer_joints=joints,
        potentiometer=walk.joint_angle,
        body_acceleration=walk.body_acceleration() / GRAVITY,
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
