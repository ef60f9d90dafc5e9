"""`gaitswarm synthesize`: a SYNTHETIC log, for tests of `validate` without a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cli.measured_walk import (
    CyclesOption,
    DesignOption,
    ScenarioOption,
    TrajectoryOption,
    WalkController,
)
from cli.options import RobotOption


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(synthesize)


def synthesize(
    design: DesignOption,
    scenario: ScenarioOption,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE.csv", help="Where to write the log.")
    ],
    controller: WalkController = "fuzzy-pi",
    trajectory: TrajectoryOption = None,
    cycles: CyclesOption = None,
    robot: RobotOption = None,
    seed: Annotated[
        int, typer.Option(min=0, max=(1 << 64) - 1, help="Source of the instruments' noise.")
    ] = 1,
) -> None:
    """Write a SYNTHETIC log: a perturbed twin of the robot, with sensor noise. No measurement."""
    from cli.atomic_file import replacing
    from cli.measured_walk import read_walk
    from cli.output import note
    from services.optimizer.errors import InvalidRequest
    from sim.validation.measured_csv import format_measured_log
    from sim.validation.synthetic import synthetic_log

    if output.suffix != ".csv":
        raise InvalidRequest(f"{output} must end in .csv", field="output")
    walk = read_walk(scenario, controller, design, trajectory, cycles, robot)
    log = synthetic_log(walk.robot, walk.scenario, controller, walk.design, seed=seed)
    with replacing(output, "output") as file:
        file.write(format_measured_log(log).encode())
    note(f"SYNTHETIC log of {len(log.time)} rows written to {output}")
