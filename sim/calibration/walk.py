"""Cases of a calibration: robots and conventions in one of the walks that it is fitted to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.assembly import control_steps, judge, kernel_of, measure, plan_walk
from gaitswarm.sim.catalogue import design_catalogue
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName, control_law
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait.trajectory import desired_angles
from gaitswarm.sim.gait_variables import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.kernel.walk import Precision, Walking, WalkRequest, WalkSetup, walk_together
from gaitswarm.sim.outcome import MEASUREMENTS, N_OBJECTIVES, OBJECTIVES, Objective, Outcome, Status
from gaitswarm.sim.robot import Robot, RobotSource, load_robot
from gaitswarm.sim.robot.identifiable import (
    CONVENTIONAL_VARIABLES,
    identifiable_variables,
    with_parameters,
)
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.variables import Variable

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


Floats = NDArray[np.float64]

RESULTS: Final = (*OBJECTIVES, *(Objective(m.name, m.unit, m.description) for m in MEASUREMENTS))
"""All results of a walk, f1 to f6 first."""


@dataclass(frozen=True, slots=True)
class CalibrationWalk:
    """A case whose designs are robots and conventions, with one drive in one scenario.

    Desired angles are those of the robot as described: its controller does not know the varied
    parameters. Variables that the drive gives are not varied.
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
            objectives[index, N_OBJECTIVES:] = measure(request.setup, result, substeps)
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
