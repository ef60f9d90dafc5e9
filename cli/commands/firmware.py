"""`gaitswarm firmware`: a design as C for the robot's microcontrollers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import ControllerOption, Db, Json, RobotOption, Server

if TYPE_CHECKING:
    from gaitswarm.views.firmware import FirmwareView


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(firmware)


def firmware(
    design: Annotated[
        str,
        typer.Argument(
            metavar="DESIGN|ID",
            help="published:NAME, a file as for `simulate`, `-`, or a job's id for its best.",
        ),
    ],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="FOLDER", help="New folder."),
    ],
    scenarios: Annotated[
        str | None,
        typer.Option(
            help="Names, numbers or FILE.json, separated by commas, or all [default: the job's,"
            " else all]."
        ),
    ] = None,
    controller: ControllerOption = None,
    robot: RobotOption = None,
    table_bits: Annotated[
        str | None,
        typer.Option(
            metavar="ERRORxCURRENT",
            help="Bits of a fuzzy table's indices, also for the simulations [default: 10x6].",
        ),
    ] = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Write a design as C for the robot's microcontrollers, with a test against simulations."""
    from gaitswarm.cli.inputs.design_file import given_design
    from gaitswarm.cli.inputs.robots import chosen_scenarios
    from gaitswarm.cli.output import print_json
    from gaitswarm.firmware import write_firmware

    given = given_design(design, controller, robot=robot, server=server, db=db)
    if given.spec is None or scenarios is not None:
        walks = chosen_scenarios(scenarios or "all", robot)
    else:
        walks = given.spec.resolved_scenarios()
    view = write_firmware(
        given.values,
        output,
        scenarios=walks,
        controller=given.controller,
        robot=given.robot(robot),
        label=given.label,
        table_bits=None if table_bits is None else _bits(table_bits),
    )
    if as_json:
        print_json(view)
    else:
        _show(view)


def _bits(text: str) -> tuple[int, int]:
    from gaitswarm.errors import simulation_errors
    from gaitswarm.sim.firmware import parsed_table_bits

    with simulation_errors("table_bits"):
        return parsed_table_bits(text)


def _show(view: FirmwareView) -> None:
    from gaitswarm.cli.output import note, stdout_console
    from gaitswarm.cli.tables import Table

    table = Table(box=None, padding=(0, 2, 0, 0))
    table.add_column("scenario", no_wrap=True)
    for heading in ("walk", "samples", "rows at 500 Hz", "columns", "B", "B of a leg"):
        table.add_column(heading, justify="right")
    for walk, gait in zip(view.walks, view.trajectories, strict=True):
        numbers = (walk.samples, gait.rows, gait.columns, gait.bytes, gait.bytes_of_a_leg)
        table.add_row(walk.scenario, walk.status, *map(str, numbers))
    console, memory = stdout_console(), view.memory
    console.print(table)
    console.print(
        f"tables: {memory.tables} B of the {memory.flash} B of flash of an {memory.processor};"
        f" state between ticks: {memory.remembered} B of {memory.ram} B of RAM",
        markup=False,
    )
    if view.table_difference is not None:
        differences = ", ".join(
            f"{name.replace('_', ' ')} {'unknown' if share is None else f'{share:.2%}'}"
            for name, share in view.table_difference.items()
        )
        console.print(f"largest differences from 10 x 6 bits: {differences}", markup=False)
    for remark in memory.remarks:
        console.print(f"does not fit: {remark}", markup=False)
    note(f"{len(view.files)} files written; to compare {view.samples} samples, run")
    note(f"  make -C {view.folder} test")
