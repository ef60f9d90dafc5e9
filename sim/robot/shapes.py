"""What a robot looks like: solids on its links, from its URDF or else from its kinematic tree."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, Literal
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from sim.errors import RobotFileError
from sim.robot.description import Leg
from sim.robot.robot import LegGeometry, Robot

Floats = NDArray[np.float64]

Solid = Literal["box", "sphere", "cylinder", "capsule"]
Role = Literal["body", "coxa", "femur", "tibia", "foot", "load"]

_PARTS: Final[tuple[Role, Role, Role]] = ("coxa", "femur", "tibia")

_THICKNESS: Final[Mapping[Role, float]] = {"coxa": 0.07, "femur": 0.06, "tibia": 0.045}
"""Radius of a drawn part as a share of the stretched leg's length."""

_LOAD_DENSITY: Final = 2000.0
"""Of a drawn load [kg/m3]; to the simulator it is a point."""

_SIZES: Final[Mapping[Solid, tuple[str, ...]]] = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
}
"""URDF's attributes of each solid, in the order of `Shape.size`."""


@dataclass(frozen=True, slots=True)
class Shape:
    """One solid, fixed to a link.

    size [m]: edges x, y, z of a box; radius of a sphere; radius and length of a cylinder or a
    capsule along its own z, a capsule's between the centres of its hemispheres.
    origin: of the solid's centre in its link's frame, position [m] and quaternion x y z w.
    """

    type: Solid
    size: tuple[float, ...]
    origin: tuple[float, float, float, float, float, float, float]
    role: Role


@dataclass(frozen=True, slots=True)
class VisibleLink:
    """A link of the URDF, fixed ones too. parent: name of the link that carries it."""

    name: str
    parent: str | None
    shapes: tuple[Shape, ...]


def visible_links(robot: Robot, load: float = 0.0) -> tuple[VisibleLink, ...]:
    """Every link, parents before their children, the body first.

    A link looks like its visual geometry, or its collision geometry; where the URDF has neither
    (or only meshes), legs are capsules from joint to joint with soles as spheres, and the body is
    a box that spans the hips. load: mass carried on the body [kg].
    Raises RobotFileError for geometry that cannot be read.
    """
    # The file was read before, when the robot was loaded.
    root = ET.fromstring(robot.urdf)  # noqa: S314
    joints = [_Joint.of(element) for element in root.findall("joint")]
    carriers = {joint.child: joint.parent for joint in joints}
    elements = {element.get("name", ""): element for element in root.findall("link")}
    derived = _derived(robot, joints)
    roles: dict[str, Role] = {}
    links = []
    for name in _from_the_body(elements, carriers):
        parent = carriers.get(name)
        own = derived.get(name)
        # What is fixed to a part is of that part: a camera of the body, a cover of a tibia.
        roles[name] = own.role if own else "body" if parent is None else roles[parent]
        shapes = _described(elements[name], roles[name]) or ((own,) if own else ())
        if parent is None and load > 0.0:
            shapes = (*shapes, _load(robot, load))
        links.append(VisibleLink(name, parent, shapes))
    return tuple(links)


@dataclass(frozen=True, slots=True)
class _Joint:
    name: str
    parent: str
    child: str
    origin: Floats

    @classmethod
    def of(cls, element: ET.Element) -> _Joint:
        origin = element.find("origin")
        ends = [element.find(end) for end in ("parent", "child")]
        parent, child = ("" if end is None else end.get("link", "") for end in ends)
        at = np.zeros(3) if origin is None else _numbers(origin, "xyz", "0 0 0")
        return cls(element.get("name", ""), parent, child, at)


def _from_the_body(elements: Mapping[str, object], carriers: Mapping[str, str]) -> Iterator[str]:
    """Names of the links, parents before children."""
    waiting, placed = list(elements), set[str]()
    while waiting:
        ready = [n for n in waiting if n not in carriers or carriers[n] in placed]
        if not ready:
            raise RobotFileError(f"robot.urdf: link {waiting[0]!r} hangs on no body")
        yield from ready
        placed.update(ready)
        waiting = [n for n in waiting if n not in placed]


def _described(link: ET.Element, role: Role) -> tuple[Shape, ...]:
    """Solids that the URDF gives the link."""
    for kind in ("visual", "collision"):
        shapes = [
            _described_shape(part, solid, role)
            for part in link.findall(kind)
            for solid in part.findall("geometry/*")
            if solid.tag in _SIZES
        ]
        if shapes:
            return tuple(shapes)
    return ()


