"""`gaitswarm gaits` and `gaitswarm mjcf`: planned gaits, and a robot's model for MuJoCo."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import RobotOption
from gaitswarm.cli.output import note, print_text
from gaitswarm.cli.tables import gait_in_words
from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from gaitswarm.cli.output import Printed
    from gaitswarm.gaits import GaitsView, GaitView


def gaits(
    gait: Annotated[
        str | None, typer.Argument(metavar="[GAIT]", help="Gait to draw [default: list all].")
    ] = None,
    *,
    robot: RobotOption = None,
    scenario: Annotated[
        str | None,
        typer.Option(
            help="Scenario that sets posture, stride and sway: name, number or FILE.json [default:"
            " the first of the robot's folder, else normal-slow]."
        ),
    ] = None,
    duty_factor: Annotated[
        float | None,
        typer.Option(help="Share of the cycle in support [default: the gait's usual one]."),
    ] = None,
) -> Printed:
    """List gaits: order of footfalls, supporting feet, static stability."""
    from gaitswarm.cli.inputs.robots import chosen_robot, one_scenario
    from gaitswarm.gaits import planned_gaits

    view = planned_gaits(
        chosen_robot(robot),
        one_scenario(scenario, robot, preset="normal-slow"),
        name=gait,
        duty_factor=duty_factor,
    )
    heading = f"{view.robot} in the scenario {view.scenario}\n\n"
    return view, heading + (_list(view) if gait is None else diagram(view.items[0]))


def _list(view: GaitsView) -> str:
    lines = []
    for item in view.items:
        order = sorted(item.lags, key=lambda leg: item.lags[leg])
        footfalls = ", ".join(f"{leg} {item.lags[leg]:.2f}" for leg in order)
        order_text = footfalls or f"for {' or '.join(map(str, item.legs))} legs"
        lines += [f"{item.name:12} {item.description}", f"{'':12} {order_text}"]
        if item.suits:
            lines.append(f"{'':12} {_plan(item)}")
    return "\n".join(lines) + "\n"


def diagram(item: GaitView) -> str:
    """Return a gait's footfall diagram."""
    if not item.suits:
        return f"{item.name}: for {' or '.join(map(str, item.legs))} legs\n"
    lines = [f"{leg:14} {columns}" for leg, columns in item.support.items()]
    return "\n".join([*lines, "", f"{item.name}: {_plan(item)}", ""])


def _plan(item: GaitView) -> str:
    return "out of the legs' reach" if item.planned is None else gait_in_words(item.planned)


def mjcf(
    *,
    robot: RobotOption = None,
    scenario: Annotated[
        str | None,
        typer.Option(
            help="Scenario that sets load, slope and first pose: name, number or FILE [default:"
            " the first of the robot's folder, else normal-fast]."
        ),
    ] = None,
    contacts: Annotated[
        bool,
        typer.Option(help="Include MuJoCo's contacts of the soles, fitted to ours."),
    ] = True,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE.xml", help="Default: standard output."),
    ] = None,
) -> None:
    """Write a robot as an MJCF model for MuJoCo, with voltages or torques as controls.

    Needs pip install 'gaitswarm[mujoco]'. To view it: python -m mujoco.viewer --mjcf=FILE.xml.
    """
    from gaitswarm.cli.inputs.robots import chosen_robot, one_scenario
    from gaitswarm.sim.mujoco.engines import check_installed
    from gaitswarm.sim.robot import load_robot

    machine = load_robot(chosen_robot(robot))
    walk = one_scenario(scenario, robot, preset="normal-fast")
    check_installed()
    from gaitswarm.sim.mujoco.model import exported

    text = exported(machine, walk, contacts=contacts)
    if output is None:
        print_text(text)
        return
    try:
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InvalidRequest(f"cannot write {output}: {error}", field="output") from error
    note(f"model written to {output}")
