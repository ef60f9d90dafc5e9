"""Numbers, frames and joints of a URDF, and errors that name their line."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final
from xml.etree import ElementTree as ET
from xml.parsers import expat

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.memory import require_room_for_scipy
from gaitswarm.sim.robot.bounds import LARGEST, shortened

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_PART: Final = re.compile(
    r"""robot\.urdf: (?P<part>(?P<tag>link|joint)\ (?P<name>'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"))"""
)
_INNER: Final = re.compile(r"(?P<attribute>\w+)=(?P<value>'[^']*'|\"[^\"]*\") of <(?P<tag>\w+)>")


@contextmanager
def by_line(text: str) -> Iterator[None]:
    """Add line numbers to errors that name a link or a joint of a URDF."""
    try:
        yield
    except RobotFileError as error:
        message = with_line(text, str(error))
        if message == str(error):
            raise
        raise type(error)(message) from (error.__cause__ or error)


def with_line(text: str, message: str) -> str:
    """Add the line number to a message that begins with a link or a joint of a URDF."""
    line = _line(text, message)
    if line is None:
        return message
    return message.replace("robot.urdf: ", f"robot.urdf, line {line}: ", 1)


def _line(text: str, message: str) -> int | None:
    """Find the line of the last part with that name, the duplicate of two, or of its attribute."""
    part = _PART.match(message)
    if part is None:
        return None
    inner = _INNER.search(message, part.end())
    depth, inside, line = 0, False, None
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, inside, line
        depth += 1
        if depth == 2:
            inside = tag == part["tag"] and repr(attributes.get("name", "")) == part["name"]
        found = inside and (
            depth == 2
            or (
                inner is not None
                and tag == inner["tag"]
                and repr(attributes.get(inner["attribute"], "")) == inner["value"]
            )
        )
        if found:
            line = parser.CurrentLineNumber

    def end(_tag: str) -> None:
        nonlocal depth
        depth -= 1

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.Parse(text, True)
    return line


MOST_TURNED: Final = 4.0 * math.pi
"""Largest plausible angle: two turns [rad]. Larger ones are degrees, or mean no limit."""


@dataclass(frozen=True, slots=True, eq=False)
class Origin:
    """Pose of a frame in another one."""

    xyz: Floats  # position, (3,) [m]
    rpy: Floats  # roll, pitch and yaw about the other frame's fixed axes, (3,) [rad]

    def matrix(self) -> Floats:
        """Rotation matrix to the other frame, (3, 3); exact without rotation."""
        return self._rotation().as_matrix() if self.rpy.any() else np.eye(3)

    def quaternion(self) -> Floats:
        """Rotation to the other frame as quaternion x y z w, (4,)."""
        return self._rotation().as_quat()

    def _rotation(self) -> Rotation:
        # Slow to import, and seldom needed.
        require_room_for_scipy()
        from scipy.spatial.transform import Rotation  # noqa: PLC0415

        return Rotation.from_euler("xyz", self.rpy)


def origin_of(element: ET.Element, whose: str) -> Origin:
    origin = element.find("origin")
    if origin is None:
        return Origin(np.zeros(3), np.zeros(3))
    xyz, rpy = (numbers_of(origin, name, whose, "0 0 0") for name in ("xyz", "rpy"))
    if (np.abs(rpy) > MOST_TURNED).any():
        raise RobotFileError(
            f"robot.urdf: {whose}: rpy={shortened(origin.get('rpy', ''))!r} of <origin> seems to be"
            " in degrees; a URDF uses radians: 90 degrees are 1.5708"
        )
    return Origin(xyz, rpy)


def numbers_of(
    element: ET.Element, attribute: str, whose: str, default: str = "", largest: float = LARGEST
) -> Floats:
    """Read an attribute's numbers, (3,) of xyz, rpy and size, else (1,), in URDF's units."""
    text = element.get(attribute, default)
    count = 3 if attribute in ("xyz", "rpy", "size") else 1
    try:
        values = np.array([float(part) for part in text.split()])
    except ValueError:
        values = np.empty(0)
    if len(values) != count or not (np.abs(values) <= largest).all():
        raise RobotFileError(
            f"robot.urdf: {whose}: {attribute}={shortened(text)!r} of <{element.tag}> is not"
            f" {'three numbers' if count == 3 else 'a number'} of {LARGEST:g} at most"
        )
    return values


_KINDS: Final = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")

TURNS: Final = frozenset({"revolute", "continuous"})
"""Types of revolute joints."""


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """A joint of any type."""

    name: str  # as in the file
    kind: str  # its type: revolute, fixed, ...
    parent: str  # link that carries it
    child: str  # link that it carries
    origin: Origin  # of the child's frame in the parent's, at angle 0
    axis: Floats  # of rotation in the child's frame, of unit length, (3,)
    limits: tuple[float, float]  # least and largest position [rad]; infinite where there are none
    effort: float  # largest torque [N m]; 0 where the file gives none
    velocity: float  # largest rate [rad/s]; 0 where the file gives none
    follows: str | None = None  # joint that it mimics
    # armature [kg m2], damping [N m s/rad] and friction [N m] of URDFs from MJCF; those that others
    # give are seldom more than placeholders
    dynamics: tuple[float, float, float] | None = None

    @property
    def fixed(self) -> bool:
        return self.kind == "fixed"


def joint_of(element: ET.Element) -> Joint:
    name = element.get("name", "")
    parent, child = (_linked(element, end) for end in ("parent", "child"))
    whose = f"joint {name!r}"
    direction = element.find("axis")
    axis = np.array([1.0, 0.0, 0.0]) if direction is None else numbers_of(direction, "xyz", whose)
    length = math.hypot(*axis.tolist())
    kind = element.get("type", "")
    if length == 0.0 and kind != "fixed":
        raise RobotFileError(
            f"robot.urdf: {whose}: its axis must not be zero; use 0 1 0, for example"
        )
    if kind and kind not in _KINDS:
        raise RobotFileError(
            f"robot.urdf: {whose}: type={shortened(kind)!r} of <joint> must be one of"
            f" {', '.join(_KINDS)}"
        )
    origin = origin_of(element, whose)
    limit, mimic = element.find("limit"), element.find("mimic")
    effort, velocity = (
        0.0 if limit is None else float(numbers_of(limit, attribute, whose, "0", math.inf)[0])
        for attribute in ("effort", "velocity")
    )
    dynamics = element.find("dynamics[@armature]")
    armature, damping, friction = (
        0.0 if dynamics is None else float(numbers_of(dynamics, attribute, whose, "0")[0])
        for attribute in ("armature", "damping", "friction")
    )
    return Joint(
        name=name,
        kind=kind,
        parent=parent,
        child=child,
        origin=origin,
        axis=axis / (length or 1.0),
        limits=_limits(limit, kind, whose),
        effort=effort,
        velocity=velocity,
        follows=None if mimic is None else mimic.get("joint", ""),
        dynamics=None if dynamics is None else (armature, damping, friction),
    )


def standardise(root: ET.Element, held: Mapping[str, float]) -> bool:
    """Fix held joints at angles by name [rad], and a free base; make continuous joints revolute."""
    changed = _free_base(root)
    missing = set(held)
    for element in root.findall("joint"):
        name, kind = element.get("name", ""), element.get("type", "")
        if name in held:
            missing.discard(name)
            _hold(element, kind, held[name])
        elif kind == "continuous":
            # Pinocchio has two coordinates for a continuous joint.
            element.set("type", "revolute")
            for limit in element.findall("limit"):
                element.remove(limit)
            ends = {"lower": f"{-LARGEST:g}", "upper": f"{LARGEST:g}"}
            ET.SubElement(element, "limit", ends | {"effort": "0", "velocity": "0"})
        else:
            if kind in ("revolute", "prismatic"):
                _check_limit(element.find("limit"), name)
            continue
        changed = True
    if missing:
        raise RobotFileError(
            f"robot.toml: held_joints: robot.urdf has no joint {min(missing)!r}; remove it"
        )
    return changed


def _free_base(root: ET.Element) -> bool:
    """Fix the floating joint of the body, if there is one; return whether there was."""
    links = {link.get("name", ""): link for link in root.findall("link")}
    joints = [(_linked(e, "parent"), _linked(e, "child"), e) for e in root.findall("joint")]
    children = {child for _, child, _ in joints}
    link = next((name for name in links if name not in children), None)
    while link in links and links[link].find("inertial") is None:
        after = [(child, joint) for parent, child, joint in joints if parent == link]
        if len(after) != 1 or (kind := after[0][1].get("type")) not in ("floating", "fixed"):
            return False
        link, joint = after[0]
        if kind == "floating":
            joint.set("type", "fixed")
            # Its position is only a simulator's initial position.
            for origin in joint.findall("origin"):
                origin.set("xyz", "0 0 0")
            return True
        joints = [entry for entry in joints if entry[2] is not joint]
    return False


def _linked(joint: ET.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


def _hold(element: ET.Element, kind: str, angle: float) -> None:
    """Make a joint a fixed one, its frame rotated by the angle."""
    joint = joint_of(element)
    if kind not in (*TURNS, "fixed") and angle:
        raise RobotFileError(
            f"robot.toml: held_joints: joint {joint.name!r} is {kind} and does not turn; hold it"
            " at 0"
        )
    if angle and kind != "fixed":
        require_room_for_scipy()
        from scipy.spatial.transform import Rotation  # noqa: PLC0415

        turned = Rotation.from_matrix(joint.origin.matrix())
        turned = turned * Rotation.from_rotvec(angle * joint.axis)
        xyz, rpy = joint.origin.xyz.tolist(), turned.as_euler("xyz").tolist()
        for origin in element.findall("origin"):
            element.remove(origin)
        numbers = {"xyz": xyz, "rpy": rpy}
        ET.SubElement(element, "origin", {k: " ".join(map(repr, v)) for k, v in numbers.items()})
    element.set("type", "fixed")
    for part in ("axis", "limit", "mimic", "dynamics"):
        for child in element.findall(part):
            element.remove(child)


def _check_limit(limit: ET.Element | None, joint: str) -> None:
    """Check the limits that Pinocchio requires; its own error does not name the joint."""
    given = {} if limit is None else limit.attrib
    missing = [name for name in ("effort", "velocity") if name not in given]
    if missing:
        raise RobotFileError(
            f"robot.urdf: joint {joint!r} has no <limit> with {' and '.join(missing)}, which URDF"
            ' requires: <limit lower="-1" upper="1" effort="10" velocity="10"/> [rad, N m, rad/s];'
            ' a joint without limits has type="continuous"'
        )


def _limits(limit: ET.Element | None, kind: str, whose: str) -> tuple[float, float]:
    if kind == "continuous" or limit is None or not {"lower", "upper"} & set(limit.keys()):
        return -math.inf, math.inf
    lower, upper = (
        float(numbers_of(limit, end, whose, "0", math.inf)[0]) for end in ("lower", "upper")
    )
    if lower > upper:
        raise RobotFileError(
            f"robot.urdf: {whose}: its lower limit {lower:g} lies above the upper one {upper:g};"
            " swap them"
        )
    return lower, upper
