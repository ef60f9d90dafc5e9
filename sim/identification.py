"""Parameters of a robot from measured walks (thesis 2.4)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Final, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError, model_validator

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.assembly import control_steps, kernel_of, plan_walk
from gaitswarm.sim.catalogue import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName, names_of
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import MeasuredLogError, SimulationInputError
from gaitswarm.sim.gait.trajectory import desired_angles
from gaitswarm.sim.input import message_of
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.dynamics.electrical import supply_voltage
from gaitswarm.sim.kernel.observation import sensed_currents, split_states, walk_log
from gaitswarm.sim.outcome import Objective, Outcome, Status
from gaitswarm.sim.robot import RobotSource, load_robot
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.identifiable import with_parameters
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import check_reach
from gaitswarm.sim.variables import VariableName

if TYPE_CHECKING:
    from gaitswarm.sim.measurement.measured_log import Synchronised

_DECIMALS: Final = 5
"""Of a stored current [A]: far below the converter's resolution, and a third of the text."""

Amperes = Annotated[float, Field(ge=0.0, le=1000.0, allow_inf_nan=False)]
Currents = Annotated[tuple[Amperes, ...], Field(fail_fast=True)]


class RecordedWalk(BaseModel):
    """Absolute motor currents of one walk, on the time axis of the simulated one.

    Created from a measured log by `record`, which synchronises the two and keeps whole cycles.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    schema_version: Literal[1] = Field(default=1, description="Version of this schema.")
    scenario: Scenario = Field(description="The walk, as a job would name it.")
    controller: ControllerName = Field(description="Controller that drove the robot.")
    design: dict[VariableName, FiniteFloat] = Field(
        description="Value of each of its variables, and of any gait variable, as it walked."
    )
    first_tick: int = Field(
        ge=0, le=10_000_000, description="Control tick (500 a second) of the walk at the first row."
    )
    joints: tuple[str, ...] = Field(
        min_length=1, max_length=256, description="Joints of the columns, in the robot's order."
    )
    current: tuple[Currents, ...] = Field(
        fail_fast=True,
        min_length=1,
        max_length=100_000,
        description="Absolute motor currents [A], one row a tick, one number a joint.",
        examples=[[[0.12, 0.4, 0.31], [0.12, 0.38, 0.3]]],
    )
    synthetic: bool = Field(
        default=False, description="Whether the log was computed, not measured on a robot."
    )

    @model_validator(mode="after")
    def _is_whole(self) -> RecordedWalk:
        for number, row in enumerate(self.current):
            if len(row) != len(self.joints):
                raise ValueError(
                    f"current.{number}: {len(row)} numbers for {len(self.joints)} joints"
                )
        controller = CONTROLLERS[self.controller]
        needed = {variable.name for variable in controller.variables}
        missing = sorted(needed - self.design.keys())
        if missing:
            raise ValueError(f"design: {', '.join(missing)} missing; {self.controller} needs it")
        for name in self.design:
            if name not in names_of(controller) and name not in GAIT_CATALOGUE:
                raise ValueError(f"design: unknown variable {name!r}")
        last, walked = self.first_tick + len(self.current), self.walked_seconds
        if last > round(walked / CONTROL_PERIOD):
            raise ValueError(
                f"current: row {last - self.first_tick - 1} is after the end of the walk at"
                f" {walked:g} s; give the scenario as many cycles as were measured"
            )
        return self

    @property
    def walked_seconds(self) -> float:
        """Length of the simulated walk [s]."""
        cycle_time = self.design.get("cycle_time", self.scenario.cycle_time)
        return self.scenario.cycles * cycle_time

    @property
    def gait(self) -> dict[str, float]:
        """The design's gait variables."""
        return {name: v for name, v in self.design.items() if name in GAIT_CATALOGUE}

    @property
    def gains(self) -> dict[str, float]:
        """The design's controller variables."""
        return {name: v for name, v in self.design.items() if name not in GAIT_CATALOGUE}

    def check_reach(self, robot: RobotSource) -> None:
        """Check that a robot's legs reach all of the walk.

        Args:
            robot: The robot.

        Raises:
            UnreachablePose: A foot's target lies outside its leg's reach.
        """
        check_reach(self.scenario, tuple(self.design), tuple(self.design.values()), robot=robot)

    @cached_property
    def amperes(self) -> Floats:
        """`current` as an array (T, J) [A], read-only."""
        array = np.array(self.current, dtype=np.float64)
        array.flags.writeable = False
        return array


Recordings = Mapping[str, RecordedWalk]
"""By id."""


