"""What is measured on a walking robot (thesis table 2.2), 500 rows a second."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Final, Literal

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
"""A log whose metadata has origin: synthetic was computed, not measured."""


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
        """The only one in which it is written."""
        return _FACTS[self][0]

    @property
    def per(self) -> Literal["joint", "leg", "axis"]:
        """What there is one channel of."""
        return _FACTS[self][1]

    @property
    def meaning(self) -> str:
        """For headings and documentation."""
        return _FACTS[self][2]

    @property
    def optional(self) -> bool:
        """Whether it is supplementary in table 2.2."""
        return self in (Quantity.POTENTIOMETER, Quantity.BODY_ACCELERATION)


_FACTS: Final[dict[Quantity, tuple[str, Literal["joint", "leg", "axis"], str]]] = {
    Quantity.DESIRED_ANGLE: ("rad", "joint", "desired joint angle"),
    Quantity.CONTROL_VOLTAGE: ("V", "joint", "control signal of the PWM amplifier"),
    Quantity.JOINT_ANGLE: ("rad", "joint", "joint angle by the motor encoder"),
    Quantity.CURRENT: ("A", "joint", "absolute motor current"),
    Quantity.SUPPLY: ("V", "leg", "supply voltage at the leg's board"),
    Quantity.POTENTIOMETER: ("rad", "joint", "joint angle behind the backlash"),
    Quantity.BODY_ACCELERATION: ("g", "axis", "acceleration of the body, without gravity"),
}


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredLog:
    """A log with the quantities of table 2.2, measured, simulated or synthetic; T rows.

    Raises SimulationInputError if shapes do not fit.

    Attributes:
        joints: J names, in the robot's order, three joints a leg.
        legs: L names, in the robot's order.
        time: from any start, a row each 2 ms, (T,) [s].
        desired_angle: (T, J) [rad].
        control_voltage: (T, J) [V].
        joint_angle: (T, J) [rad].
        current: absolute, (T, J) [A].
        supply: (T, L) [V].
        potentiometer_joints: names of the K joints that have a potentiometer.
        potentiometer: (T, K) [rad]; None if K is 0.
        body_acceleration: in the body's frame, without gravity, (T, 3) [g]; None if not measured.
        metadata: what the file says of itself, by name.
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
                f"joints: {len(self.joints)} are not {JOINTS_PER_LEG} for each of"
                f" {len(self.legs)} legs"
            )
        for joint in self.potentiometer_joints:
            if joint not in self.joints:
                raise SimulationInputError(f"q_POT: no joint {joint!r}")

    @property
    def synthetic(self) -> bool:
        """Whether the log says that it was computed: such a one validates nothing but tools."""
        return self.metadata.get(ORIGIN) == SYNTHETIC

    def channels(self, quantity: Quantity) -> tuple[str, ...]:
        """Names of a quantity's columns."""
        if quantity is Quantity.POTENTIOMETER:
            return self.potentiometer_joints
        if quantity is Quantity.BODY_ACCELERATION and self.body_acceleration is None:
            return ()
        return {"joint": self.joints, "leg": self.legs, "axis": AXES}[quantity.per]

    def values(self, quantity: Quantity) -> Floats:
        """A quantity's columns.

        Returns:
            (T, channels), in the quantity's unit.
        """
        columns = {
            Quantity.DESIRED_ANGLE: self.desired_angle,
            Quantity.CONTROL_VOLTAGE: self.control_voltage,
            Quantity.JOINT_ANGLE: self.joint_angle,
            Quantity.CURRENT: self.current,
            Quantity.SUPPLY: self.supply,
            Quantity.POTENTIOMETER: self.potentiometer,
            Quantity.BODY_ACCELERATION: self.body_acceleration,
        }[quantity]
        return np.empty((len(self.time), 0)) if columns is None else columns

    def link_of(self, joint: str) -> int:
        """Which link of its leg a joint moves."""
        return self.joints.index(joint) % JOINTS_PER_LEG + 1

    def rows(self, start: int, stop: int) -> MeasuredLog:
        """A part of the log."""
        part = slice(start, stop)
        return replace(
            self,
            time=self.time[part],
            desired_angle=self.desired_angle[part],
            control_voltage=self.control_voltage[part],
            joint_angle=self.joint_angle[part],
            current=self.current[part],
            supply=self.supply[part],
            potentiometer=None if self.potentiometer is None else self.potentiometer[part],
            body_acceleration=(
                None if self.body_acceleration is None else self.body_acceleration[part]
            ),
        )


def simulated_log(robot: Robot, walk: WalkLog) -> MeasuredLog:
    """A simulated walk as the robot's own instruments would have logged it, without their errors.

    Encoders see the motors' angles, potentiometers, which every joint has, the links'; currents are
    those of `sensed_currents`; every leg's board sees the one battery.
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
    """One design in one scenario of one robot, within the reach of its legs.

    Attributes:
        robot: that walked.
        scenario: that it walked through.
        controller: name of the motor controller that drove it.
        design: of the controller and the gait, by variable.
        cycle_time: the design's, if it has one, else the scenario's [s].
    """

    robot: Robot
    scenario: Scenario
    controller: str
    design: Mapping[str, float]
    cycle_time: float

    @classmethod
    def of(
        cls, robot: Robot, scenario: Scenario, controller: str, design: Mapping[str, float]
    ) -> MeasuredWalk:
        """The walk, once it is known that the legs reach all of it."""
        gait = {name: value for name, value in design.items() if name in GAIT_CATALOGUE}
        walked = with_gait(scenario, gait)
        check_reach(walked, [], [], robot=robot)
        return cls(robot, scenario, controller, design, walked.cycle_time)

    def simulated(self) -> MeasuredLog:
        """What the robot's instruments would have logged of it, without their errors."""
        designs = np.array([list(self.design.values())], dtype=np.float64)
        result = simulate(
            self.scenario, self.controller, list(self.design), designs, robot=self.robot, log=True
        )
        status, log = Status(int(result.outcome.statuses[0])), result.logs[0]
        if log is None or status not in (Status.OK, Status.STALLED):
            raise SimulationInputError(f"the simulated walk cannot be compared: {status.phrase}")
        return simulated_log(self.robot, log)
