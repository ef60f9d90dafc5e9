"""URDF parsing: kinematic tree, inertias and geometry."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import lru_cache, partial
from types import MappingProxyType
from typing import Final, Literal, cast
from xml.etree import ElementTree as ET
from xml.parsers import expat

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.memory import rotations
from gaitswarm.sim.robot.bounds import LARGEST, check_urdf, shortened


@dataclass(frozen=True, slots=True, eq=False)
class BodyInertia:
    """Inertia of a rigid body in some frame."""

    mass: float  # [kg]
    centre: Floats  # of mass, (3,) [m]
    rotational: Floats  # about the centre of mass, (3, 3) [kg m2]

    def seen_from(self, rotation: Floats, position: Floats) -> BodyInertia:
        """Transform to another frame by rotation (3, 3) and position (3,) [m] of this one."""
        # A ball's inertia is invariant. Pinocchio makes the same exception, so both round alike.
        ball = self.rotational[2, 2] * np.eye(3)
        turned = product(product(rotation, self.rotational - ball), rotation.T) + ball
        return BodyInertia(self.mass, product(rotation, self.centre) + position, turned)

    def joined(self, other: BodyInertia) -> BodyInertia:
        mass = self.mass + other.mass
        per_mass = 1.0 / max(mass, float(np.finfo(np.float64).eps))
        reduced = self.mass * other.mass * per_mass
        return BodyInertia(
            mass,
            self.centre * (self.mass * per_mass) + (other.mass * per_mass) * other.centre,
            self.rotational
            + other.rotational
            + reduced * parallel_axis(self.centre - other.centre),
        )


NO_INERTIA: Final = BodyInertia(0.0, np.zeros(3), np.zeros((3, 3)))
"""Inertia of a link without `<inertial>`."""


def parallel_axis(offset: Floats) -> Floats:
    """Rotational inertia (3, 3) [m2] of a unit point mass at an offset (3,) [m] (Steiner)."""
    x, y, z = offset.tolist()
    squared = float(x * x + y * y + z * z)
    return squared * np.eye(3) - np.outer(offset, offset)


def product(rotation: Floats, other: Floats) -> Floats:
    """Multiply a rotation (3, 3) by (3,) or (3, 3), rounding alike on every machine."""
    x, y, z = (np.multiply.outer(rotation[:, k], other[k]) for k in range(3))
    return np.asarray(x + y + z)


_PART: Final = re.compile(
    r"""robot\.urdf: (?P<part>(?P<tag>link|joint)\ (?P<name>'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"))"""
)
_INNER: Final = re.compile(r"(?P<attribute>\w+)=(?P<value>'[^']*'|\"[^\"]*\") of <(?P<tag>\w+)>")


@contextmanager
def numbered(file: str, line_of: Callable[[str], int | None]) -> Iterator[None]:
    """Add to errors the line of the file that `line_of` finds by their message."""
    try:
        yield
    except RobotFileError as error:
        message = str(error)
        if (line := line_of(message)) is None:
            raise
        message = message.replace(f"{file}: ", f"{file}, line {line}: ", 1)
        raise type(error)(message) from (error.__cause__ or error)


def by_line(text: str) -> AbstractContextManager[None]:
    """Add line numbers to errors that name a link or a joint of a URDF."""
    return numbered("robot.urdf", partial(_line, text))


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
        turns = bool(self.rpy.any())
        return rotations().from_euler("xyz", self.rpy).as_matrix() if turns else np.eye(3)

    def quaternion(self) -> Floats:
        """Rotation to the other frame as quaternion x y z w, (4,)."""
        return rotations().from_euler("xyz", self.rpy).as_quat()


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
        turned = rotations().from_matrix(joint.origin.matrix())
        turned = turned * rotations().from_rotvec(angle * joint.axis)
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


GeometryUse = Literal["visual", "collision"]
SolidKind = Literal["box", "sphere", "cylinder", "capsule"]

_NONE_HELD: Final[Mapping[str, float]] = MappingProxyType({})

_SIZES: Final[Mapping[str, tuple[str, ...]]] = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
}
"""Attributes of each solid in a URDF, in the order of `Solid.size`."""


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A simple solid of a link's geometry."""

    kind: SolidKind
    # edges x, y, z of a box; radius of a sphere; radius and length of a cylinder or a capsule, a
    # capsule's between the centres of its hemispheres [m]
    size: Floats
    origin: Origin  # of its centre in the link's frame


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """A link of a URDF."""

    name: str  # as in the file
    inertia: BodyInertia  # in the link's frame; `NO_INERTIA` if the file gives none
    element: ET.Element

    def solids(self, use: GeometryUse = "visual") -> tuple[Solid, ...]:
        for part_use in (use, "collision" if use == "visual" else "visual"):
            solids = [
                self._solid(part, element)
                for part in self.element.findall(part_use)
                for element in part.findall("geometry/*")
                if element.tag in _SIZES
            ]
            if solids:
                return tuple(solids)
        return ()

    def _solid(self, part: ET.Element, solid: ET.Element) -> Solid:
        whose = f"link {self.name!r}"
        size = [numbers_of(solid, name, whose) for name in _SIZES[solid.tag]]
        return Solid(cast(SolidKind, solid.tag), np.concatenate(size), origin_of(part, whose))


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Pose of a link in its rigid body."""

    body: str  # name of the rigid body's first link, in whose frame it is
    rotation: Floats  # from the link's frame, (3, 3)
    position: Floats  # of the link's origin, (3,) [m]


@dataclass(frozen=True, slots=True, eq=False)
class Urdf:
    """A parsed URDF."""

    text: str  # of the file, with held joints fixed and continuous ones revolute
    links: Mapping[str, Link]  # by name, parents before their children, the robot's body first
    joints: tuple[Joint, ...]  # in the file's order
    # inertia of every rigid body in the frame of its first link, by this link's name, the robot's
    # body first. Links that are fixed to one another are one rigid body, as in Pinocchio.
    bodies: Mapping[str, BodyInertia]
    places: Mapping[str, Place]  # where each link is in its rigid body

    @property
    def body(self) -> BodyInertia:
        """Inertia of the robot's body and everything fixed to it."""
        return next(iter(self.bodies.values()))

    def place(self, name: str) -> Place:
        """Return the pose of a link or of a fixed joint's frame."""
        carried = {joint.name: joint.child for joint in self.joints if joint.fixed}
        link = name if name in self.places else carried.get(name)
        if link is None:
            raise RobotFileError(f"robot.urdf: no link or fixed joint {name!r}")
        return self.places[link]

    @property
    def total_mass(self) -> float:
        return sum(body.mass for body in self.bodies.values())


