"""`gaitswarm validate`: how far the simulator is from a measured walk."""

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
from gaitswarm.cli.inputs.options import ControllerOption, Db, Json, RobotOption, Server


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(validate)


def validate(
    measured: Annotated[
        Path,
        typer.Argument(metavar="MEASURED.csv", help="Log in the format of docs/validation.md."),
    ],
    design: DesignOption,
    scenario: ScenarioOption,
    controller: ControllerOption = None,
    trajectory: TrajectoryOption = None,
    cycles: CyclesOption = None,
    robot: RobotOption = None,
    repeat: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE.csv", help="Another measurement of the same walk, for CONF; repeatable."
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write a report in Markdown, with pictures, to DIR."),
    ] = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Simulate the walk that was measured, and judge the differences by tolerance classes."""
    from gaitswarm.cli.inputs.measured_walk import read_measured, read_walk, synchronised
    from gaitswarm.cli.output import note, print_json, stdout_console
    from gaitswarm.cli.tables.validation import (
        alignment,
        comparison_table,
        confidence_table,
        remarks,
    )
    from gaitswarm.cli.validation_report import write_report
    from gaitswarm.sim.validation import compare_synchronised

    walk = read_walk(scenario, controller, design, trajectory, cycles, robot, server=server, db=db)
    logs = {path: read_measured(path, walk.robot) for path in (measured, *(repeat or ()))}
    simulated = walk.simulated()
    pairs = [synchronised(path, log, simulated, walk) for path, log in logs.items()]
    comparison = compare_synchronised(pairs[0], [pair.measured for pair in pairs[1:]])
    if as_json:
        print_json(comparison)
    else:
        console = stdout_console()
        console.print(comparison_table(comparison))
        if comparison.repeats:
            console.print(confidence_table(comparison))
        console.print(alignment(comparison), markup=False)
    for remark in remarks(comparison):
        note(f"note: {remark}")
    if report is not None:
        facts = {
            "measured": measured.name,
            **{f"measured, {key}": value for key, value in logs[measured].metadata.items()},
            "simulated": f"{walk.robot.description.name} in {walk.scenario.name}",
            "controller": walk.controller,
            "design": ", ".join(f"{name}={value:g}" for name, value in walk.design.items()),
        }
        note(f"report written to {write_report(report, comparison, pairs[0], facts)}")
