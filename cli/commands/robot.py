"""Commands about robots: init, check, gaits, mjcf."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from gaitswarm.cli.options import RobotOption, name_and_value, one_of
from gaitswarm.cli.output import Printed, note, print_text
from gaitswarm.cli.tables import gait_in_words
from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from gaitswarm.cli.gaits import GaitsView, GaitView
    from gaitswarm.robots import MadeRobot, RobotCheckView
    from gaitswarm.sim.proposal.drive import ActuatorChoice
    from gaitswarm.sim.robot import RobotFiles

_LISTED: Final = 5
"""Missing meshes that are listed."""

Folder = Annotated[
    Path,
    typer.Argument(metavar="FOLDER", help="Folder of robot.toml and robot.urdf.", exists=False),
]


def init(
    urdf: Annotated[Path, typer.Argument(metavar="FILE")],
    *,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER")],
    name: str | None = None,
    actuator: Annotated[
        list[str] | None, typer.Option(metavar="auto|dc|torque|[JOINT=]NAME")
    ] = None,
    up: Annotated[str | None, typer.Option(metavar="AXIS")] = None,
    forward: Annotated[str | None, typer.Option(metavar="AXIS")] = None,
    meshes: Annotated[bool, typer.Option("--meshes/--no-meshes")] = True,
    package: Annotated[list[str] | None, typer.Option(metavar="[NAME=]FOLDER")] = None,
    arg: Annotated[list[str] | None, typer.Option(metavar="NAME=VALUE")] = None,
    lock: Annotated[list[str] | None, typer.Option(metavar="JOINT=ANGLE")] = None,
    foot: Annotated[list[str] | None, typer.Option(metavar="LINK=X,Y,Z")] = None,
    mass: Annotated[float | None, typer.Option(min=0.001)] = None,
) -> Printed:
    """Find legs, choose a stance, propose actuators, and write a robot's folder.

    It contains robot.toml, with a comment on every guess; robot.urdf and its meshes; and job.json,
    the defaults of this robot's jobs. Then pass --robot FOLDER to any command. xacro needs
    pip install 'gaitswarm[xacro]', MJCF 'gaitswarm[mujoco]'.

    Args:
        urdf: URDF, xacro or MJCF of a legged robot.
        output: New or empty folder.
        name: Name of the robot [default: the URDF's, else the file's].
        actuator: Actuators: DC motors with gearheads, or torque-controlled; auto decides by the
            URDF's torques and rates. Or a servo by name, for all joints or those with the wildcards
            * and ?; repeatable, and the last match counts: mx64, mx106, xl320, xl330, sts3215,
            erob80-50, erob80-100, mg996r, ds3218, mini-cheetah [default: auto].
        up: Axis of the first link that points up: x, y, z, -x, -y, -z [default: z; refused if
            inconsistent with the legs].
        forward: Axis of the first link that points forward [default: x; a warning if inconsistent
            with the legs].
        meshes: Copy the URDF's meshes, which the page shows; simulations do not need them.
        package: Folder of the ROS package NAME, or of packages, for package:// and $(find); before
            ROS_PACKAGE_PATH; repeatable.
        arg: Argument of a xacro file; repeatable.
        lock: Hold a joint at an angle [rad]; * and ? are wildcards; repeatable. Wheels, arms and
            whatever belongs to no leg are held anyway.
        foot: End of the leg with this last link, in the link's frame [m]; * and ? are wildcards;
            repeatable [default: what the link's shapes suggest].
        mass: Mass of the robot [kg], to which all masses are scaled [default: the file's].
    """
    from gaitswarm.robots import init_robot
    from gaitswarm.sim.proposal.legs import AXES

    kind, actuators = _actuators(actuator or [])
    created = init_robot(
        urdf,
        output,
        name=name,
        actuator=kind,
        up=None if up is None else one_of(AXES, up, "up"),
        forward=None if forward is None else one_of(AXES, forward, "forward"),
        meshes=meshes,
        packages=[
            (name or None, Path(folder).expanduser())
            for name, _, folder in (entry.rpartition("=") for entry in package or [])
        ],
        arguments=dict(name_and_value(entry, "arg") for entry in arg or []),
        locks={
            joint: numbers_of(angle, 1, "lock")[0]
            for joint, angle in (name_and_value(e, "lock", "JOINT=ANGLE") for e in lock or [])
        },
        feet={
            link: numbers_of(at, 3, "foot")
            for link, at in (name_and_value(e, "foot", "LINK=X,Y,Z") for e in foot or [])
        },
        mass=mass,
        actuators=actuators,
    )
    left_out = [{"name": name, "problem": why} for name, why in created.left_out.items()]
    document = {
        "folder": str(output),
        "name": created.name,
        "guesses": list(created.guesses),
        "meshes": {"copied": created.copied, "left_out": left_out},
    }
    return document, _created(created, output)


def _actuators(entries: list[str]) -> tuple[ActuatorChoice, dict[str, str]]:
    """Split the option into a kind and names by joint."""
    from gaitswarm.sim.near_names import instead_of
    from gaitswarm.sim.proposal.drive import ACTUATOR_CHOICES
    from gaitswarm.sim.robot.description import listed_actuators

    for choice in ACTUATOR_CHOICES:
        if entries in ([], [choice]):
            return choice, {}
    known = [*ACTUATOR_CHOICES, *listed_actuators()]
    for name in (entry.rpartition("=")[2].strip() for entry in entries):
        if name not in known[len(ACTUATOR_CHOICES) :]:
            raise InvalidRequest(f"{name!r}: {instead_of(name, known)}", field="actuator")
    of_joints = [e if "=" in e else f"*={e}" for e in entries]
    return "auto", dict(name_and_value(e, "actuator", "JOINT=NAME") for e in of_joints)


def numbers_of(text: str, count: int, option: str) -> list[float]:
    """Return the finite numbers of a text that has so many, separated by commas."""
    with suppress(ValueError):
        numbers = [float(part) for part in text.split(",")]
        if len(numbers) == count and all(map(math.isfinite, numbers)):
            return numbers
    wanted = "a number" if count == 1 else f"{count} numbers separated by commas"
    raise InvalidRequest(f"{text!r} is not {wanted}", field=option)


def _created(created: MadeRobot, folder: Path) -> Iterator[str]:
    for guess in created.guesses:
        yield f"{guess}\n"
    yield _mesh_summary(created.copied, created.left_out)
    note(
        f"robot {created.name!r} written to {folder}; check it by `gaitswarm robot check {folder}`"
    )
    if created.copied:
        note(f"`gaitswarm serve --robots {folder}` shows its meshes on the page")


def check(
    folder: Folder,
    *,
    draw: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw its stance to FILE.png, .svg or .pdf."),
    ] = None,
) -> Printed:
    """Load a robot, simulate it standing for a second, and show its properties."""
    from gaitswarm.robots import check_robot

    view = check_robot(_files(folder))
    if draw is not None:
        from gaitswarm.cli.pictures import draw_robot, save

        save(draw_robot(view), draw, "draw")
    return view, _checked(view)


def _checked(view: RobotCheckView) -> Iterator[str]:
    yield _summary(view)
    for warning in view.warnings:
        note(f"warning: {warning}")


def _mesh_summary(copied: list[str], left_out: dict[str, str]) -> str:
    if not copied and not left_out:
        return ""
    lines = [f"meshes: {len(copied)} of {len(copied) + len(left_out)} copied"]
    lines += [f"  left out: {name[:200]}: {why}" for name, why in list(left_out.items())[:_LISTED]]
    if len(left_out) > _LISTED:
        lines.append(f"  and {len(left_out) - _LISTED} more; pass --package NAME=FOLDER")
    return "\n".join(lines) + "\n"


def _files(folder: Path) -> RobotFiles:
    from gaitswarm.cli.inputs import chosen_robot
    from gaitswarm.sim.robot import RobotFiles

    if not folder.is_dir():
        raise InvalidRequest(f"{folder} is not a folder", field="folder")
    files = chosen_robot(str(folder))
    if not isinstance(files, RobotFiles):
        raise InvalidRequest(f"{folder} is not a robot's folder", field="folder")
    return files


def _summary(view: RobotCheckView) -> str:
    standing = view.standing
    stood = (
        f"standing for {standing.seconds:g} s: soles carry {standing.normal_forces:.1f} N of"
        f" {standing.weight:.1f} N; the body is at {standing.height:.3f} m"
    )
    width = max(len(", ".join(leg.joints)) for leg in view.legs)
    lines = [
        f"{view.name}: {len(view.legs)} legs, {view.joints} joints, {view.mass:.3f} kg",
        "",
        f"{'leg':20} {'joints':{width}} {'mass':>9} {'length':>8} {'reach':>8}",
        f"{'body and held joints':{21 + width}} {view.body_mass:6.3f} kg",
        *(
            f"{leg.name:20} {', '.join(leg.joints):{width}} {leg.mass:6.3f} kg {leg.length:6.3f} m"
            f" {leg.reach:6.3f} m"
            for leg in view.legs
        ),
        "",
        stood,
    ]
    lines += [f"held: {name} at {angle:g} rad" for name, angle in view.held.items()]
    if view.guesses:
        lines += ["guesses in robot.toml:", *(f"  {guess}" for guess in view.guesses)]
    return "\n".join(lines) + "\n"


def gaits(
    gait: Annotated[str | None, typer.Argument(metavar="[GAIT]")] = None,
    *,
    robot: RobotOption = None,
    scenario: str | None = None,
    duty_factor: float | None = None,
) -> Printed:
    """List gaits: order of footfalls, supporting feet, static stability.

    Args:
        gait: Gait to draw [default: list all].
        scenario: Scenario that sets posture, stride and sway: name, number or FILE.json [default:
            the first of the robot's folder, else normal-slow].
        duty_factor: Share of the cycle in support [default: the gait's usual one].
    """
    from gaitswarm.cli.gaits import planned_gaits
    from gaitswarm.cli.inputs import chosen_robot, one_scenario

    view = planned_gaits(
        chosen_robot(robot),
        one_scenario(scenario, robot, preset="normal-slow"),
        name=gait,
        duty_factor=duty_factor,
    )
    heading = f"{view.robot} in the scenario {view.scenario}\n\n"
    return view, heading + (_gaits(view) if gait is None else diagram(view.items[0]))


def _gaits(view: GaitsView) -> str:
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
    if not item.suits:
        return f"{item.name}: for {' or '.join(map(str, item.legs))} legs\n"
    lines = [f"{leg:14} {columns}" for leg, columns in item.support.items()]
    return "\n".join([*lines, "", f"{item.name}: {_plan(item)}", ""])


def _plan(item: GaitView) -> str:
    return "out of the legs' reach" if item.planned is None else gait_in_words(item.planned)


def mjcf(
    *,
    robot: RobotOption = None,
    scenario: str | None = None,
    contacts: bool = True,
    output: Annotated[Path | None, typer.Option("--output", "-o", metavar="FILE.xml")] = None,
) -> None:
    """Write a robot as an MJCF model for MuJoCo, with voltages or torques as controls.

    Needs pip install 'gaitswarm[mujoco]'. To view it: python -m mujoco.viewer --mjcf=FILE.xml.

    Args:
        scenario: Scenario that sets load, slope and first pose: name, number or FILE [default: the
            first of the robot's folder, else normal-fast].
        contacts: Include MuJoCo's contacts of the soles, fitted to ours.
        output: Default: standard output.
    """
    from gaitswarm.cli.inputs import chosen_robot, one_scenario
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