def parse_urdf(text: str, held: Mapping[str, float] = _NONE_HELD) -> Urdf:
    """Parse a URDF. `held` maps joints to the angle at which they are fixed [rad]."""
    return _read(text, tuple(held.items()))


@lru_cache(maxsize=4)
def _read(text: str, held: tuple[tuple[str, float], ...]) -> Urdf:
    """Cached: a proposal parses its file several times."""
    check_urdf(text)
    with by_line(text):
        return _parsed(text, dict(held))


def _parsed(text: str, held: Mapping[str, float]) -> Urdf:
    """Parse a text that has passed the size checks, which make sure that it is XML."""
    root = ET.fromstring(text)  # noqa: S314 - it has no entities of its own
    if root.tag != "robot":
        raise RobotFileError(
            f"robot.urdf: its root element is <{shortened(root.tag)}>, not <robot>;"
            " convert SDF, MJCF or another format to URDF first"
        )
    if standardise(root, held):
        text = ET.tostring(root, encoding="unicode")
    joints: dict[str, Joint] = {}
    for element in root.findall("joint"):
        joint = joint_of(element)
        if joint.name in joints:
            raise RobotFileError(f"robot.urdf: joint {joint.name!r} is defined twice; rename one")
        joints[joint.name] = joint
    links: dict[str, Link] = {}
    for element in root.findall("link"):
        name = element.get("name", "")
        if name in links:
            raise RobotFileError(f"robot.urdf: link {name!r} is defined twice; rename one")
        links[name] = Link(name, _inertia(element, f"link {name!r}"), element)
    if not links:
        raise RobotFileError(
            "robot.urdf: it has no <link>; convert a xacro file to a URDF first"
            " (`xacro FILE.xacro > FILE.urdf`)"
        )
    in_order = {name: links[name] for name in _from_the_body(links, list(joints.values()))}
    bodies, places = _rigid_bodies(in_order, list(joints.values()))
    if not any(body.mass for body in bodies.values()):
        raise RobotFileError(
            f"robot.urdf: link {next(iter(in_order))!r} and everything attached to it have no mass;"
            " give links an <inertial> with <mass> [kg] and <inertia> [kg m2]"
        )
    return Urdf(text, in_order, tuple(joints.values()), bodies, places)


def _from_the_body(links: Mapping[str, Link], joints: Sequence[Joint]) -> Iterator[str]:
    """Yield names of links, parents before children, each generation in the file's order."""
    children: dict[str, list[str]] = {name: [] for name in links}
    carried: set[str] = set()
    for joint in joints:
        for end in (joint.parent, joint.child):
            if end not in links:
                raise RobotFileError(
                    f"robot.urdf: joint {joint.name!r} refers to a missing link {end!r};"
                    " add the link, or correct <parent> or <child>"
                )
        if joint.child in carried:
            raise RobotFileError(
                f"robot.urdf: joint {joint.name!r} carries link {joint.child!r}, which another"
                " joint already carries; a URDF is a tree: open closed loops at one joint"
            )
        carried.add(joint.child)
        children[joint.parent].append(joint.child)
    generation = [name for name in links if name not in carried]
    if len(generation) != 1:
        raise RobotFileError(
            "robot.urdf: exactly one link, the body, must have no parent joint; found:"
            f" {', '.join(map(repr, generation[:5])) or 'none'}"
            + (f" and {len(generation) - 5} more" if len(generation) > 5 else "")
            + "; a URDF is one tree: attach the others to it, and open closed loops"
        )
    place = {name: k for k, name in enumerate(links)}
    left = set(links)
    while generation:
        yield from generation
        left.difference_update(generation)
        generation = sorted(
            (c for name in generation for c in children[name]), key=place.__getitem__
        )
    if left:
        raise RobotFileError(
            f"robot.urdf: link {min(left)!r} is not attached to the body: its joints form a closed"
            " loop; a URDF is a tree: open the loop at one joint"
        )


