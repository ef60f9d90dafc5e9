"""The walk that a measured log is of: what walked where, and what the simulator makes of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait_variables import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.measurement.measured_log import MeasuredLog, simulated_log
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import check_reach, simulate


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
