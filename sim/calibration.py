"""Fitting of a robot and conventions to a table of measured or published results."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import Field, FiniteFloat, model_validator

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.assembly import control_steps, judge, kernel_of, measure, plan_walk
from gaitswarm.sim.catalogue import (
    GAIT_CATALOGUE,
    check_design,
    design_catalogue,
    design_numbers,
    with_gait,
)
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName, control_law
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait.trajectory import desired_angles
from gaitswarm.sim.input import Data, check_distinct
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.walk import Walking, WalkRequest, WalkSetup, walk_together
from gaitswarm.sim.outcome import N_OBJECTIVES, RESULTS, Objective, Outcome, Status
from gaitswarm.sim.robot import RobotSource, load_robot
from gaitswarm.sim.robot.identifiable import (
    CONVENTIONAL_VARIABLES,
    identifiable_variables,
    with_parameters,
)
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario, ScenarioChoice, find_scenario
from gaitswarm.sim.variables import Variable, VariableName, VariableValue

WalkName = Annotated[
    str,
    Field(
        min_length=1,
        max_length=40,
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$",
        description="Label of the walk, unique in its job.",
        examples=["fuzzy-pso-ps"],
    ),
]

QuantityName = Literal[
    "torque",
    "acceleration",
    "angular_acceleration",
    "energy",
    "height_loss",
    "speed",
    "power",
    "peak_current",
    "mean_current",
    "motor_heat",
    "F",
    "fitness:A",
    "fitness:B",
    "fitness:C",
]


@dataclass(frozen=True, slots=True)
class Quantity:
    """A result of a walk that can be a target."""

    unit: str
    description: str
    # whether all values are positive, so that tolerances are relative; else they are in the unit
    positive: bool = True
    scenarios: bool = False  # whether it is one number over all scenarios of a walk


QUANTITIES: Final[dict[QuantityName, Quantity]] = {
    "torque": Quantity("N m", "f1, rms over time of the sum of the absolute gear torques"),
    "acceleration": Quantity("m/s2", "f2, rms of the body's linear acceleration"),
    "angular_acceleration": Quantity("rad/s2", "f3, rms of the body's angular acceleration"),
    "energy": Quantity("J/m", "f4, electrical energy of the motors per metre walked"),
    "height_loss": Quantity("m", "f6, height at the start less that at the end", positive=False),
    "speed": Quantity("m/s", "mean forward speed"),
    "power": Quantity("W", "mean electrical power of all motors"),
    "peak_current": Quantity("A", "largest absolute current of any motor"),
    "mean_current": Quantity("A", "mean over time and motors of the absolute current"),
    "motor_heat": Quantity("W", "mean of what all windings turn to heat"),
    "F": Quantity("1", "fitness of chapter 3, eq. 3.1; the greater the better"),
    "fitness:A": Quantity("1", "fitness under preference A, eq. 4.2", scenarios=True),
    "fitness:B": Quantity("1", "fitness under preference B, eq. 4.2", scenarios=True),
    "fitness:C": Quantity("1", "fitness under preference C, eq. 4.2", scenarios=True),
}


class TargetWalk(Data):
    """A measured or published walk: its drive and its scenarios."""

    name: WalkName
    controller: ControllerName = Field(description="Controller that drove it.")
    design: dict[VariableName, VariableValue] = Field(
        description="Value of each of the controller's variables, and of other known ones: gait"
        " variables, conventions. A calibration does not vary these values.",
        examples=[{"P": 0.454, "I": 0.147, "stride": 0.168}],
    )
    scenarios: tuple[ScenarioChoice, ...] = Field(
        min_length=1,
        max_length=32,
        examples=[["normal-fast"]],
    )
    """Names or numbers of presets, or custom scenarios; several for a fitness over all of them."""

    @model_validator(mode="after")
    def _can_walk(self) -> TargetWalk:
        check_design(self.controller, self.design)
        check_distinct("scenarios", [scenario.name for scenario in self.resolved_scenarios()])
        return self

    def resolved_scenarios(self) -> tuple[Scenario, ...]:
        """The scenarios in full, presets looked up."""
        return tuple(map(find_scenario, self.scenarios))

    @property
    def numbers(self) -> tuple[tuple[str, float], ...]:
        """Names and numbers of the design, sorted by name."""
        return tuple(sorted(design_numbers(self.controller, self.design).items()))


class Target(Data):
    """One result of a walk, and the tolerance of its simulation."""

    walk: WalkName
    quantity: QuantityName = Field(description="What was measured.", examples=["energy"])
    value: FiniteFloat = Field(examples=[41.96])
    """In the quantity's unit; with `relative_to` the ratio to that walk's."""
    tolerance: float = Field(gt=0.0, le=1e6, examples=[0.2])
    """Deviation that counts as one. Relative, 0.2 for a fifth, except for height_loss, which may
    have either sign: in metres."""
    relative_to: WalkName | None = None
    """Another walk, if the value is the ratio to its quantity."""
    use: Literal["fit", "predict"] = "fit"
    """Whether it is fitted, or only predicted and reported."""

    @model_validator(mode="after")
    def _has_a_sense(self) -> Target:
        if QUANTITIES[self.quantity].positive:
            if not self.value > 0.0:
                raise ValueError(f"value: {self.value:g}, but {self.quantity} is greater than 0")
        elif self.relative_to is not None:
            raise ValueError(f"relative_to: {self.quantity} may be zero, so it has no ratio")
        if self.relative_to == self.walk:
            raise ValueError("relative_to: the walk itself; its ratio is always 1")
        return self

    @property
    def label(self) -> str:
        """Walk and quantity, for people."""
        ratio = "" if self.relative_to is None else f" / {self.relative_to}"
        return f"{self.walk}{ratio} {self.quantity}"

    @property
    def unit(self) -> str:
        return QUANTITIES[self.quantity].unit if self.relative_to is None else "1"


ROBOT: Final = "robot"
"""The variable that chooses between robots."""

_PLANNED: Final = "planned_soles"
"""The robot's only convention that its gait is planned with."""


