"""`gaitswarm study`: what simplifications cost; what controllers and searches in worlds gain."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from gaitswarm.cli.commands.studies.study_controllers import controllers
from gaitswarm.cli.commands.studies.study_precision import precision
from gaitswarm.cli.commands.studies.study_worlds import worlds
from gaitswarm.cli.inputs.options import ControllerOption, Db, Json, RobotOption, Server

if TYPE_CHECKING:
    from collections.abc import Iterable

    from gaitswarm.sim.studies.accuracy import Deviation

NoiseKind = Literal["angle", "torque"]

Design = Annotated[
    str, typer.Option(metavar="JSON|FILE|published:NAME|job:ID", help="Design as for `simulate`.")
]
Scenario = Annotated[str, typer.Option(help="Name or number, several separated by commas, or all.")]


def register(app: typer.Typer) -> None:
    """Add the group of commands."""
    studies = typer.Typer(
        help="Measure what tables, steps, noise, precision and the controller do to the objectives,"
        " and what a search in worlds gains."
    )
    studies.command()(tables)
    studies.command()(steps)
    studies.command()(noise)
    studies.command()(precision)
    studies.command()(controllers)
    studies.command()(worlds)
    app.add_typer(studies, name="study")


def tables(
    design: Design = "published:A",
    scenario: Scenario = "all",
    robot: RobotOption = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Compare a Fuzzy-PI's tables of 6 x 6, 8 x 8 and 10 x 6 bits with full inference."""
    from gaitswarm.cli.inputs.design_file import given_design
    from gaitswarm.cli.inputs.robots import chosen_scenarios
    from gaitswarm.sim.studies.accuracy import tables_against_inference

    given = given_design(design, "fuzzy-pi", robot=robot, server=server, db=db)
    chosen = chosen_scenarios(scenario, robot)
    machine = given.robot(robot)
    _show(tables_against_inference(given.values, chosen, robot=machine), as_json=as_json)


def steps(
    design: Design = "published:A",
    controller: ControllerOption = None,
    scenario: Scenario = "all",
    robot: RobotOption = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Compare physics at 2.5, 5, 10 and 20 kHz with 40 kHz."""
    from gaitswarm.cli.inputs.design_file import given_design
    from gaitswarm.cli.inputs.robots import chosen_scenarios
    from gaitswarm.sim.studies.accuracy import step_halving

    given = given_design(design, controller, robot=robot, server=server, db=db)
    chosen = chosen_scenarios(scenario, robot)
    machine = given.robot(robot)
    _show(step_halving(given.controller, given.values, chosen, robot=machine), as_json=as_json)


def noise(
    design: Design = "published:A",
    controller: ControllerOption = None,
    scenario: Scenario = "1",
    kind: Annotated[
        NoiseKind, typer.Option(help="On the angle between gearhead and link, or on its torque.")
    ] = "angle",
    deviation: Annotated[
        float | None,
        typer.Option(
            help="Standard deviation of the noise; by default 0.001 rad, or 10 N m of torque."
        ),
    ] = None,
    robot: RobotOption = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Put noise on one kind of link after the other; ratios to the noiseless walk (table 2.9)."""
    from gaitswarm.cli.inputs.design_file import given_design
    from gaitswarm.cli.inputs.robots import chosen_scenarios
    from gaitswarm.sim.studies.accuracy import noise_on_links

    given = given_design(design, controller, robot=robot, server=server, db=db)
    chosen = chosen_scenarios(scenario, robot)
    machine = given.robot(robot)
    found = noise_on_links(
        given.controller, given.values, chosen, robot=machine, kind=kind, deviation=deviation
    )
    _show(found, as_json=as_json, ratios=True)


_HEADS = {
    "torque": "torque",
    "acceleration": "accel.",
    "angular_acceleration": "ang.acc.",
    "energy": "energy",
    "reciprocal_speed": "1/speed",
}


def _show(deviations: Iterable[Deviation], *, as_json: bool, ratios: bool = False) -> None:
    import json
    import math

    from gaitswarm.cli.output import print_text, stdout_console
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.sim.outcome import OBJECTIVE_NAMES

    def finite(value: float) -> float | None:
        return value if math.isfinite(value) else None

    rows = list(deviations)
    if as_json:
        items = [
            {
                "variant": row.variant,
                "scenario": row.scenario,
                "ratio": {
                    name: finite(value)
                    for name, value in zip(OBJECTIVE_NAMES, row.ratio.tolist(), strict=True)
                },
                **({"quality": finite(row.quality)} if ratios else {}),
            }
            for row in rows
        ]
        print_text(json.dumps(items, indent=2))
        return
    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("scenario", no_wrap=True)
    table.add_column("variant", no_wrap=True)
    # f6 is a difference of millimetres, and its ratio says little.
    for name in OBJECTIVE_NAMES[:5]:
        table.add_column(_HEADS[name], justify="right")
    if ratios:
        table.add_column("quality", justify="right")
    for row in rows:
        values = row.ratio if ratios else 100.0 * row.relative
        unit = "" if ratios else " %"
        shown = [*values.tolist()[:5], *([row.quality] if ratios else [])]
        cells = [f"{v:.2f}{unit}" if math.isfinite(v) else "-" for v in shown]
        table.add_row(row.scenario, row.variant, *cells)
    stdout_console().print(table)
