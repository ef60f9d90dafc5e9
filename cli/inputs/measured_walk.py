"""The walk that a measured log is compared with, and files of logs, from options."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from gaitswarm.sim.measurement.measured_log import MeasuredLog, MeasuredWalk
    from gaitswarm.sim.measurement.synchronise import Synchronised
    from gaitswarm.sim.robot import Robot

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
TrajectoryOption = Annotated[
    Path | None,
    typer.Option(
        "--trajectory", metavar="FILE", help="JSON object of gait parameters, beside the design."
    ),
]
CyclesOption = Annotated[
    int | None, typer.Option("--cycles", min=1, max=100, help="Walking cycles to simulate.")
]


def read_walk(
    scenario: str,
    controller: str | None,
    design: str,
    trajectory: Path | None,
    cycles: int | None,
    robot: str | None,
    *,
    server: str | None,
    db: str | None,
) -> MeasuredWalk:
    """The walk of a design; of a job's best on the job's robot, unless another is named.

    server, db: Where the job is, if the design is of one.
    Raises InvalidRequest or SimulationInputError that names what is wrong, NotFound.
    """
    from gaitswarm.cli.inputs.design_file import given_design
    from gaitswarm.cli.inputs.robots import chosen_scenarios
    from gaitswarm.sim.measurement.measured_log import MeasuredWalk
    from gaitswarm.sim.robot import load_robot

    given = given_design(design, controller, trajectory, robot=robot, server=server, db=db)
    unchecked: Mapping[str, Any] = given.values
    for name, value in unchecked.items():
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (number and -_HUGE < value < _HUGE):
            raise InvalidRequest("must be a finite number", field=f"design.{name}")
    scenarios = chosen_scenarios(scenario, robot)
    if len(scenarios) != 1:
        raise InvalidRequest("name one scenario: a log is of one walk", field="scenario")
    (chosen,) = scenarios
    if cycles is not None:
        chosen = chosen.model_copy(update={"cycles": float(cycles)})
    return MeasuredWalk.of(load_robot(given.robot(robot)), chosen, given.controller, given.values)


def synchronised(
    path: Path, log: MeasuredLog, simulated: MeasuredLog, walk: MeasuredWalk
) -> Synchronised:
    """A log beside the simulated walk. Raises InvalidRequest that names the file."""
    from gaitswarm.sim.errors import MeasuredLogError
    from gaitswarm.sim.measurement.synchronise import synchronise

    try:
        return synchronise(log, simulated, walk.cycle_time)
    except MeasuredLogError as error:
        raise InvalidRequest(f"{path}: {error}", field="measured") from error


def read_measured(path: Path, robot: Robot) -> MeasuredLog:
    """A log from a file. Raises InvalidRequest that names file, line, column and unit."""
    from gaitswarm.sim.errors import MeasuredLogError
    from gaitswarm.sim.measurement.measured_csv import parse_measured_log

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
