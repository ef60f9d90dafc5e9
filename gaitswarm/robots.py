"""Robots of one's own, made from a URDF."""

from __future__ import annotations

import json
import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.errors import simulation_errors
from gaitswarm.meshes import FORMS, LARGEST_MESH, MeshCopies, copy_meshes, find_mesh, mesh_names
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.preference import PreferenceName
from gaitswarm.sim.controllers.joint_pd import LARGEST_GAIN
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.gait.trajectory import desired_angles, require_reachable
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.proposal.apart import propose_apart, walking_proposal
from gaitswarm.sim.proposal.document import Proposal
from gaitswarm.sim.proposal.drive import GRAVITY, ActuatorChoice
from gaitswarm.sim.proposal.frame import Axis, Frame
from gaitswarm.sim.proposal.gait import walk_of_robot
from gaitswarm.sim.proposal.legs import reach_below
from gaitswarm.sim.robot import Robot, RobotFiles, load_robot
from gaitswarm.sim.robot.bounds import (
    LONGEST_NAME,
    LONGEST_URDF,
    MOST_ELEMENTS,
    MOST_LINKS,
    check_urdf,
)
from gaitswarm.sim.robot.identifiable import identifiable_variables
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.posture import feet_and_centre_of_mass, leg_points
from gaitswarm.sim.robot.shapes import mesh_bounds
from gaitswarm.sim.robot.urdf import unphysical
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from gaitswarm.sim.simulate import simulate
from gaitswarm.views.robots import (
    CheckedLegView,
    MeshView,
    RobotCheckView,
    RobotDraftView,
    StandingStillView,
)

if TYPE_CHECKING:
    from gaitswarm.sim.simulate import Simulation

JOB_FILE: Final = "job.json"
"""In a robot's folder: what a job of this robot has unless it says otherwise."""

DEFAULT_CONTROLLER: Final = "fuzzy-pi"

DEFAULT_PREFERENCE: Final[PreferenceName] = "A"


@dataclass(frozen=True, slots=True)
class RobotDefaults:
    """Of a robot: what its folder says, and what a spec has where it says nothing.

    Attributes:
        document: Fields of a spec that the folder gives, unchecked; none for a shipped robot.
    """

    document: Mapping[str, Any] = field(default_factory=dict)

    @property
    def controller(self) -> str:
        """Motor controller, unchecked."""
        return str(self.document.get("controller", DEFAULT_CONTROLLER))

    @property
    def preference(self) -> Any:
        """How objectives are weighed: a name or an object, unchecked."""
        return self.document.get("preference", DEFAULT_PREFERENCE)

    @property
    def own_scenarios(self) -> dict[str, str | dict[str, Any]]:
        """The folder's walks by name, which may be a preset's number; empty if it has none."""
        found = self.document.get("scenarios", [])
        if not isinstance(found, list) or not all(isinstance(e, str | int | dict) for e in found):
            raise InvalidRequest(
                "its job.json must have a list under scenarios, of names, numbers or objects",
                field="robot",
            )
        entries = [str(e) if isinstance(e, int) else e for e in found]
        return {e if isinstance(e, str) else str(e.get("name")): e for e in entries}

    @property
    def scenarios(self) -> list[str | dict[str, Any]]:
        """All walks: the folder's, or the names of those of table 4.2."""
        return list(self.own_scenarios.values()) or [scenario.name for scenario in SCENARIOS]

    def of_controller(self, controller: object) -> dict[str, Any]:
        """What a job of this controller has."""
        if controller in (None, self.document.get("controller")):
            return dict(self.document)
        return {k: v for k, v in self.document.items() if k not in ("variables", "fixed")}


def robot_defaults(folder: str | os.PathLike[str]) -> RobotDefaults:
    """What the folder of a robot says that its jobs have."""
    path = Path(folder) / JOB_FILE
    if not path.is_file():
        return RobotDefaults()
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidRequest(f"cannot read {path}: {error}", field="robot") from error
    if not isinstance(document, dict):
        raise InvalidRequest(f"{path} must hold one JSON object", field="robot")
    return RobotDefaults(document)


