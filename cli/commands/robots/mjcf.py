"""`gaitswarm mjcf`: a robot for MuJoCo."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gaitswarm.cli.inputs.options import RobotOption


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(mjcf)


def mjcf(
    *,
    robot: RobotOption = None,
    scenario: Annotated[
        str | None,
        typer.Option(
            help="Whose load, slope and first pose the model has: name, number or FILE [default:"
            " the first of the robot's folder, else normal-fast]."
        ),
    ] = None,
    contacts: Annotated[
        bool,
        typer.Option(help="Let soles meet the ground, by MuJoCo's own contacts fitted to ours."),
    ] = True,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE.xml", help="Default: standard output."),
    ] = None,
) -> None:
    """Write a robot as MJCF, which MuJoCo's viewer opens: with voltages or torques as controls.

    Needs pip install 'gaitswarm[mujoco]'. The viewer comes with pip install mujoco:
    python -m mujoco.viewer --mjcf=FILE.xml.
    """
    from gaitswarm.cli.inputs.robots import chosen_robot, one_scenario
    from gaitswarm.cli.output import note, print_text
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.sim.mujoco.engines import check_installed
    from gaitswarm.sim.robot import load_robot

    machine = load_robot(chosen_robot(robot))
    chosen = one_scenario(scenario, robot, preset="normal-fast")
    check_installed()
    from gaitswarm.sim.mujoco.model import exported

    text = exported(machine, chosen, contacts=contacts)
    if output is None:
        print_text(text)
        return
    try:
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InvalidRequest(f"cannot write {output}: {error}", field="output") from error
    note(f"model written to {output}")