def record(
    pair: Synchronised, scenario: Scenario, controller: str, design: Mapping[str, float]
) -> RecordedWalk:
    """Return the measured currents of two synchronised logs, on the simulated one's time axis."""
    try:
        return RecordedWalk(
            scenario=scenario,
            controller=controller,
            design=dict(design),
            first_tick=round(float(pair.simulated.time[0]) / CONTROL_PERIOD),
            joints=pair.measured.joints,
            current=np.round(pair.measured.current, _DECIMALS).tolist(),
            synthetic=pair.measured.synthetic,
        )
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(map(str, first["loc"]))
        raise MeasuredLogError(
            f"the compared cycles are not a valid recording: {field}: {message_of(first)}"
        ) from error


LINK_CURRENTS: Final = tuple(
    Objective(
        f"current_link_{link}",
        "A",
        f"mean absolute error of the motor currents of the {part}s, eq. 2.16",
    )
    for link, part in enumerate(("coxa", "femur", "tibia"), start=1)
)


@dataclass(frozen=True, slots=True)
class CurrentFit:
    """A case whose designs are parameters of the robot; each repeats the recorded walk.

    Desired angles are those of the robot as described.
    """

    name: str  # of the recorded walk, unique in its job
    robot: RobotSource  # as described
    walk: RecordedWalk
    variables: tuple[str, ...]  # columns of the designs, names of `identifiable_variables`
    precision: Precision = "double"

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        return (self.robot,)

    @property
    def duration(self) -> float:
        """Simulated time of one design [s]."""
        return self.walk.walked_seconds

    @property
    def objectives(self) -> tuple[Objective, ...]:
        return LINK_CURRENTS

    def run(self, designs: Floats) -> Outcome:
        """Simulate robots with these parameters; a walk that ends early has failed."""
        described = load_robot(self.robot)
        if self.walk.joints != described.joint_names:
            raise SimulationInputError(f"{self.name}: recorded with other joints than the robot's")
        scenario = with_gait(self.walk.scenario, self.walk.gait)
        control_law = CONTROLLERS[self.walk.controller].compile(self.walk.gains)
        kernel = kernel_of(described, precision=self.precision)
        coding, timestep = control_steps(described)
        robots = [
            with_parameters(described, dict(zip(self.variables, row, strict=True)))
            for row in designs.tolist()
        ]
        trajectory = desired_angles(described, scenario)
        setups = []
        for robot in robots:
            plan = plan_walk(robot, scenario, timestep, trajectory=trajectory)
            if plan is None:
                raise SimulationInputError(f"{self.name}: the gait exceeds the legs' reach")
            setups.append(plan(control_law))
        results = kernel.walk(setups, coding, log=True)
        errors = np.full((len(designs), JOINTS_PER_LEG), np.nan)
        statuses = np.full(len(designs), Status.OK, dtype=np.uint8)
        for index, (robot, setup, result) in enumerate(zip(robots, setups, results, strict=True)):
            statuses[index] = result.status
            if result.status is not Status.OK or result.states is None:
                continue
            if robot.is_torque_controlled:
                # Their currents follow from the torques that battery and speed allow.
                log = walk_log(described, setup, result.states)
                currents = sensed_currents(robot, log.current, log.voltage)
            else:
                currents = recorded_currents(robot, result.states)
            errors[index] = self._errors(currents)
        return Outcome(errors, statuses)

    def _errors(self, currents: Floats) -> Floats:
        """(T, J) simulated absolute currents [A] -> (3,) mean absolute error by link [A]."""
        measured = self.walk.amperes
        rows = slice(self.walk.first_tick, self.walk.first_tick + len(measured))
        by_joint = np.abs(currents[rows] - measured).mean(axis=0)
        return np.asarray(by_joint.reshape(-1, JOINTS_PER_LEG).mean(axis=0))


def recorded_currents(robot: Robot, states: Floats) -> Floats:
    """Absolute currents of DC motors (T, J) [A] at control ticks, behind the sensors' low-pass."""
    parts, n = split_states(robot, states), robot.n_joints
    duty, rates = parts.duty, parts.joint_velocity
    if robot.has_backlash:
        # The motors' angles and rates are first in the internal state.
        rates = parts.internal_state[:, n : 2 * n]
    actuators, supply = robot.actuators(), robot.description.supply
    conductance = 1.0 / actuators.resistance
    battery = supply_voltage(
        list(duty.T),
        list(rates.T),
        actuators.torque.tolist(),
        conductance.tolist(),
        supply.voltage,
        supply.resistance,
    )
    voltage = duty * battery[:, np.newaxis]
    current = (voltage - actuators.torque * rates) * conductance
    return sensed_currents(robot, current, voltage)