def robot_variables(robots: Sequence[RobotSource]) -> tuple[Variable, ...]:
    """Variables of the robot that a calibration may vary."""
    first, *others = map(load_robot, robots)
    parameters = identifiable_variables(first)
    for other in others:
        if identifiable_variables(other) != parameters:
            raise SimulationInputError(
                f"robots: {other.description.name} has other parameters than"
                f" {first.description.name}"
            )
    if not others:
        return (*CONVENTIONAL_VARIABLES, *parameters)
    choice = Variable(
        name=ROBOT,
        kind="categorical",
        choices=tuple(str(robot) for robot in robots),
        description="Which robot's parameters hold where none is varied.",
    )
    return (choice, *CONVENTIONAL_VARIABLES, *parameters)


def walk_variables(controllers: Iterable[ControllerName]) -> tuple[Variable, ...]:
    """Further variables that a calibration may vary: gait and conventions."""
    variables: dict[str, Variable] = {}
    for controller in dict.fromkeys(controllers):
        fixed = {variable.name for variable in CONTROLLERS[controller].variables}
        for name, variable in design_catalogue(controller).items():
            # Controllers may have different defaults for the same variable.
            same = variable.model_copy(update={"default": None})
            if name not in fixed and variables.setdefault(name, same) != same:
                raise SimulationInputError(f"{name}: has different meanings for two controllers")
    return tuple(variables.values())


def varied_robot(robots: Sequence[RobotSource], values: Mapping[str, float]) -> tuple[Robot, Robot]:
    """Return the robot that plans and the robot that walks, for a design."""
    parameters = dict(values)
    source = robots[round(parameters.pop(ROBOT, 0.0))]
    planner = _planner(source, parameters.get(_PLANNED))
    return planner, with_parameters(planner, parameters)


# Cached: one object per robot, so that cached plans are found.
@lru_cache(maxsize=32)
def _planner(source: RobotSource, planned_soles: float | None) -> Robot:
    described = load_robot(source)
    if planned_soles is None:
        return described
    return with_parameters(described, {_PLANNED: planned_soles})


@dataclass(frozen=True, slots=True)
class CalibrationWalk:
    """A case whose designs are robots and conventions, with one drive in one scenario.

    Desired angles are those of the robot as described.
    """

    name: str  # unique in its job
    robots: tuple[RobotSource, ...]  # one, or those that the variable `robot` chooses among
    controller: ControllerName
    design: tuple[tuple[str, float], ...]  # names and numbers of the drive, sorted by name
    scenario: Scenario
    variables: tuple[str, ...]  # columns of the designs, of `robot_variables` and `walk_variables`
    precision: Precision = "double"

    @property
    def duration(self) -> float:
        """Simulated time of one design [s], with the drive's cycle time if it gives one."""
        cycle_time = dict(self.design).get("cycle_time", self.scenario.cycle_time)
        return self.scenario.cycles * cycle_time

    @property
    def objectives(self) -> tuple[Objective, ...]:
        return RESULTS

    def run(self, designs: Floats) -> Outcome:
        (outcome,) = walk_together([self.walking(designs)])
        return outcome

    def walking(self, designs: Floats) -> Walking[Outcome]:
        """Simulate every robot; robots that share a kernel share its calls."""
        objectives = np.full((len(designs), len(RESULTS)), np.nan)
        statuses = np.full(len(designs), Status.UNREACHABLE, dtype=np.uint8)
        timesteps: dict[int, float] = {}
        requests: list[WalkRequest] = []
        of_robot = {variable.name for variable in robot_variables(self.robots)}
        for index, row in enumerate(designs.tolist()):
            values = dict(zip(self.variables, row, strict=True))
            described, robot = varied_robot(
                self.robots, {name: v for name, v in values.items() if name in of_robot}
            )
            coding, timestep = control_steps(robot)
            setup = self._setup(described, robot, self.drive(values), timestep)
            if setup is not None:
                timesteps[index] = timestep
                kernel = kernel_of(robot, precision=self.precision)
                requests.append(WalkRequest(kernel, coding, setup))
        results = yield requests
        walks = zip(timesteps.items(), requests, results, strict=True)
        for (index, timestep), request, result in walks:
            substeps = request.coding.substeps
            judged = judge(request.setup, result, substeps, timestep)
            statuses[index], objectives[index, :N_OBJECTIVES] = judged
            objectives[index, N_OBJECTIVES:] = measure(request.setup, result, substeps, timestep)
        return Outcome(objectives, statuses)

    def drive(self, values: Mapping[str, float]) -> dict[str, float]:
        """The drive and its varied variables."""
        catalogue = design_catalogue(self.controller)
        varied = {name: value for name, value in values.items() if name in catalogue}
        return varied | dict(self.design)

    def _setup(
        self, described: Robot, robot: Robot, drive: Mapping[str, float], timestep: float
    ) -> WalkSetup | None:
        """None for an unreachable gait."""
        gait = {name: value for name, value in drive.items() if name in GAIT_CATALOGUE}
        gains = tuple((name, v) for name, v in drive.items() if name not in GAIT_CATALOGUE)
        scenario = with_gait(self.scenario, gait)
        trajectory = desired_angles(described, scenario)
        plan = plan_walk(robot, scenario, timestep, trajectory=trajectory)
        return None if plan is None else plan(control_law(self.controller, gains))
