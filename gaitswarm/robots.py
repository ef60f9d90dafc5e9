"""Robots of one's own: made from a URDF, and checked."""

from __future__ import annotations

import json
import os
import re
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from gaitswarm.errors import simulation_errors
from gaitswarm.mesh_copies import MeshCopies, copy_meshes
from gaitswarm.meshes import find_mesh, mesh_names
from gaitswarm.views.robot_check import CheckedLegView, MeshView, RobotCheckView, StandingView
from services.optimizer.errors import InvalidRequest
from sim.errors import RobotFileError
from sim.gait.trajectory import desired_angles, require_reachable
from sim.outcome import Status
from sim.proposal.document import Proposal, propose_robot
from sim.proposal.drive import GRAVITY, ActuatorChoice
from sim.proposal.legs import reach_below
from sim.robot import Robot, RobotFiles, load_robot, parse_robot
from sim.robot.bounds import LONGEST_URDF
from sim.robot.legs import ChainLeg
from sim.robot.posture import feet_and_centre_of_mass, leg_points
from sim.scenario import Scenario
from sim.simulate import simulate

if TYPE_CHECKING:
    from sim.simulate import Simulation

JOB_FILE: Final = "job.json"
"""In a robot's folder: what a job of this robot has unless it says otherwise."""

_NAME: Final = re.compile(r"\w[^/\\]{0,99}")

_SECONDS: Final = 1.0
_STIFF: Final = 20.0
"""Stiffness with which torque-controlled joints are held, per torque limit [1/rad]."""

_DAMPED: Final = 0.02
"""Their damping, per stiffness [s]."""

_OFF: Final = 0.02
"""Share of the weight by which standing forces may be off before that is a warning."""


@dataclass(frozen=True, slots=True)
class MadeRobot:
    """A robot's folder that was written.

    Attributes:
        name: of the robot.
        guesses: what to look at, one sentence each.
        meshes: what became of the meshes that the URDF names.
    """

    name: str
    guesses: tuple[str, ...]
    meshes: MeshCopies


def init_robot(
    urdf: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    name: str | None = None,
    actuator: ActuatorChoice = "auto",
    meshes: bool = True,
    packages: Sequence[str | os.PathLike[str]] = (),
) -> MadeRobot:
    """Make a robot's folder from a URDF: legs, stance, actuators and two walks are chosen.

    The meshes that the URDF names are copied, so that the folder can be shown wherever it goes.
    What is missing, no STL, OBJ or DAE, or too large is left out: no simulation needs them.

    Args:
        urdf: File of the robot.
        output: Folder to write, new or empty; as a whole or not at all.
        name: Of the robot; default the file's.
        actuator: Kind of its actuators: DC motors, torque-controlled ones, or those that the limits
            of the URDF's joints speak for.
        meshes: Whether to copy meshes.
        packages: Folders in which `package://` is looked for, before those of ROS_PACKAGE_PATH.

    Returns:
        What was made.

    Raises:
        InvalidRequest: The file cannot be read or has no legs that can be simulated, or the folder
            cannot be written; names the field.
    """
    source, folder = Path(urdf), Path(output)
    _check_free(folder)
    try:
        with source.open(encoding="utf-8") as file:
            text = file.read(LONGEST_URDF + 1)
    except UnicodeDecodeError as error:
        raise InvalidRequest(not_utf8(source, error), field="urdf") from error
    except OSError as error:
        raise InvalidRequest(f"cannot read {source}: {error}", field="urdf") from error
    chosen = source.stem if name is None else name
    _check_name(chosen)
    try:
        proposal = propose_robot(text, chosen, actuator)
        robot = parse_robot(proposal.toml, proposal.urdf)
        for scenario in proposal.job["scenarios"]:
            require_reachable(robot, Scenario.model_validate(scenario))
    except RobotFileError as error:
        said = str(error).replace("robot.urdf", source.name, 1)
        raise InvalidRequest(said, field="urdf") from error
    with simulation_errors("urdf"):
        copies = _write(folder, proposal, source.parent if meshes else None, packages)
    return MadeRobot(chosen, proposal.guesses, copies)


