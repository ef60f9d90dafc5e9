"""`gaitswarm simulate`: one design in some scenarios."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitswarm.cli.inputs.options import (
    ControllerOption,
    Place,
    Precision,
    PreferenceOption,
    RobotOption,
    TrajectoryOption,
)
from gaitswarm.cli.output import note
from gaitswarm.cli.tables import gait_in_words, number, results_table, table, worth

if TYPE_CHECKING:
    from gaitswarm.cli.output import Printed
    from gaitswarm.cli.rich_table import Table
    from gaitswarm.simulation import SimulationView


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
    trajectory: TrajectoryOption = None,
    preference: PreferenceOption = None,
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
    *,
    place: Place,
) -> Printed:
    """Simulate one design and show its objectives and fitness; a fall is a result, not an error."""
    from pydantic import ValidationError

    from gaitswarm.cli.inputs.design_file import given_design
    from gaitswarm.cli.inputs.robots import robot_defaults, scenario_data
    from gaitswarm.cli.inputs.spec_file import json_object
    from gaitswarm.designs import SimulationRequest
    from gaitswarm.errors import invalid_request
    from gaitswarm.simulation import run_simulation

    given = given_design(design, controller, trajectory, robot=robot, place=place)
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
    return without_logs(view, log), _parts(view)


def without_logs(view: SimulationView, path: Path | None) -> dict[str, Any]:
    """Write the logs of a simulation if there is a path; return the rest as JSON."""
    if path is not None:
        from gaitswarm.cli.files import write_walk_logs

        write_walk_logs(path, {name: result.log for name, result in view.scenarios.items()})
        note(f"log written to {path}")
    return view.model_dump(mode="json", exclude={"scenarios": {"__all__": {"log"}}})


def _parts(view: SimulationView) -> Iterator[Table | str]:
    from gaitswarm.sim.outcome import MEASUREMENTS, OBJECTIVES

    yield results_table({"": view.scenarios}, OBJECTIVES)
    heads = [f"{m.name.replace('_', ' ')}\n{m.unit}" for m in MEASUREMENTS]
    measured = (
        (name, *(number(getattr(result.measurements, m.name)) for m in MEASUREMENTS))
        for name, result in view.scenarios.items()
    )
    yield table(["scenario", *heads], measured, title="Measured", gap=1)
    yield f"fitness {worth(view)}, in {view.precision} precision"
    for name, result in view.scenarios.items():
        if result.gait is not None:
            yield f"{name}: {gait_in_words(result.gait)}"
        if result.status != "ok":
            yield f"{name}: {result.explanation}"
