"""The walk that a measured log is compared with, and files of logs, from options."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from sim.measurement.measured_log import MeasuredLog
    from sim.measurement.synchronise import Synchronised
    from sim.robot import Robot
    from sim.scenario import Scenario

LARGEST_FILE: Final = 1 << 28
"""Largest log that is read [B]; a second takes about a megabyte."""

_HUGE: Final = 1e300

DesignOption = Annotated[
    str,
    typer.Option(
        "--design",
        metavar="JSON|FILE|published:NAME|job:ID",
        help="Design as for `simulate`, or published:A.",
    ),
]
ScenarioOption = Annotated[
    str, typer.Option("--scenario", help="Name or number of the walk, or FILE.json.")
]
WalkController = Annotated[str, typer.Option("--controller", help="As for `simulate`.")]
TrajectoryOption = Annotated[
    Path | None,
    typer.Option(
        "--trajectory", metavar="FILE", help="JSON object of gait parameters, beside the design."
    ),
]
CyclesOption = Annotated[
    int | None, typer.Option("--cycles", min=1, max=100, help="Walking cycles to simulate.")
]


@dataclass(frozen=True, slots=True)
class Walk:
    """One design in one scenario of one robot, within the reach of its legs.

    cycle_time [s] is the design's, if it has one, else the scenario's.
    """

    robot: Robot
    scenario: Scenario
    controller: str
    design: dict[str, float]
    cycle_time: float


def read_walk(
    scenario: str,
    controller: str,
    design: str,
    trajectory: Path | None,
    cycles: int | None,
    robot: str | None,
) -> Walk:
    """Raises InvalidRequest or SimulationInputError that names what is wrong."""
    from cli.inputs.design_file import read_design
    from cli.inputs.robots import chosen_robot, chosen_scenarios
    from sim.gait_variables import GAIT_CATALOGUE, with_gait
    from sim.robot import load_robot
    from sim.simulate import check_reach

    values = read_design(design, controller, trajectory)
    for name, value in values.items():
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (number and -_HUGE < value < _HUGE):
            raise InvalidRequest("must be a finite number", field=f"design.{name}")
    scenarios = chosen_scenarios(scenario, robot)
    if len(scenarios) != 1:
        raise InvalidRequest("name one scenario: a log is of one walk", field="scenario")
    (chosen,) = scenarios
    if cycles is not None:
        chosen = chosen.model_copy(update={"cycles": float(cycles)})
    gait = {name: value for name, value in values.items() if name in GAIT_CATALOGUE}
    walked = with_gait(chosen, gait)
    machine = load_robot(chosen_robot(robot))
    check_reach(walked, [], [], robot=machine)
    return Walk(machine, chosen, controller, values, walked.cycle_time)


def simulated_walk(walk: Walk) -> MeasuredLog:
    """What the robot's instruments would have logged of it. Raises SimulationInputError."""
    import numpy as np

    from sim.errors import SimulationInputError
    from sim.measurement.measured_log import simulated_log
    from sim.outcome import Status
    from sim.simulate import simulate

    designs = np.array([list(walk.design.values())], dtype=np.float64)
    result = simulate(
        walk.scenario, walk.controller, list(walk.design), designs, robot=walk.robot, log=True
    )
    status, log = Status(int(result.outcome.statuses[0])), result.logs[0]
    if log is None or status not in (Status.OK, Status.STALLED):
        raise SimulationInputError(f"the simulated walk cannot be compared: {status.phrase}")
    return simulated_log(walk.robot, log)


def synchronised(path: Path, log: MeasuredLog, simulated: MeasuredLog, walk: Walk) -> Synchronised:
    """A log beside the simulated walk. Raises InvalidRequest that names the file."""
    from sim.errors import MeasuredLogError
    from sim.measurement.synchronise import synchronise

    try:
        return synchronise(log, simulated, walk.cycle_time)
    except MeasuredLogError as error:
        raise InvalidRequest(f"{path}: {error}", field="measured") from error


def read_measured(path: Path, robot: Robot) -> MeasuredLog:
    """A log from a file. Raises InvalidRequest that names file, line, column and unit."""
    from sim.errors import MeasuredLogError
    from sim.measurement.measured_csv import parse_measured_log

    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise InvalidRequest(f"cannot read {path}: {error.strerror}", field="measured") from error
    if len(content) > LARGEST_FILE:
        raise InvalidRequest(f"{path} is larger than {LARGEST_FILE >> 20} MiB", field="measured")
    try:
        return parse_measured_log(content.decode("utf-8"), robot)
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InvalidRequest(f"{path}: line {line}: not UTF-8 text", field="measured") from error
    except MeasuredLogError as error:
        raise InvalidRequest(f"{path}: {error}", field="measured") from error
