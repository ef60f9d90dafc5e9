"""`gaitswarm simulate`: one design in some scenarios."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitswarm.cli.inputs.options import ControllerOption, Db, Json, Precision, RobotOption, Server

if TYPE_CHECKING:
    from gaitswarm.views import SimulationView


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(simulate)


def simulate(
    design: Annotated[
        str,
        typer.Option(
            metavar="JSON|FILE|published:NAME|job:ID",
            help="JSON object {variable: value} of controller variables and optional gait"
            " parameters, or with one under `design`; a published design, as published:A; or the"
            " best of a job.",
        ),
    ],
    controller: ControllerOption = None,
    scenario: Annotated[
        str | None,
        typer.Option(
            help="Names, numbers or FILE.json, separated by commas, or all; of the robot's folder"
            " if it has scenarios, else of table 4.2 [default: the job's, else all]."
        ),
    ] = None,
    trajectory: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="JSON object of gait parameters, added to the design."),
    ] = None,
    preference: Annotated[
        str | None,
        typer.Option(
            help="Weighting of objectives: A, B, C or chapter-3 [default: the job's, else that of"
            " the robot's folder, else A]."
        ),
    ] = None,
    world: Annotated[
        str | None,
        typer.Option(
            metavar="JSON|FILE",
            help="Perturbations of the model, such as"
            ' \'{"friction_factor": 0.7, "slope_added": 2}\', or an object with them under'
            " `values`, as printed by `certify --json`.",
        ),
    ] = None,
    log: Annotated[
        Path | None,
        typer.Option(metavar="FILE.npz", help="Write 500 Hz logs as NumPy arrays."),
    ] = None,
    robot: RobotOption = None,
    precision: Precision = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Simulate one design and show its objectives and fitness; a fall is a result, not an error."""
    from pydantic import ValidationError

    from gaitswarm.cli.inputs.design_file import given_design
    from gaitswarm.cli.inputs.robots import robot_defaults, scenario_data
    from gaitswarm.cli.inputs.spec_file import json_object
    from gaitswarm.cli.output import note
    from gaitswarm.errors import invalid_request
    from gaitswarm.requests.simulations import SimulationRequest, run_simulation

    given = given_design(design, controller, trajectory, robot=robot, server=server, db=db)
    data: dict[str, Any] = {
        "robot": given.robot(robot),
        "controller": given.controller,
        "design": given.values,
        "scenarios": scenario_data(scenario or "all", robot),
        "preference": preference or robot_defaults(robot).preference,
        "precision": precision or "double",
        "log": log is not None,
    }
    if given.spec is not None and scenario is None:
        data["scenarios"] = given.spec.resolved_scenarios()
    if given.spec is not None and preference is None:
        data["preference"] = given.spec.preference
    if world is not None:
        document = json_object(world, "world")
        data["world"] = document.get("values", document)
    try:
        request = SimulationRequest.model_validate(data)
    except ValidationError as error:
        raise invalid_request(error) from error
    view = run_simulation(request)
    if log is not None:
        from gaitswarm.cli.files import write_walk_logs

        write_walk_logs(log, {name: result.log for name, result in view.scenarios.items()})
        note(f"log written to {log}")
    _show(view, as_json=as_json)


def _show(view: SimulationView, *, as_json: bool) -> None:
    from gaitswarm.cli.output import print_text, stdout_console
    from gaitswarm.cli.tables import gait_in_words, measurements_table, results_table, worth
    from gaitswarm.sim.outcome import OBJECTIVES

    if as_json:
        print_text(view.model_dump_json(indent=2, exclude={"scenarios": {"__all__": {"log"}}}))
        return
    console = stdout_console()
    console.print(results_table({"": view.scenarios}, OBJECTIVES))
    console.print(measurements_table(view.scenarios))
    console.print(f"fitness {worth(view)}, in {view.precision} precision", markup=False)
    for name, result in view.scenarios.items():
        if result.gait is not None:
            console.print(f"{name}: {gait_in_words(result.gait)}", markup=False)
        if result.status != "ok":
            console.print(f"{name}: {result.explanation}", markup=False)
