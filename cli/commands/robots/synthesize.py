"""`gaitswarm synthesize`: a SYNTHETIC log, for tests of `validate` without a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gaitswarm.cli.inputs.measured_walk import (
    CyclesOption,
    DesignOption,
    ScenarioOption,
    TrajectoryOption,
)
from gaitswarm.cli.inputs.options import ControllerOption, Db, RobotOption, Server


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(synthesize)


def synthesize(
    design: DesignOption,
    scenario: ScenarioOption,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE.csv", help="Where to write the log.")
    ],
    controller: ControllerOption = None,
    trajectory: TrajectoryOption = None,
    cycles: CyclesOption = None,
    robot: RobotOption = None,
    seed: Annotated[
        int, typer.Option(min=0, max=(1 << 64) - 1, help="Source of the instruments' noise.")
    ] = 1,
    parameters: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.json",
            help="Values of single parameters by name: the twin then differs in these alone.",
        ),
    ] = None,
    server: Server = None,
    db: Db = None,
) -> None:
    """Write a SYNTHETIC log: a perturbed twin of the robot, with sensor noise. No measurement."""
    from gaitswarm.cli.atomic_file import replacing
    from gaitswarm.cli.inputs.measured_walk import read_walk
    from gaitswarm.cli.output import note
    from gaitswarm.cli.tables.parameters import read_truth
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.sim.measurement.measured_csv import format_measured_log
    from gaitswarm.sim.measurement.synthetic import Perturbation, synthetic_log
    from gaitswarm.sim.robot.identifiable import identifiable_variables

    if output.suffix != ".csv":
        raise InvalidRequest(f"{output} must end in .csv", field="output")
    walk = read_walk(scenario, controller, design, trajectory, cycles, robot, server=server, db=db)
    twin = None
    if parameters is not None:
        known = {variable.name for variable in identifiable_variables(walk.robot)}
        values = read_truth(parameters)
        for name in values:
            if name not in known:
                raise InvalidRequest("no such parameter of the robot", field=f"parameters.{name}")
        twin = Perturbation.of(values)
    log = synthetic_log(
        walk.robot, walk.scenario, walk.controller, walk.design, seed=seed, perturbation=twin
    )
    with replacing(output, "output") as file:
        file.write(format_measured_log(log).encode())
    note(f"SYNTHETIC log of {len(log.time)} rows written to {output}")
