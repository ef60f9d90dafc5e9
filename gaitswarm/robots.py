"""Robots of one's own, made from a URDF, xacro or MJCF, and their meshes."""

from __future__ import annotations

import json
import os
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound, simulation_errors
from gaitswarm.services.optimizer.jobs.preference import PreferenceName
from gaitswarm.services.optimizer.views import Request, View
from gaitswarm.sim.controllers.linear import LARGEST_GAIN
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.gait.trajectory import desired_angles, require_reachable
from gaitswarm.sim.kernel.parameters import GRAVITY
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.proposal.document import propose_apart, walking_proposal
from gaitswarm.sim.proposal.drive import ActuatorChoice
from gaitswarm.sim.proposal.formats import as_urdf
from gaitswarm.sim.proposal.legs import Axis, Frame, LegHints, reach_below
from gaitswarm.sim.proposal.stance import walk_of_robot
from gaitswarm.sim.robot import RobotFiles, load_robot
from gaitswarm.sim.robot.bounds import (
    LONGEST_NAME,
    LONGEST_URDF,
    MOST_ELEMENTS,
    MOST_LINKS,
    check_urdf,
)
from gaitswarm.sim.robot.identifiable import identifiable_variables
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.limbs import feet_and_centre_of_mass, leg_points
from gaitswarm.sim.robot.meshes import (
    FORMS,
    MeshFormat,
    Packages,
    copy_meshes,
    found_mesh,
    mesh_places,
    package_places,
    served_meshes,
)
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.shapes import mesh_bounds
from gaitswarm.sim.robot.urdf import unphysical
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from gaitswarm.sim.simulate import Simulation, simulate
from gaitswarm.sim.variables import Variable
from gaitswarm.views.base import PREFIX

JOB_FILE: Final = "job.json"
"""In a robot's folder: what a job of this robot has unless it says otherwise."""

DEFAULT_CONTROLLER: Final = "fuzzy-pi"

DEFAULT_PREFERENCE: Final[PreferenceName] = "A"


@dataclass(frozen=True, slots=True)
class RobotDefaults:
    """Of a robot: what its folder says, and what a spec has where it says nothing."""

    # fields of a spec that the folder gives, unchecked; none for a shipped robot
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


class CheckedLegView(View):
    """A leg."""

    name: str = Field(description="Of the leg.", examples=["FL"])
    joints: list[str] = Field(description="Its joints, from the body on.")
    foot: str = Field(description="Link or fixed joint at its end.")
    length: float = Field(description="From the first joint to the foot, stretched [m].")
    mass: float = Field(description="Of its three links with what is fixed to them [kg].")
    reach: float
    """How far the foot gets below the highest hip within the joints' limits [m]."""
    points: list[tuple[float, float, float]]
    """Where its joints and its foot are in the body's frame when it stands [m]."""


class StandingStillView(View):
    """Result of standing still with all joints held as stiffly as possible."""

    seconds: float = Field(description="For how long [s].")
    normal_forces: float = Field(description="Sum over the feet, mean of the last fifth [N].")
    weight: float = Field(description="Of the robot [N].")
    height: float = Field(description="Of the body's origin over the ground at the end [m].")


class RobotCheckView(View):
    """A loaded robot and how it stands."""

    name: str = Field(description="Of the robot.")
    mass: float = Field(description="Without load [kg].")
    body_mass: float
    """Of the body with all that is held or fixed to it, without legs [kg]."""
    joints: int = Field(description="That move.")
    legs: list[CheckedLegView] = Field(description="In the order of robot.toml.")
    held: dict[str, float] = Field(description="Joints of no leg, each with its angle [rad].")
    centre_of_mass: tuple[float, float, float]
    """In the body's frame when it stands [m]."""
    standing: StandingStillView = Field(description="How it stands.")
    guesses: list[str]
    """Guesses of `robot init` that are still in robot.toml, one sentence each."""
    warnings: list[str] = Field(description="What is unphysical or was guessed badly.")
    parameters: list[Variable] = Field(default_factory=list)
    """What an identification or calibration may fit of it, with bounds."""


_SECONDS: Final = 1.0
_STIFF: Final = 20.0
"""Stiffness with which torque-controlled joints are held, per torque limit [1/rad]."""

_DAMPED: Final = 0.02
"""Their damping, per stiffness [s]."""

_OFF: Final = 0.02
"""Share of the weight by which standing forces may be off before that is a warning."""


def check_robot(files: RobotFiles, *, field: str = "folder") -> RobotCheckView:
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
        guesses=list(robot.description.guesses),
        warnings=[*warnings, *unphysical(robot.urdf, files.urdf)],
    )


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
    if robot.description.servos:
        return "servo", {"P": max(servo.default_p for servo in robot.description.servos)}
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


class MadeRobot(NamedTuple):
    """A robot's folder that was written."""

    name: str  # of the robot
    guesses: tuple[str, ...]  # what to check, one sentence each
    copied: list[str]  # meshes, as the URDF has them
    left_out: dict[str, str]  # other meshes, each with the reason