def not_utf8(path: Path, error: UnicodeDecodeError) -> str:
    """What to say of a file that cannot be decoded.

    Args:
        path: Of the file.
        error: What Python says.

    Returns:
        A sentence with the way out.
    """
    byte = error.object[error.start]
    return (
        f"cannot read {path}: it is not UTF-8 text (byte 0x{byte:02x} at {error.start}); save it as"
        " UTF-8"
    )


def check_robot(
    files: RobotFiles,
    *,
    folder: str | os.PathLike[str] = ".",
    packages: Sequence[str | os.PathLike[str]] = (),
) -> RobotCheckView:
    """Load a robot, let it stand, and look for what is unphysical.

    Args:
        files: Of the robot.
        folder: Of its URDF, which paths of meshes are relative to.
        packages: Folders that `package://` is looked for in, before those of ROS_PACKAGE_PATH.

    Returns:
        What was seen.

    Raises:
        InvalidRequest: It cannot be simulated; names the file and the field.
        EvaluatorUnavailable: The compiler does not compile its kernel.
    """
    with simulation_errors("folder"):
        robot = load_robot(files)
        scenario = standing_scenario(robot)
        require_reachable(robot, scenario)
        controller, design = standing_drive(robot)
        values = np.array([list(design.values())])
        stood = simulate(scenario, controller, list(design), values, robot=robot, log=True)
    standing, warnings = _standing(robot, stood)
    angles = desired_angles(robot, scenario).angles[0]
    points = leg_points(robot, angles)
    mass = feet_and_centre_of_mass(robot, angles[None, :], 0.0)[1][0]
    return RobotCheckView(
        name=robot.description.name,
        mass=robot.mass,
        joints=robot.n_joints,
        legs=[
            CheckedLegView(
                name=data.name,
                joints=list(data.joints),
                foot=data.foot,
                length=sum(leg.lengths),
                reach=reach_below(robot, number),
                points=points[number].tolist(),
            )
            for number, (leg, data) in enumerate(
                zip(robot.legs, robot.description.legs, strict=True)
            )
        ],
        held=dict(robot.description.held_joints),
        centre_of_mass=mass.tolist(),
        standing=standing,
        meshes=[
            MeshView(name=name, path=None if found is None else str(found))
            for name in mesh_names(files.urdf)
            for found in [find_mesh(name, Path(folder), [Path(place) for place in packages])]
        ],
        warnings=[*warnings, *_unphysical(robot)],
    )


def standing_scenario(robot: Robot) -> Scenario:
    """A second in the robot's stance, all feet on the ground.

    Args:
        robot: The robot.

    Returns:
        A walk of no stride to speak of, at the height and width of the stance, or of the thesis's
        scenarios for legs without one.
    """
    radius, height = 0.16, 0.15
    stances = [leg for leg in robot.legs if isinstance(leg, ChainLeg)]
    if stances:
        feet = np.array([leg.foot(leg.stance.tolist()) for leg in stances])
        radius = max(1e-6, float(np.abs(feet[:, 1]).mean()))
        hips = max(leg.hip[2] for leg in robot.legs)
        height = hips - float(feet[:, 2].mean()) + float(np.mean(robot.planned_soles()))
    return Scenario(
        name="standing",
        cycle_time=_SECONDS,
        cycles=1.0,
        radius=radius,
        hip_height=height,
        stride=1e-9,
        height=0.0,
    )


def standing_drive(robot: Robot) -> tuple[str, dict[str, float]]:
    """A controller that holds all joints.

    Args:
        robot: The robot.

    Returns:
        Its name, and a design: stiff, and damped where motors do not brake by themselves.
    """
    if not robot.is_torque_controlled:
        return "p", {"P": 1.0}
    stiffness = _STIFF * float(np.median(robot.actuators().torque_limit))
    return "joint-pd", {"Kp": stiffness, "Kd": _DAMPED * stiffness, "feed_forward": 0.0}


