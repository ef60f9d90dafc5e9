"""`gaitswarm compare`: drives in the same scenarios."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitswarm.cli.inputs.options import Place, RobotOption
from gaitswarm.cli.output import note
from gaitswarm.cli.tables import Bold, number, table
from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from gaitswarm.cli.output import Printed
    from gaitswarm.cli.rich_table import Table
    from gaitswarm.sim.drives import NamedDrive, WalkFigures


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
    *,
    place: Place,
) -> Printed:
    """Compare drives in the same scenarios: speed, power, effectivity, objectives."""
    from gaitswarm.cli.inputs.robots import chosen_robot, chosen_scenarios
    from gaitswarm.sim.drives import DRIVES
    from gaitswarm.sim.drives import compare as compare_drives

    compared = [_drive(name, place) for name in drives or DRIVES]
    walked = chosen_scenarios(scenario, robot)
    figures = compare_drives(compared, walked, robot=chosen_robot(robot))
    if plot is not None:
        from gaitswarm.cli.pictures import draw_comparison, save

        save(draw_comparison(figures), plot)
        note(f"picture written to {plot}")
    return [_row(f) for f in figures], _parts(compared, figures)


def _drive(name: str, place: Place) -> NamedDrive:
    from gaitswarm.cli.inputs.design_file import given_design, read_design
    from gaitswarm.sim.controllers import CONTROLLERS
    from gaitswarm.sim.drives import drive_of_design, find_drive

    kind, colon, what = name.partition(":")
    if not colon:
        return find_drive(name)
    if kind == "job":
        best = given_design(name, None, place=place)
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


def _parts(drives: list[NamedDrive], figures: tuple[WalkFigures, ...]) -> Iterator[Table | str]:
    named = ("torque", "acceleration", "angular_acceleration", "energy")
    rows: list[list[Any]] = []
    scenario = ""
    for f in figures:
        if f.scenario != scenario:
            scenario = f.scenario
            rows.append(Bold([scenario]))
        values = (f.speed, f.power, f.effectivity, *(f.objectives[name] for name in named))
        rows.append([f"  {f.drive}", f.status.label, *map(number, values)])
    heads = ("speed m/s", "power W", "effect. m/J", "torque N m", "accel. m/s2", "ang.acc. rad/s2")
    broken = (head.replace(" ", "\n", 1) for head in (*heads, "energy J/m"))
    yield table(["scenario\ndrive", "<status", *broken], rows)
    for drive in drives:
        yield f"{drive.name}: {drive.description}"