def init_robot(
    urdf: str | os.PathLike[str],
    output: str | os.PathLike[str],
    *,
    name: str | None = None,
    actuator: ActuatorChoice = "auto",
    up: Axis | None = None,
    forward: Axis | None = None,
    meshes: bool = True,
    packages: Packages = (),
    arguments: Mapping[str, str] = MappingProxyType({}),
    locks: Mapping[str, float] = MappingProxyType({}),
    feet: Mapping[str, Sequence[float]] = MappingProxyType({}),
    mass: float | None = None,
    actuators: Mapping[str, str] = MappingProxyType({}),
) -> MadeRobot:
    """Make a robot's folder from URDF, xacro or MJCF; choose legs, stance, actuators and two walks.

    The meshes that the URDF names are copied, so that the folder can be shown wherever it goes.
    What is missing, no STL, OBJ or DAE, or too large is left out: no simulation needs them.

    Args:
        packages: Folders of ROS packages, or to search for them.
        arguments: Values of a xacro file's arguments.
        locks: Angles of joints to hold [rad], by name with wildcards.
        feet: Ends of legs in the frame of a link there [m], (3,), by name with wildcards.
        mass: Of the robot [kg]; default: the file's, unless it is a placeholder.
        actuators: Names of listed actuators by joint, with wildcards; the last match counts.
    """
    source, folder = Path(urdf), Path(output)
    check_new(folder)
    text = read_text(source, field="urdf", most=LONGEST_URDF + 1)
    chosen = (own_name(text) or source.stem) if name is None else name
    check_name(chosen)
    frame = frame_of(up, forward)

    def bounds(mesh: str) -> NDArray[np.float64] | None:
        found = found_mesh(mesh, mesh_places(mesh, source.parent, packages))
        return mesh_bounds(found) if isinstance(found, Path) else None

    def package_folder(package: str) -> str:
        for place in package_places(package, source.parent, packages):
            if place.is_dir():
                return str(place)
        raise RobotFileError(
            f"package {package!r} was not found; give its folder: `--package {package}=FOLDER`"
        )

    file = source.name
    try:
        urdf_text, left_out_parts = as_urdf(text, source, package_folder, arguments)
        if urdf_text is not text:
            file = f"{file} as a URDF"
        hints = LegHints(locks, feet, bounds, mass, actuators)
        proposal = walking_proposal(urdf_text, chosen, actuator, frame, hints)
        proposal = proposal.with_guesses(left_out_parts)
    except RobotFileError as error:
        raise InvalidRequest(str(error).replace("robot.urdf", file, 1), field="urdf") from error
    with simulation_errors("urdf"):
        job = json.dumps(proposal.job, indent=2) + "\n"
        texts = {"robot.toml": proposal.toml, "robot.urdf": proposal.urdf, JOB_FILE: job}
        copied, left_out = list[str](), dict[str, str]()
        with new_folder(folder) as made:
            for path, content in texts.items():
                (made / path).write_text(content, encoding="utf-8")
            if meshes:
                copied, left_out = copy_meshes(proposal.urdf, source.parent, made, packages)
    return MadeRobot(chosen, proposal.notes, copied, left_out)


def read_text(path: Path, *, field: str, most: int = -1) -> str:
    """Read a file of a robot, up to a number of characters."""
    try:
        with path.open(encoding="utf-8") as file:
            return file.read(most)
    except UnicodeDecodeError as error:
        place = f"byte 0x{error.object[error.start]:02x} at {error.start}"
        raise InvalidRequest(
            f"cannot read {path}: it is not UTF-8 text ({place}); save it as UTF-8", field=field
        ) from error
    except OSError as error:
        raise InvalidRequest(f"cannot read {path}: {error}", field=field) from error


def check_name(name: str) -> None:
    """Check the name of a robot: firmware, exports and folders are named by it."""
    if not _NAME.fullmatch(name) or not name.isprintable():
        raise InvalidRequest(
            f"{name[:100]!r} cannot name a robot; 1 to 100 printable characters can that begin with"
            " a letter or digit and have no / and no \\",
            field="name",
        )


def own_name(urdf: str) -> str | None:
    """Name of the robot in a URDF, xacro or MJCF text."""
    try:
        check_urdf(urdf)
    except RobotFileError:
        return None
    root = ET.fromstring(urdf)  # noqa: S314 - it has kept all bounds
    name = root.get("name", root.get("model", "")).strip()
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


def check_new(folder: Path) -> None:
    """Check that a folder is missing or empty."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InvalidRequest(
            f"{folder} exists and is not empty; name another folder", field="output"
        )


@contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """A temporary folder that becomes the other one unless an exception is raised."""
    try:
        target = folder.resolve()
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(
            dir=target.parent, prefix=f".{target.name}.", ignore_cleanup_errors=True
        ) as scratch:
            new = Path(scratch) / "new"
            new.mkdir()
            yield new
            new.replace(target)
    except OSError as error:
        raise InvalidRequest(f"cannot write {folder}: {error.strerror}", field="output") from error


def write_new(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write a folder's files by path, all or none."""
    with new_folder(folder) as new:
        for name, content in files.items():
            path = new / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)


