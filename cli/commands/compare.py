"""`gaitswarm compare`: drives in the same scenarios."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import Db, Json, RobotOption, Server

if TYPE_CHECKING:
    from gaitswarm.sim.drives import NamedDrive, WalkFigures


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(compare)


def compare(
    drives: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="DRIVE",
            help="2011, 2016, pi, fuzzy-pi-3, job:ID for a job's best, or CONTROLLER:FILE for a"
            " design file. Default: the first four.",
        ),
    ] = None,
    scenario: Annotated[
        str, typer.Option(help="Names or numbers, separated by commas, or all.")
    ] = "all",
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw speed, power and effectivity.")
    ] = None,
    robot: RobotOption = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Compare drives in the same scenarios: speed, power, effectivity, objectives."""
    from gaitswarm.cli.inputs.robots import chosen_robot, chosen_scenarios
    from gaitswarm.cli.output import note, print_text
    from gaitswarm.cli.pictures import draw_comparison, save
    from gaitswarm.sim.drives import DRIVES
    from gaitswarm.sim.drives import compare as compare_drives

    compared = [_drive(name, server, db) for name in drives or DRIVES]
    walked = chosen_scenarios(scenario, robot)
    figures = compare_drives(compared, walked, robot=chosen_robot(robot))
    if as_json:
        print_text(json.dumps([_row(f) for f in figures], indent=2))
    else:
        _show(compared, figures)
    if plot is not None:
        save(draw_comparison(figures), plot)
        note(f"picture written to {plot}")


def _drive(name: str, server: str | None, db: str | None) -> NamedDrive:
    from gaitswarm.cli.inputs.design_file import given_design, read_design
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.sim.controllers import CONTROLLERS
    from gaitswarm.sim.drives import drive_of_design, find_drive

    kind, colon, what = name.partition(":")
    if not colon:
        return find_drive(name)
    if kind == "job":
        best = given_design(name, None, server=server, db=db)
        return drive_of_design(name, best.controller, best.values)
    for controller in CONTROLLERS:
        if kind == controller:
            return drive_of_design(name, controller, read_design(what, controller))
    raise InvalidRequest(
        f"{kind!r} is neither `job` nor a controller ({', '.join(CONTROLLERS)})", field="drive"
    )


def _row(figures: WalkFigures) -> dict[str, object]:
    return {
        "drive": figures.drive,
        "scenario": figures.scenario,
        "status": figures.status.label,
        "speed": figures.speed,
        "power": figures.power,
        "effectivity": figures.effectivity,
        "objectives": dict(figures.objectives),
    }


def _show(drives: list[NamedDrive], figures: tuple[WalkFigures, ...]) -> None:
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables import Table, number

    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("scenario\ndrive", no_wrap=True)
    table.add_column("status")
    heads = ("speed m/s", "power W", "effect. m/J", "torque N m", "accel. m/s2", "ang.acc. rad/s2")
    for head in (*heads, "energy J/m"):
        table.add_column(head.replace(" ", "\n", 1), justify="right")
    scenario = ""
    for f in figures:
        if f.scenario != scenario:
            scenario = f.scenario
            table.add_row(scenario, style="bold")
        named = ("torque", "acceleration", "angular_acceleration", "energy")
        values = (f.speed, f.power, f.effectivity, *(f.objectives[name] for name in named))
        table.add_row(f"  {f.drive}", f.status.label, *(number(value) for value in values))
    console = stdout_console()
    console.print(table)
    for drive in drives:
        console.print(f"{drive.name}: {drive.description}", markup=False, highlight=False)
