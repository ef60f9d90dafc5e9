"""`gaitswarm robot`: a robot of one's own from a URDF, and a look at it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeVar

import typer

from gaitswarm.cli.inputs.options import Json

if TYPE_CHECKING:
    from gaitswarm.meshes import MeshCopies
    from gaitswarm.sim.proposal.drive import ActuatorChoice
    from gaitswarm.sim.proposal.frame import Axis
    from gaitswarm.sim.robot import RobotFiles
    from gaitswarm.views.robots import RobotCheckView

_Choice = TypeVar("_Choice", bound=str)

_NAMED: Final = 5
"""Missing meshes that are named."""

Folder = Annotated[
    Path, typer.Argument(metavar="FOLDER", help="With robot.toml and robot.urdf.", exists=False)
]

PackagePath = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="FOLDER",
        help="Where package:// of meshes is looked for, before ROS_PACKAGE_PATH; repeatable.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = typer.Typer(help="Make a robot of your own from its URDF, and check it.")
    group.command()(init)
    group.command()(check)
    app.add_typer(group, name="robot")


def init(
    urdf: Annotated[Path, typer.Argument(metavar="FILE.urdf", help="Of a robot with legs.")],
    *,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FOLDER", help="New, or empty.")
    ],
    name: Annotated[
        str | None, typer.Option(help="Of the robot [default: the URDF's, else the file's].")
    ] = None,
    actuator: Annotated[
        str,
        typer.Option(
            metavar="auto|dc|torque",
            help="Kind of its actuators: DC motors with gearheads, or torque-controlled ones; auto"
            " decides by the torques and rates of the URDF.",
        ),
    ] = "auto",
    up: Annotated[
        str | None,
        typer.Option(
            metavar="AXIS",
            help="Of its first link, that points up: x, y, z, -x, -y, -z [default: z; refused if"
            " the legs speak against it].",
        ),
    ] = None,
    forward: Annotated[
        str | None,
        typer.Option(
            metavar="AXIS",
            help="Of its first link, that points ahead [default: x; a warning if the legs speak"
            " against it].",
        ),
    ] = None,
    meshes: Annotated[
        bool,
        typer.Option(
            "--meshes/--no-meshes",
            help="Copy the meshes that the URDF names: the page shows them, no walk needs them.",
        ),
    ] = True,
    package_path: PackagePath = None,
    as_json: Json = False,
) -> None:
    """Find legs, choose a stance, propose actuators, and write a robot's folder.

    It holds robot.toml, with a comment on every guess; robot.urdf and its meshes; and job.json,
    what jobs of this robot have unless they say otherwise. Then --robot FOLDER works in every
    command.
    """
    from gaitswarm.cli.output import note, print_text
    from gaitswarm.robots import init_robot

    made = init_robot(
        urdf,
        output,
        name=name,
        actuator=_kind(actuator),
        up=_axis(up, "up"),
        forward=_axis(forward, "forward"),
        meshes=meshes,
        packages=package_path or [],
    )
    if as_json:
        left_out = [{"name": name, "problem": problem} for name, problem in made.meshes.left_out]
        _print(
            {
                "folder": str(output),
                "name": made.name,
                "guesses": list(made.guesses),
                "meshes": {"copied": list(made.meshes.copied), "left_out": left_out},
            }
        )
        return
    for guess in made.guesses:
        print_text(f"{guess}\n")
    print_text(_copied(made.meshes))
    note(
        f"robot {made.name!r} written to {output}; look at it with `gaitswarm robot check {output}`"
    )
    if made.meshes.copied:
        note(f"`gaitswarm serve --robots {output}` shows its meshes on the page")


def check(
    folder: Folder,
    *,
    draw: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw how it stands into FILE.png, .svg or .pdf."),
    ] = None,
    package_path: PackagePath = None,
    as_json: Json = False,
) -> None:
    """Load a robot, let it stand for a second, and say what there is to it."""
    from gaitswarm.cli.output import note, print_json, print_text
    from gaitswarm.robots import check_robot

    view = check_robot(_files(folder), folder=folder, packages=package_path or [])
    if draw is not None:
        from gaitswarm.cli.pictures import draw_robot, save

        save(draw_robot(view), draw, "draw")
        note(f"picture written to {draw}")
    if as_json:
        print_json(view)
        return
    print_text(_told(view))
    for warning in view.warnings:
        note(f"warning: {warning}")


def _kind(text: str) -> ActuatorChoice:
    from gaitswarm.sim.proposal.drive import ACTUATOR_CHOICES

    return _one_of(text, ACTUATOR_CHOICES, "actuator")


def _axis(text: str | None, field: str) -> Axis | None:
    from gaitswarm.sim.proposal.frame import AXES

    return None if text is None else _one_of(text, AXES, field)


def _one_of(text: str, choices: Sequence[_Choice], field: str) -> _Choice:
    from gaitswarm.services.optimizer.errors import InvalidRequest

    for choice in choices:
        if choice == text:
            return choice
    raise InvalidRequest(f"{text!r} is none of {', '.join(choices)}", field=field)


def _copied(meshes: MeshCopies) -> str:
    found, lost = len(meshes.copied), meshes.left_out
    if not found and not lost:
        return ""
    lines = [f"meshes: {found} of {found + len(lost)} copied, {meshes.size / 1e6:.1f} MB"]
    lines += [f"  left out: {name[:200]}: {problem}" for name, problem in lost[:_NAMED]]
    if len(lost) > _NAMED:
        lines.append(f"  and {len(lost) - _NAMED} more; --package-path names folders of packages")
    return "\n".join(lines) + "\n"


def _files(folder: Path) -> RobotFiles:
    from gaitswarm.cli.inputs.robots import chosen_robot
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.sim.robot import RobotFiles

    if not folder.is_dir():
        raise InvalidRequest(f"{folder} is no folder", field="folder")
    files = chosen_robot(str(folder))
    if not isinstance(files, RobotFiles):
        raise InvalidRequest(f"{folder} is no robot's folder", field="folder")
    return files


def _told(view: RobotCheckView) -> str:
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
        f"{'body, and what is held':{21 + width}} {view.body_mass:6.3f} kg",
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
        lines += ["guessed, as robot.toml has it:", *(f"  {guess}" for guess in view.guesses)]
    if view.meshes:
        missing = [mesh.name for mesh in view.meshes if mesh.path is None]
        lines.append(f"meshes: {len(view.meshes) - len(missing)} of {len(view.meshes)} found")
        lines += [f"  missing: {name}" for name in missing[:_NAMED]]
        if len(missing) > _NAMED:
            lines.append(f"  and {len(missing) - _NAMED} more; name their folder by --package-path")
    return "\n".join(lines) + "\n"


def _print(document: dict[str, Any]) -> None:
    import json

    from gaitswarm.cli.output import print_text

    print_text(json.dumps(document, indent=2, ensure_ascii=False) + "\n")
