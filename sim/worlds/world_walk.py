"""A design put to many worlds in one scenario."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.assembly import control_steps, judge, kernel_of, measure, plan_walk
from gaitswarm.sim.controllers import ControllerName, control_law
from gaitswarm.sim.gait_variables import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.kernel.observation import WalkLog, walk_log
from gaitswarm.sim.kernel.walk import (
    Kernel,
    Precision,
    Walking,
    WalkSetup,
    WantedWalk,
    walk_together,
)
from gaitswarm.sim.outcome import (
    N_MEASUREMENTS,
    N_OBJECTIVES,
    OBJECTIVES,
    Measurements,
    Objective,
    Outcome,
    Status,
)
from gaitswarm.sim.robot import RobotSource, load_robot
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import Simulation
from gaitswarm.sim.worlds.perturbations import check_worlds
from gaitswarm.sim.worlds.perturbed_setup import perturbed_setups

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class WorldWalk:
    """One design walks through one scenario; what is varied is the world.

    Desired angles and control law are those of the robot as described: its controller knows
    nothing of the world. All worlds share the robot's kernel.

    Attributes:
        robot: as described.
        controller: name of the motor controller.
        design: names and numbers of the design.
        scenario: that is walked through.
        variables: columns of the worlds, names of `PERTURBATIONS`; what is not named is nominal.
        precision: of the physics' numbers.
    """

    robot: RobotSource
    controller: ControllerName
    design: tuple[tuple[str, float], ...]
    scenario: Scenario
    variables: tuple[str, ...]
    precision: Precision = "double"

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.scenario.name

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        """The robot as described."""
        return (self.robot,)

    @property
    def duration(self) -> float:
        """Simulated time of one world [s], with the design's cycle time if it gives one."""
        cycle_time = dict(self.design).get("cycle_time", self.scenario.cycle_time)
        return self.scenario.cycles * cycle_time

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """f1 to f6 of table 4.1."""
        return OBJECTIVES

    def run(self, designs: Floats) -> Outcome:
        """Let the design walk in every world."""
        (outcome,) = walk_together([self.walking(designs)])
        return outcome

    def run_with(self, kernel: Kernel | None, worlds: Floats) -> Outcome:
        """Let the design walk in every world, by a kernel of one's choice.

        Args:
            worlds: (n, len(variables)), in the variables' units.
        """
        (simulation,) = walk_together([self._simulating(worlds, log=False, kernel=kernel)])
        return simulation.outcome

    def walking(self, designs: Floats) -> Walking[Outcome]:
        """Let the design walk in every world, beside walks of other cases."""
        walked = yield from self._simulating(designs, log=False)
        return walked.outcome

    def simulate(self, worlds: Floats, *, log: bool = False) -> Simulation:
        """Let the design walk in every world, to be looked at.

        Args:
            worlds: (n, len(variables)), in the variables' units.
        """
        (simulation,) = walk_together([self._simulating(worlds, log=log)])
        return simulation

    def _simulating(
        self, worlds: Floats, *, log: bool, kernel: Kernel | None = None
    ) -> Walking[Simulation]:
        check_worlds(self.variables, worlds)
        robot = load_robot(self.robot)
        kernel = kernel or kernel_of(robot, precision=self.precision)
        coding, timestep = control_steps(robot)
        statuses = np.full(len(worlds), Status.UNREACHABLE, dtype=np.uint8)
        objectives = np.full((len(worlds), N_OBJECTIVES), np.nan)
        measured = np.full((len(worlds), N_MEASUREMENTS), np.nan)
        logs: list[WalkLog | None] = [None] * len(worlds)
        setups = self._setups(worlds, timestep)
        results = yield [WantedWalk(kernel, coding, setup, log) for setup in setups]
        for index, (setup, result) in enumerate(zip(setups, results, strict=True)):
            statuses[index], objectives[index] = judge(setup, result, coding.substeps, timestep)
            measured[index] = measure(setup, result, coding.substeps)
            if result.states is not None:
                logs[index] = walk_log(robot, setup, result.states)
        return Simulation(
            Outcome(objectives, statuses), Measurements.of(measured), tuple(logs) if log else ()
        )

    def _setups(self, worlds: Floats, timestep: float) -> list[WalkSetup]:
        """One a world; none at all for a gait out of the legs' reach."""
        robot = load_robot(self.robot)
        gait = {name: value for name, value in self.design if name in GAIT_CATALOGUE}
        gains = tuple((n, value) for n, value in self.design if n not in GAIT_CATALOGUE)
        scenario = with_gait(self.scenario, gait)
        law = control_law(self.controller, gains)
        plan = plan_walk(robot, scenario, timestep)
        if plan is None:
            return []
        return perturbed_setups(robot, scenario, plan(law), self.variables, worlds)
