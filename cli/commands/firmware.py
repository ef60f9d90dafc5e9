"""`gaitswarm firmware`: a design as C for the robot's microcontrollers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import ControllerOption, Place, RobotOption
from gaitswarm.cli.output import note
from gaitswarm.cli.tables import table

if TYPE_CHECKING:
    from gaitswarm.cli.output import Printed
    from gaitswarm.cli.rich_table import Table
    from gaitswarm.firmware import FirmwareView


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
    *,
    place: Place,
) -> Printed:
    """Write a design as C for the robot's microcontrollers, with a test against simulations."""
    from gaitswarm.cli.inputs.design_file import given_design
    from gaitswarm.cli.inputs.robots import chosen_scenarios
    from gaitswarm.firmware import write_firmware

    given = given_design(design, controller, robot=robot, place=place)
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
    return view, _parts(view)


def _bits(text: str) -> tuple[int, int]:
    from gaitswarm.errors import simulation_errors
    from gaitswarm.sim.firmware import parsed_table_bits

    with simulation_errors("table_bits"):
        return parsed_table_bits(text)


def _parts(view: FirmwareView) -> Iterator[Table | str]:
    heads = ("walk", "samples", "rows at 500 Hz", "columns", "B", "B of a leg")
    rows = (
        (
            *(walk.scenario, walk.status, walk.samples, gait.rows, gait.columns),
            *(gait.bytes, gait.bytes_of_a_leg),
        )
        for walk, gait in zip(view.walks, view.trajectories, strict=True)
    )
    yield table(["scenario", *heads], rows)
    memory = view.memory
    yield (
        f"tables: {memory.tables} B of the {memory.flash} B of flash of an {memory.processor};"
        f" state between ticks: {memory.remembered} B of {memory.ram} B of RAM"
    )
    if view.table_difference is not None:
        differences = ", ".join(
            f"{name.replace('_', ' ')} {'unknown' if share is None else f'{share:.2%}'}"
            for name, share in view.table_difference.items()
        )
        yield f"largest differences from 10 x 6 bits: {differences}"
    for remark in memory.remarks:
        yield f"does not fit: {remark}"
    note(f"{len(view.files)} files written; to compare {view.samples} samples, run")
    note(f"  make -C {view.folder} test")