def _described_shape(part: ET.Element, solid: ET.Element, role: Role) -> Shape:
    origin = part.find("origin")
    at, angles = np.zeros(3), np.zeros(3)
    if origin is not None:
        at, angles = _numbers(origin, "xyz", "0 0 0"), _numbers(origin, "rpy", "0 0 0")
    size = np.concatenate([_numbers(solid, name) for name in _SIZES[solid.tag]])  # type: ignore[index]  # one of _SIZES
    return _shape(solid.tag, size, at, _of_angles(*angles), role)  # type: ignore[arg-type]  # one of Solid


def _derived(robot: Robot, joints: list[_Joint]) -> dict[str, Shape]:
    """By link, what the kinematic tree suggests: the body, and the parts of every leg."""
    # A foot may be named by its fixed joint or by its link.
    named = {joint.child: joint for joint in joints} | {joint.name: joint for joint in joints}
    shapes = {_body(joints): _trunk(robot)}
    for geometry, leg in zip(robot.legs, robot.description.legs, strict=True):
        ends = [named[name] for name in (*leg.joints, leg.foot)]
        radii = _radii(geometry)
        for role, here, there in zip(_PARTS, ends, ends[1:], strict=False):
            shapes[here.child] = _capsule(there.origin, radii[role], role)
        shapes[ends[-1].child] = _sole(robot, leg, radii["tibia"])
    return shapes


def _body(joints: list[_Joint]) -> str:
    """Name of the link that no joint carries."""
    carried = {joint.child for joint in joints}
    return next(joint.parent for joint in joints if joint.parent not in carried)


def _radii(leg: LegGeometry) -> dict[Role, float]:
    length = leg.coxa + leg.femur + leg.tibia
    return {role: share * length for role, share in _THICKNESS.items()}


def _trunk(robot: Robot) -> Shape:
    """A box from hip to hip, half as high as it is narrow."""
    hips = np.array([leg.hip for leg in robot.legs])
    low, high = hips.min(axis=0), hips.max(axis=0)
    widest = 2.0 * max(_radii(leg)["coxa"] for leg in robot.legs)
    length, width, _ = np.maximum(high - low, widest)
    size = np.array([length, width, 0.5 * min(length, width)])
    return _shape("box", size, 0.5 * (low + high), _UPRIGHT, "body")


def _capsule(end: Floats, radius: float, role: Role) -> Shape:
    """From the link's origin to `end`."""
    length = float(np.linalg.norm(end))
    turn = _UPRIGHT if length == 0.0 else _from_z_to(end / length)
    return _shape("capsule", np.array([radius, length]), 0.5 * end, turn, role)


def _sole(robot: Robot, leg: Leg, default: float) -> Shape:
    """A sphere that touches the ground when the sole does."""
    radius = (leg.contact or robot.description.contact).sole or default
    return _shape("sphere", np.array([radius]), np.zeros(3), _UPRIGHT, "foot")


def _load(robot: Robot, mass: float) -> Shape:
    at = np.array([0.0, 0.0, robot.description.load_height])
    edge = (mass / _LOAD_DENSITY) ** (1.0 / 3.0)
    return _shape("box", np.full(3, edge), at, _UPRIGHT, "load")


_UPRIGHT: Final = (0.0, 0.0, 0.0, 1.0)


def _shape(
    solid: Solid, size: Floats, at: Floats, turn: tuple[float, float, float, float], role: Role
) -> Shape:
    x, y, z = at.tolist()
    return Shape(solid, tuple(size.tolist()), (x, y, z, *turn), role)


def _from_z_to(direction: Floats) -> tuple[float, float, float, float]:
    """Quaternion x y z w of the shortest turn of the z axis to a unit vector."""
    x, y, z = direction.tolist()
    if z < -1.0 + 1e-12:
        return (1.0, 0.0, 0.0, 0.0)
    half = math.sqrt(2.0 * (1.0 + z))
    return (-y / half, x / half, 0.0, 0.5 * half)


def _of_angles(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Quaternion x y z w of URDF's angles about the fixed axes x, y, z [rad]."""
    (sr, cr), (sp, cp), (sy, cy) = (
        (math.sin(0.5 * angle), math.cos(0.5 * angle)) for angle in (roll, pitch, yaw)
    )
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def _numbers(element: ET.Element, attribute: str, default: str = "") -> Floats:
    """Numbers of an attribute: three of a vector, else one."""
    text = element.get(attribute, default)
    count = 3 if attribute in ("xyz", "rpy", "size") else 1
    try:
        values = np.array([float(part) for part in text.split()])
    except ValueError:
        values = np.empty(0)
    if len(values) != count or not np.isfinite(values).all():
        raise RobotFileError(
            f"robot.urdf: {attribute}={text!r} of a <{element.tag}> is not"
            f" {'three numbers' if count == 3 else 'a number'}"
        )
    return values
