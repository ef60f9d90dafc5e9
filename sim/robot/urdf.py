"""URDF parsing: kinematic tree, inertias and geometry."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Final, Literal, cast
from xml.etree import ElementTree as ET

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.robot.bounds import check_urdf, shortened
from gaitswarm.sim.robot.elements import (
    Joint,
    Origin,
    by_line,
    joint_of,
    numbers_of,
    origin_of,
    standardise,
    with_line,
)
from gaitswarm.sim.robot.inertia import NO_INERTIA, BodyInertia, product

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