def _rigid_bodies(
    links: Mapping[str, Link], joints: Sequence[Joint]
) -> tuple[Mapping[str, BodyInertia], Mapping[str, Place]]:
    """Collect rigid bodies depth first in the order of joint names, as Pinocchio numbers joints."""
    carried: dict[str, list[Joint]] = {name: [] for name in links}
    for joint in sorted(joints, key=lambda joint: joint.name, reverse=True):
        carried[joint.parent].append(joint)
    bodies: dict[str, BodyInertia] = {}
    places: dict[str, Place] = {}
    waiting = [(name, Place(name, np.eye(3), np.zeros(3))) for name in list(links)[:1]]
    while waiting:
        name, place = waiting.pop()
        places[name] = place
        inertia = links[name].inertia.seen_from(place.rotation, place.position)
        bodies[place.body] = bodies.get(place.body, NO_INERTIA).joined(inertia)
        for joint in carried[name]:
            if joint.fixed:
                turned = product(place.rotation, joint.origin.matrix())
                at = product(place.rotation, joint.origin.xyz)
                waiting.append((joint.child, Place(place.body, turned, place.position + at)))
            else:
                waiting.append((joint.child, Place(joint.child, np.eye(3), np.zeros(3))))
    return bodies, places


def _inertia(link: ET.Element, whose: str) -> BodyInertia:
    inertial = link.find("inertial")
    if inertial is None:
        return NO_INERTIA
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    if mass is None or tensor is None:
        raise RobotFileError(f"robot.urdf: {whose}: its <inertial> needs a <mass> and an <inertia>")
    xx, yy, zz, xy, xz, yz = (
        float(numbers_of(tensor, name, whose)[0])
        for name in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    origin = origin_of(inertial, whose)
    turn = origin.matrix()
    about_own_axes = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    rotational = product(product(turn, about_own_axes), turn.T)
    kilograms = float(numbers_of(mass, "value", whose)[0])
    if kilograms < 0.0:
        raise RobotFileError(f"robot.urdf: {whose}: <mass> must not be negative [kg]")
    return BodyInertia(kilograms, origin.xyz, rotational)


_ROUNDED: Final = 1e-6
"""Rounding errors of a file's digits, relative to the largest moment."""

_NONE: Final = 1e-9
"""Moments below this share of the largest count as zero; a rod's about its axis is larger."""


def unphysical(urdf: Urdf, text: str) -> Iterator[str]:
    """Yield warnings about impossible masses and inertias of links fixed to one another."""
    parts: dict[str, list[str]] = {name: [] for name in urdf.bodies}
    for link, place in urdf.places.items():
        parts[place.body].append(link)
    found: dict[str, list[str]] = {}
    for name, body in urdf.bodies.items():
        if body.mass == 0.0:
            problem = (
                f"link {name!r} and the links fixed to it have no mass: give it an <inertial>, or"
                " only the rotors' inertia resists its joints"
            )
            yield with_line(text, f"robot.urdf: {problem}")
            continue
        if _possible(body):
            continue
        inertias = ((link, urdf.links[link].inertia) for link in parts[name])
        wrong = {link: of for link, of in inertias if of.mass and not _possible(of)}
        for link, inertia in (wrong or {name: body}).items():
            moments = ", ".join(f"{moment:.3g}" for moment in _moments(inertia))
            problem = (
                f"a body of {inertia.mass:g} kg cannot have the principal moments {moments} kg m2:"
                " each must be positive and at most the sum of the others; check its <inertia>"
            )
            found.setdefault(problem, []).append(link)
    for problem, (first, *others) in found.items():
        more = f" and {len(others)} others" if others else ""
        yield with_line(text, f"robot.urdf: link {first!r}{more}: {problem}")


def _possible(inertia: BodyInertia) -> bool:
    least, middle, largest = _moments(inertia)
    return bool(least > _NONE * largest and largest <= (least + middle) * (1.0 + _ROUNDED))


def _moments(inertia: BodyInertia) -> Floats:
    """Principal moments in ascending order, (3,) [kg m2]."""
    return np.asarray(np.linalg.eigvalsh(inertia.rotational), dtype=np.float64)
