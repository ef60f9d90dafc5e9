"""Fit of a robot's parameters to measured motor currents (eq. 2.21)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.assembly import control_steps, kernel_of, plan_walk
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait.trajectory import desired_angles
from gaitswarm.sim.gait_variables import with_gait
from gaitswarm.sim.identification.recorded_walk import RecordedWalk
from gaitswarm.sim.kernel.dynamics.electrical import supply_voltage
from gaitswarm.sim.kernel.observation import sensed_currents, split_states
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import Objective, Outcome, Status
from gaitswarm.sim.robot import Robot, RobotSource, load_robot
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.identifiable import with_parameters

Floats = NDArray[np.float64]

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

    Desired angles are those of the robot as described: its controller does not know the true
    parameters.
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
        for index, (robot, result) in enumerate(zip(robots, results, strict=True)):
            statuses[index] = result.status
            if result.status is Status.OK and result.states is not None:
                errors[index] = self._errors(recorded_currents(robot, result.states))
        return Outcome(errors, statuses)

    def _errors(self, currents: Floats) -> Floats:
        """(T, J) simulated absolute currents [A] -> (3,) mean absolute error by link [A]."""
        measured = self.walk.amperes
        rows = slice(self.walk.first_tick, self.walk.first_tick + len(measured))
        by_joint = np.abs(currents[rows] - measured).mean(axis=0)
        return np.asarray(by_joint.reshape(-1, JOINTS_PER_LEG).mean(axis=0))


def recorded_currents(robot: Robot, states: Floats) -> Floats:
    """Logged motor currents of a walk, by the kernel's formula on whole columns.

    Absolute, behind the current sensors' low-pass, at every control tick, (T, J) [A].
    """
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