class RobotDraftRequest(Request):
    """A URDF, xacro or MJCF text to make a robot from."""

    name: str | None = Field(
        default=None,
        min_length=1,
        max_length=LONGEST_NAME,
        description="Of the robot: begins with a letter or digit, and has no / and no \\; null for"
        " that which the text has, or `robot`.",
        examples=["a1"],
    )
    urdf: str = Field(
        max_length=LONGEST_URDF,
        description="Text of its URDF, or xacro or MJCF that needs no other file:"
        f" {MOST_LINKS} links and as many joints at most, {MOST_ELEMENTS} elements at most, no"
        " document type.",
    )
    actuator: ActuatorChoice = "auto"
    """Kind of its actuators: DC motors with gearheads, or torque-controlled ones; `auto` decides by
    the torques and rates of the URDF."""
    up: Axis | None = None
    """Axis of the URDF's first link that points up; null for z, which is refused if the legs speak
    against it."""
    forward: Axis | None = None
    """Axis of its first link that points ahead, at right angles to `up`; null for x, with a warning
    if the legs speak against it."""

    locks: dict[str, float] = Field(
        default_factory=dict,
        max_length=MOST_LINKS,
        description="Joints to hold, each at an angle [rad], by name with the wildcards * and ?;"
        " wheels, arms and whatever belongs to no leg are held anyway.",
        examples=[{"*_wheel_joint": 0.0}],
    )
    feet: dict[str, tuple[float, float, float]] = Field(
        default_factory=dict,
        max_length=MOST_LINKS,
        description="Ends of legs, each in the frame of a link there [m], by the link's name with"
        " wildcards; others are where the links' shapes suggest.",
        examples=[{"FL_calf": [0.0, 0.0, -0.2]}],
    )
    mass: float | None = Field(default=None, gt=0.0, le=10_000.0)
    """Mass of the robot [kg]; null for the text's, unless that is a placeholder."""
    actuators: dict[str, str] = Field(
        default_factory=dict,
        max_length=MOST_LINKS,
        description="Listed actuators by joint, with the wildcards * and ?; of several that match"
        " the last. Then `actuator` is not used. Names: `gaitswarm robot init --help`.",
        examples=[{"*": "mx64", "*_coxa": "mx106"}],
    )


class RobotDraftView(View):
    """A robot's files as `gaitswarm robot init` writes them; nothing is stored."""

    name: str = Field(description="Of the robot.", examples=["a1"])
    toml: str = Field(description="Text of robot.toml, with a comment on every guess.")
    urdf: str
    """Text of robot.urdf: as it was sent or converted, with a frame at the end of every leg whose
    foot is no link."""
    job: dict[str, Any]
    """Fields of a job of this robot, unless it says otherwise: two scenarios, the controller,
    bounds where they follow from the robot, the preference."""
    guesses: list[str] = Field(description="Guesses to check, one sentence each.")


def run_robot_draft(request: RobotDraftRequest) -> RobotDraftView:
    """Find legs, choose a stance, propose actuators and two walks."""
    name = request.name or own_name(request.urdf) or "robot"
    check_name(name)
    frame = frame_of(request.up, request.forward)
    with simulation_errors("urdf"):
        hints = LegHints(
            request.locks, request.feet, mass=request.mass, actuators=request.actuators
        )
        made = propose_apart(request.urdf, name, request.actuator, frame, hints)
    return RobotDraftView(
        name=name, toml=made.toml, urdf=made.urdf, job=made.job, guesses=list(made.notes)
    )


class MeshFileView(View):
    """A mesh that a robot's URDF names, and whether this server has its file."""

    name: str = Field(description="As the URDF has it.", examples=["meshes/hip.stl"])
    format: MeshFormat | None = Field(examples=["stl"])
    """Media type by file extension; null if the file is not served."""
    url: str | None = Field(examples=["/v1/robots/" + 64 * "0" + "/meshes/0"])
    """Path of the file; null if it is not served."""
    problem: str | None = Field(description="Why it is not served; null if it is.", examples=[None])


def mesh_views(folders: Sequence[Path], digest: str) -> list[MeshFileView]:
    return [
        MeshFileView(
            name=name,
            format=FORMS.get(Path(name).suffix.lower()),
            url=None if isinstance(found, str) else f"{PREFIX}/robots/{digest}/meshes/{number}",
            problem=found if isinstance(found, str) else None,
        )
        for number, (name, found) in enumerate(served_meshes(folders, digest).items())
    ]


def mesh_content(folders: Sequence[Path], digest: str, number: int) -> bytes:
    """A mesh of a robot, by its number in the list."""
    meshes = list(served_meshes(folders, digest).items())
    if number >= len(meshes):
        raise NotFound(f"the robot has no mesh {number}, but {len(meshes)} in all")
    name, found = meshes[number]
    if isinstance(found, str):
        raise NotFound(f"mesh {name[:200]}: {found}")
    try:
        return found.read_bytes()
    except OSError as error:
        raise NotFound(f"mesh {name[:200]}: {error.strerror}") from error