def _standing(robot: Robot, stood: Simulation) -> tuple[StandingView, list[str]]:
    log = stood.logs[0]
    if log is None:
        raise RuntimeError("a reachable walk has a log")
    weight = robot.mass * GRAVITY
    last = len(log.time) // 5
    carried = float(np.nan_to_num(log.foot_force[-last:, :, 2]).sum(axis=1).mean())
    view = StandingView(
        seconds=_SECONDS,
        normal_forces=carried,
        weight=weight,
        height=float(np.nan_to_num(log.base_position[-1, 2])),
    )
    status = Status(int(stood.outcome.statuses[0]))
    warnings = []
    if status in (Status.FELL, Status.DIVERGED):
        warnings.append(
            f"it does not stand for {_SECONDS:g} s ({status.name.lower()}): look at the stance, and"
            " at the actuators' torque"
        )
    elif abs(carried - weight) > _OFF * weight:
        warnings.append(
            f"soles carry {carried:.1f} N of {weight:.1f} N: the robot is not at rest; look at"
            " contact.stiffness and contact.damping"
        )
    return view, warnings


def _unphysical(robot: Robot) -> list[str]:
    """Links whose mass or inertia no body can have."""
    warnings = []
    for name, body in robot.urdf.bodies.items():
        if body.mass == 0.0:
            warnings.append(f"link {name!r} and what is fixed to it have no mass")
            continue
        moments = np.linalg.eigvalsh(body.rotational)
        if moments[0] <= 0.0 or moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-6):
            warnings.append(
                f"link {name!r}: no body of {body.mass:g} kg has the principal moments"
                f" {', '.join(f'{moment:.3g}' for moment in moments)} kg m2"
            )
    return warnings


def job_defaults(folder: str | os.PathLike[str]) -> dict[str, Any]:
    """What the folder of a robot says that its jobs have.

    Args:
        folder: Of the robot.

    Returns:
        Fields of a spec, unchecked; none if there is no such file.

    Raises:
        InvalidRequest: The file cannot be read, or is no JSON object.
    """
    path = Path(folder) / JOB_FILE
    if not path.is_file():
        return {}
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidRequest(f"cannot read {path}: {error}", field="robot") from error
    if not isinstance(document, dict):
        raise InvalidRequest(f"{path} must hold one JSON object", field="robot")
    return document


def _check_name(name: str) -> None:
    """Firmware, exports and folders are named by it."""
    if not _NAME.fullmatch(name) or not name.isprintable():
        raise InvalidRequest(
            f"{name[:100]!r} cannot name a robot; 1 to 100 printable characters can that begin with"
            " a letter or digit and have no / and no \\",
            field="name",
        )


def _check_free(folder: Path) -> None:
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InvalidRequest(f"{folder} is there and not empty; name another", field="output")


def _write(
    folder: Path,
    proposal: Proposal,
    source: Path | None,
    packages: Sequence[str | os.PathLike[str]],
) -> MeshCopies:
    """With the meshes that are found from a source folder, if there is one."""
    copies = MeshCopies()
    job = json.dumps(proposal.job, indent=2) + "\n"
    texts = {"robot.toml": proposal.toml, "robot.urdf": proposal.urdf, JOB_FILE: job}
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
        try:
            for file, text in texts.items():
                (made / file).write_text(text, encoding="utf-8")
            if source is not None:
                copies = copy_meshes(proposal.urdf, source, made, [Path(p) for p in packages])
            made.chmod(0o755)
            if folder.exists():
                folder.rmdir()
            made.rename(folder)
        except BaseException:
            shutil.rmtree(made, ignore_errors=True)
            raise
    except OSError as error:
        raise InvalidRequest(f"cannot write {folder}: {error.strerror}", field="output") from error
    return copies
