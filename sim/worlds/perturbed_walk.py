"""Many designs put to one world in one scenario."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.assembly import control_steps, judge, kernel_of, measure, plan_walk
from gaitswarm.sim.controllers import ControlLaw, ControllerName, control_law
from gaitswarm.sim.gait_variables import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.kernel.observation import WalkLog, walk_log
from gaitswarm.sim.kernel.walk import Precision, Walking, WalkSetup, WantedWalk, walk_together
from gaitswarm.sim.outcome import (
    MEASUREMENTS,
    N_MEASUREMENTS,
    N_OBJECTIVES,
    OBJECTIVES,
    Measurements,
    Objective,
    Outcome,
    Status,
)
from gaitswarm.sim.robot import Robot, RobotSource, load_robot
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import Simulation
from gaitswarm.sim.worlds.perturbations import check_worlds
from gaitswarm.sim.worlds.perturbed_setup import perturbed_setups

Floats = NDArray[np.float64]

_PLANS_KEPT: Final = 16
"""Scenarios whose walks are planned once for all worlds of them."""


@dataclass(frozen=True, slots=True)
class PerturbedWalk:
    """Designs of a controller walk through a scenario of one world, of which they know nothing.

    Attributes:
        name: unique in its job.
        robot: as described.
        controller: name of the motor controller.
        scenario: that is walked through.
        world: names and values of perturbations; what is not named is nominal.
        variables: columns of the designs.
        precision: of the physics' numbers.
    """

    name: str
    robot: RobotSource
    controller: ControllerName
    scenario: Scenario
    world: tuple[tuple[str, float], ...]
    variables: tuple[str, ...]
    precision: Precision = "double"

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        """The robot as described."""
        return (self.robot,)

    @property
    def duration(self) -> float:
        """Simulated time of one walk [s]."""
        return self.scenario.duration

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """f1 to f6 of table 4.1."""
        return OBJECTIVES

    def run(self, designs: Floats) -> Outcome:
        """Let every design walk."""
        (outcome,) = walk_together([self.walking(designs)])
        return outcome

    def walking(self, designs: Floats) -> Walking[Outcome]:
        """Let every design walk, beside walks of other cases."""
        walked = yield from self._simulating(designs, log=False)
        return walked.outcome

    def simulate(self, designs: Floats, *, log: bool = False) -> Simulation:
        """Let every design walk, to be looked at.

        Args:
            designs: (n, len(variables)), in the variables' units.
        """
        (simulation,) = walk_together([self._simulating(designs, log=log)])
        return simulation

    def _simulating(self, designs: Floats, *, log: bool) -> Walking[Simulation]:
        robot = load_robot(self.robot)
        kernel = kernel_of(robot, precision=self.precision)
        coding, timestep = control_steps(robot)
        statuses = np.full(len(designs), Status.UNREACHABLE, dtype=np.uint8)
        objectives = np.full((len(designs), N_OBJECTIVES), np.nan)
        measured = np.full((len(designs), N_MEASUREMENTS), np.nan)
        logs: list[WalkLog | None] = [None] * len(designs)
        setups = self._setups(robot, designs, timestep)
        results = yield [WantedWalk(kernel, coding, setup, log) for setup in setups.values()]
        for (index, setup), result in zip(setups.items(), results, strict=True):
            statuses[index], objectives[index] = judge(setup, result, coding.substeps, timestep)
            measured[index] = measure(setup, result, coding.substeps)
            if result.states is not None:
                logs[index] = walk_log(robot, setup, result.states)
        return Simulation(
            Outcome(objectives, statuses), Measurements.of(measured), tuple(logs) if log else ()
        )

    def _setups(self, robot: Robot, designs: Floats, timestep: float) -> dict[int, WalkSetup]:
        """By index of the design; without those whose gait is out of the legs' reach."""
        of_gait: dict[tuple[float, ...], WalkSetup | None] = {}
        setups = {}
        for index, row in enumerate(designs.tolist()):
            design = dict(zip(self.variables, row, strict=True))
            gait = {name: design.pop(name) for name in self.variables if name in GAIT_CATALOGUE}
            law = control_law(self.controller, tuple(design.items()))
            key = tuple(gait.values())
            if key not in of_gait:
                of_gait[key] = self._in_world(robot, gait, law, timestep)
            setup = of_gait[key]
            if setup is not None:
                setups[index] = replace(setup, control_law=law)
        return setups

    def _in_world(
        self, robot: Robot, gait: dict[str, float], law: ControlLaw, timestep: float
    ) -> WalkSetup | None:
        """What all designs of one gait walk in, but for their control laws."""
        scenario = with_gait(self.scenario, gait)
        plan = (plan_walk if gait else _plan_of_scenario)(robot, scenario, timestep)
        if plan is None:
            return None
        names, values = tuple(name for name, _ in self.world), [v for _, v in self.world]
        worlds = np.array([values], dtype=np.float64)
        check_worlds(names, worlds)
        (setup,) = perturbed_setups(robot, scenario, plan(law), names, worlds)
        return setup


@dataclass(frozen=True, slots=True)
class MeasuredPerturbedWalk(PerturbedWalk):
    """The same walk with its measurements, as further columns behind its objectives."""

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """f1 to f6 of table 4.1, then `MEASUREMENTS`."""
        measured = (Objective(m.name, m.unit, m.description) for m in MEASUREMENTS)
        return (*OBJECTIVES, *measured)

    def walking(self, designs: Floats) -> Walking[Outcome]:
        """Let every design walk, beside walks of other cases."""
        walked = yield from self._simulating(designs, log=False)
        columns = [walked.outcome.objectives, walked.measurements.array()]
        return Outcome(np.concatenate(columns, axis=1), walked.outcome.statuses)


@lru_cache(maxsize=_PLANS_KEPT)
def _plan_of_scenario(
    robot: Robot, scenario: Scenario, timestep: float
) -> Callable[[ControlLaw], WalkSetup] | None:
    return plan_walk(robot, scenario, timestep)
