"""Measured logs"""

from __future__ import annotations

from dataclasses import dataclass

from pydantic import Field

from gaitswarm.designs import DesignRequest, resolved
from gaitswarm.errors import simulation_errors
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.errors import MeasuredLogError
from gaitswarm.sim.identification.recorded_walk import RecordedWalk, record
from gaitswarm.sim.measurement.measured_csv import parse_measured_log
from gaitswarm.sim.measurement.measured_log import MeasuredLog, MeasuredWalk
from gaitswarm.sim.measurement.synchronise import Synchronised, synchronise
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.scenario import Scenario, ScenarioChoice


class MeasuredWalkRequest(DesignRequest):
    """A measured log, and the design and scenario that it was measured with."""

    scenario: ScenarioChoice = Field(
        description="The walk: name or number of a preset (see /v1/scenarios), or your own, with as"
        " many cycles as were measured."
    )
    log: str = Field(
        min_length=1,
        description="Text of the log: CSV with 500 rows a second and the unit in every heading, in"
        " the format of docs/validation.md.",
        examples=["time [s],q_D.right_front_coxa [rad]\n0.0,0.3217\n0.002,0.3218\n"],
    )

    @property
    def walk_scenario(self) -> Scenario:
        """The scenario in full."""
        return resolved(self.scenario)


@dataclass(frozen=True, slots=True)
class ReadWalk:
    """The contents of a measured log.

    Attributes:
        log: all of it.
        pair: its whole cycles, synchronised with the simulated ones.
        walk: the recording.
    """

    log: MeasuredLog
    pair: Synchronised
    walk: RecordedWalk


def read_measured_walk(request: MeasuredWalkRequest) -> ReadWalk:
    """Read a log, simulate the design, and find the lag between the two."""
    request.check_design()
    scenario, design = request.walk_scenario, request.numbers
    robot = load_robot(request.robot)
    with simulation_errors("scenario"):
        walk = MeasuredWalk.of(robot, scenario, request.controller, design)
    # Before the simulation, which takes longer.
    try:
        log = parse_measured_log(request.log, robot)
        with simulation_errors("scenario"):
            simulated = walk.simulated()
        pair = synchronise(log, simulated, walk.cycle_time)
        return ReadWalk(log, pair, record(pair, scenario, request.controller, design))
    except MeasuredLogError as error:
        raise InvalidRequest(str(error), field="log") from error