_SECONDS: Final = 1.0
_STIFF: Final = 20.0
"""Stiffness with which torque-controlled joints are held, per torque limit [1/rad]."""

_DAMPED: Final = 0.02
"""Their damping, per stiffness [s]."""

_OFF: Final = 0.02
"""Share of the weight by which standing forces may be off before that is a warning."""


def check_robot(
    files: RobotFiles,
    *,
    folder: str | os.PathLike[str] | None = ".",
    packages: Sequence[str | os.PathLike[str]] = (),
    field: str = "folder",
) -> RobotCheckView:
    """Load a robot, let it stand, and look for what is unphysical."""
    with simulation_errors(field):
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
    carried = {joint.name: joint.child for joint in robot.urdf.joints}
    return RobotCheckView(
        name=robot.description.name,
        mass=robot.mass,
        body_mass=robot.urdf.body.mass,
        parameters=list(identifiable_variables(robot)),
        joints=robot.n_joints,
        legs=[
            CheckedLegView(
                name=data.name,
                joints=list(data.joints),
                foot=data.foot,
                length=sum(leg.lengths),
                mass=sum(robot.urdf.bodies[carried[joint]].mass for joint in data.joints),
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
        meshes=[] if folder is None else _meshes(files.urdf, Path(folder), map(Path, packages)),
        guesses=list(robot.description.guesses),
        warnings=[*warnings, *unphysical(robot.urdf, files.urdf)],
    )


def _meshes(urdf: str, folder: Path, packages: Iterable[Path]) -> list[MeshView]:
    """What the URDF names, each with the file that was found."""
    places = list(packages)
    found = {name: find_mesh(name, folder, places) for name in mesh_names(urdf)}
    return [MeshView(name=n, path=None if p is None else str(p)) for n, p in found.items()]


def standing_scenario(robot: Robot) -> Scenario:
    """A second in the robot's stance, all feet on the ground."""
    radius, height = 0.16, 0.15
    stances = [leg for leg in robot.legs if isinstance(leg, ChainLeg)]
    if stances:
        feet = np.array([leg.stand for leg in stances])
        radius = max(1e-6, float(np.abs(feet[:, 1]).mean()))
        hips = max(leg.hip[2] for leg in robot.legs)
        height = hips - float(feet[:, 2].mean()) + float(np.mean(robot.planned_soles()))
    standing = {
        "name": "standing",
        "cycle_time": _SECONDS,
        "cycles": 1.0,
        "radius": radius,
        "hip_height": height,
        "stride": 1e-9,
        "height": 0.0,
    }
    return walk_of_robot(standing, "robot.toml")


def standing_drive(robot: Robot) -> tuple[str, dict[str, float]]:
    """A controller that holds all joints."""
    if not robot.is_torque_controlled:
        return "p", {"P": 1.0}
    stiffness = min(_STIFF * float(np.median(robot.actuators().torque_limit)), LARGEST_GAIN)
    return "joint-pd", {"Kp": stiffness, "Kd": _DAMPED * stiffness, "feed_forward": 0.0}


def _standing(robot: Robot, stood: Simulation) -> tuple[StandingStillView, list[str]]:
    log = stood.logs[0]
    if log is None:
        raise RuntimeError("a reachable walk has a log")
    weight = robot.mass * GRAVITY
    last = len(log.time) // 5
    carried = float(np.nan_to_num(log.foot_force[-last:, :, 2]).sum(axis=1).mean())
    view = StandingStillView(
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


_NAME: Final = re.compile(r"\w[^/\\]{0,99}")


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
    up: Axis | None = None,
    forward: Axis | None = None,
    meshes: bool = True,
    packages: Sequence[str | os.PathLike[str]] = (),
) -> MadeRobot:
    """Make a robot's folder from a URDF: legs, stance, actuators and two walks are chosen.

    The meshes that the URDF names are copied, so that the folder can be shown wherever it goes.
    What is missing, no STL, OBJ or DAE, or too large is left out: no simulation needs them.
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
    chosen = (own_name(text) or source.stem) if name is None else name
    check_name(chosen)
    frame = frame_of(up, forward)
    try:
        bounds = partial(_bounds, folder=source.parent, packages=[Path(p) for p in packages])
        proposal = walking_proposal(text, chosen, actuator, frame, bounds)
    except RobotFileError as error:
        said = str(error).replace("robot.urdf", source.name, 1)
        raise InvalidRequest(said, field="urdf") from error
    with simulation_errors("urdf"):
        copies = _write(folder, proposal, source.parent if meshes else None, packages)
    return MadeRobot(chosen, proposal.notes, copies)


def not_utf8(path: Path, error: UnicodeDecodeError) -> str:
    """What to say of a file that cannot be decoded."""
    byte = error.object[error.start]
    return (
        f"cannot read {path}: it is not UTF-8 text (byte 0x{byte:02x} at {error.start}); save it as"
        " UTF-8"
    )


def check_name(name: str) -> None:
    """Check the name of a robot: firmware, exports and folders are named by it."""
    if not _NAME.fullmatch(name) or not name.isprintable():
        raise InvalidRequest(
            f"{name[:100]!r} cannot name a robot; 1 to 100 printable characters can that begin with"
            " a letter or digit and have no / and no \\",
            field="name",
        )


def own_name(urdf: str) -> str | None:
    """Name of the robot in a URDF."""
    try:
        check_urdf(urdf)
    except RobotFileError:
        return None
    name = ET.fromstring(urdf).get("name", "").strip()  # noqa: S314 - it has kept all bounds
    return name if _NAME.fullmatch(name) and name.isprintable() else None


def frame_of(up: Axis | None, forward: Axis | None) -> Frame:
    """Axes of a URDF's first link."""
    frame = Frame(up, forward)
    if not frame.right_angled:
        raise InvalidRequest(
            f"{forward or 'x'} cannot point ahead where {up or 'z'} points up; name an axis at"
            " right angles to it",
            field="forward",
        )
    return frame


def _bounds(name: str, folder: Path, packages: Sequence[Path]) -> NDArray[np.float64] | None:
    """Bounds of a mesh that is found and not too large."""
    path = find_mesh(name, folder, packages)
    if path is None or path.suffix.lower() not in FORMS or path.stat().st_size > LARGEST_MESH:
        return None
    return mesh_bounds(path)


def _check_free(folder: Path) -> None:
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InvalidRequest(
            f"{folder} exists and is not empty; name another folder", field="output"
        )


def _write(
    folder: Path,
    proposal: Proposal,
    source: Path | None,
    packages: Sequence[str | os.PathLike[str]],
) -> MeshCopies:
    """Write a robot's folder, with the meshes of a source folder if there is one."""
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


class RobotDraftRequest(BaseModel):
    """A URDF to make a robot from."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str | None = Field(
        default=None,
        min_length=1,
        max_length=LONGEST_NAME,
        description="Of the robot: begins with a letter or digit, and has no / and no \\; null for"
        " that which the URDF has, or `robot`.",
        examples=["a1"],
    )
    urdf: str = Field(
        max_length=LONGEST_URDF,
        description=f"Text of its URDF: {MOST_LINKS} links and as many joints at most,"
        f" {MOST_ELEMENTS} elements at most, no document type.",
    )
    actuator: ActuatorChoice = Field(
        default="auto",
        description="Kind of its actuators: DC motors with gearheads, or torque-controlled ones;"
        " `auto` decides by the torques and rates of the URDF.",
    )
    up: Axis | None = Field(
        default=None,
        description="Axis of the URDF's first link that points up; null for z, which is refused if"
        " the legs speak against it.",
    )
    forward: Axis | None = Field(
        default=None,
        description="Axis of its first link that points ahead, at right angles to `up`; null for x,"
        " with a warning if the legs speak against it.",
    )


def run_robot_draft(request: RobotDraftRequest) -> RobotDraftView:
    """Find legs, choose a stance, propose actuators and two walks."""
    name = request.name or own_name(request.urdf) or "robot"
    check_name(name)
    frame = frame_of(request.up, request.forward)
    with simulation_errors("urdf"):
        made = propose_apart(request.urdf, name, request.actuator, frame)
    return RobotDraftView(
        name=name, toml=made.toml, urdf=made.urdf, job=made.job, guesses=list(made.notes)
    )
