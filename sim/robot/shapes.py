"""Shapes of a robot's links for display, from its URDF or from its kinematic tree."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Final, Literal
from xml.etree import ElementTree as ET

import numpy as np
from pydantic import Field

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.memory import rotations
from gaitswarm.sim.robot.description import Leg
from gaitswarm.sim.robot.legs import LegKinematics, chain_of
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.urdf import Link, SolidKind, origin_of

Colour = tuple[float, float, float, float]
"""Red, green, blue and opacity, 0 to 1."""

Pose = Annotated[
    tuple[float, float, float, float, float, float, float],
    Field(
        description="In its link's frame: x, y, z [m], then quaternion x, y, z, w.",
        examples=[[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]],
    ),
]

Role = Literal["body", "coxa", "femur", "tibia", "foot", "load"]

_PARTS: Final[tuple[Role, Role, Role]] = ("coxa", "femur", "tibia")

_THICKNESS: Final[Mapping[Role, float]] = {"coxa": 0.07, "femur": 0.06, "tibia": 0.045}
"""Radius of a drawn part relative to the stretched leg's length."""

_LOAD_DENSITY: Final = 2000.0
"""Density of a drawn load [kg/m3], which is a point mass in simulations."""

_UPRIGHT: Final = np.array([0.0, 0.0, 0.0, 1.0])
"""Identity rotation as quaternion x y z w."""


@dataclass(frozen=True, slots=True)
class Shape:
    """One solid, fixed to a link."""

    type: Annotated[
        SolidKind, Field(description="Cylinders and capsules lie along their own z axis.")
    ]
    size: Annotated[
        tuple[float, ...],
        Field(
            description="box: edges x, y, z; sphere: radius; cylinder: radius, length; capsule:"
            " radius, length between the centres of its hemispheres [m].",
            examples=[[0.012, 0.12]],
        ),
    ]
    origin: Pose
    role: Annotated[Role, Field(description="Part of the robot that it shows.")]


@dataclass(frozen=True, slots=True)
class VisualMesh:
    """A mesh on a link, for display only."""

    name: Annotated[
        str,
        Field(
            description="Of its file, as the URDF has it.",
            examples=["package://a1_description/meshes/hip.dae"],
        ),
    ]
    origin: Pose
    scale: Annotated[
        tuple[float, float, float],
        Field(description="Along its own x, y and z [1].", examples=[[0.001, 0.001, 0.001]]),
    ]
    colour: Annotated[
        Colour | None,
        Field(
            description="Red, green, blue and opacity of its material, 0 to 1; null for none.",
            examples=[[0.1, 0.1, 0.1, 1.0]],
        ),
    ]


@dataclass(frozen=True, slots=True)
class VisibleLink:
    """A link of the robot's URDF; fixed ones are included."""

    name: Annotated[str, Field(description="Its name.", examples=["body"])]
    parent: Annotated[str | None, Field(description="Link that carries it; null for the body.")]
    shapes: Annotated[tuple[Shape, ...], Field(description="Its solids; it may have none.")]
    meshes: Annotated[
        tuple[VisualMesh, ...], Field(description="Its meshes in the URDF; it may have none.")
    ] = ()


def visible_links(robot: Robot, load: float = 0.0) -> tuple[VisibleLink, ...]:
    """Return every link with its shapes, parents before their children, the body first."""
    carriers = {joint.child: joint.parent for joint in robot.urdf.joints}
    derived = _derived(robot)
    colours = material_colours(robot.urdf.text)
    roles: dict[str, Role] = {}
    links = []
    for name, link in robot.urdf.links.items():
        parent = carriers.get(name)
        own = derived.get(name)
        # A link fixed to a part belongs to it: a camera to the body, a cover to a tibia.
        role = roles[name] = own.role if own else "body" if parent is None else roles[parent]
        shapes = tuple(
            _shape(solid.kind, solid.size, solid.origin.xyz, solid.origin.quaternion(), role)
            for solid in link.solids()
        ) or ((own,) if own else ())
        if parent is None and load > 0.0:
            shapes = (*shapes, _load(robot, load))
        links.append(VisibleLink(name, parent, shapes, visual_meshes(link, colours)))
    return tuple(links)


def _derived(robot: Robot) -> dict[str, Shape]:
    # A foot is named by its fixed joint or by its link.
    carried = {joint.name: joint.child for joint in robot.urdf.joints}
    shapes = {next(iter(robot.urdf.links)): _trunk(robot)}
    for geometry, leg in zip(robot.legs, robot.description.legs, strict=True):
        chain = chain_of(robot.urdf, leg)
        ends = [*(place.offset for place in chain.placements[1:]), chain.foot]
        radii = _radii(geometry)
        for role, name, end in zip(_PARTS, leg.joints, ends, strict=True):
            shapes[carried[name]] = _capsule(end, radii[role], role)
        shapes[carried.get(leg.foot, leg.foot)] = _sole(robot, leg, radii["tibia"])
    return shapes


def _radii(leg: LegKinematics) -> dict[Role, float]:
    length = sum(leg.lengths)
    return {role: share * length for role, share in _THICKNESS.items()}


def _trunk(robot: Robot) -> Shape:
    """A box from hip to hip, half as high as its shorter side."""
    hips = np.array([leg.hip for leg in robot.legs])
    low, high = hips.min(axis=0), hips.max(axis=0)
    widest = 2.0 * max(_radii(leg)["coxa"] for leg in robot.legs)
    length, width, _ = np.maximum(high - low, widest)
    size = np.array([length, width, 0.5 * min(length, width)])
    return _shape("box", size, 0.5 * (low + high), _UPRIGHT, "body")


@lru_cache(maxsize=16)
def body_corners(robot: Robot) -> Floats:
    """Return the corners (4, 3) [m] of the underside of a box about the body's solids."""
    body = next(iter(robot.urdf.links.values()))
    boxes = [
        (solid.origin.xyz, np.abs(solid.origin.matrix()) @ _half_extent(solid.kind, solid.size))
        for solid in body.solids()
    ]
    if not boxes:
        trunk = _trunk(robot)
        boxes = [(np.array(trunk.origin[:3]), 0.5 * np.array(trunk.size))]
    low = np.min([at - half for at, half in boxes], axis=0)
    high = np.max([at + half for at, half in boxes], axis=0)
    return np.array([[x, y, low[2]] for x in (low[0], high[0]) for y in (low[1], high[1])])


def _half_extent(kind: SolidKind, size: Floats) -> Floats:
    if kind == "box":
        return 0.5 * size
    radius, length = float(size[0]), float(size[-1]) if len(size) > 1 else 0.0
    ends = radius if kind in ("sphere", "capsule") else 0.0
    return np.array([radius, radius, 0.5 * length + ends])


def _capsule(end: Floats, radius: float, role: Role) -> Shape:
    length = float(np.linalg.norm(end))
    turn = _UPRIGHT
    if length > 0.0:
        turn = rotations().align_vectors(end / length, np.array([0.0, 0.0, 1.0]))[0].as_quat()
    return _shape("capsule", np.array([radius, length]), 0.5 * end, turn, role)


def _sole(robot: Robot, leg: Leg, default: float) -> Shape:
    radius = (leg.contact or robot.description.contact).sole or default
    return _shape("sphere", np.array([radius]), np.zeros(3), _UPRIGHT, "foot")


def _load(robot: Robot, mass: float) -> Shape:
    at = np.array([0.0, 0.0, robot.description.load_height])
    edge = (mass / _LOAD_DENSITY) ** (1.0 / 3.0)
    return _shape("box", np.full(3, edge), at, _UPRIGHT, "load")


def _shape(kind: SolidKind, size: Floats, at: Floats, turn: Floats, role: Role) -> Shape:
    x, y, z = at.tolist()
    qx, qy, qz, qw = turn.tolist()
    return Shape(kind, tuple(size.tolist()), (x, y, z, qx, qy, qz, qw), role)


_LARGEST_SCALE: Final = 1e6


def material_colours(urdf: str) -> Mapping[str, Colour]:
    root = ET.fromstring(urdf)  # noqa: S314 - it was checked when it was parsed
    colours: dict[str, Colour] = {}
    for material in root.iter("material"):
        colour = _colour(material)
        if colour is not None:
            colours.setdefault(material.get("name", ""), colour)
    return colours


def visual_meshes(link: Link, colours: Mapping[str, Colour]) -> tuple[VisualMesh, ...]:
    """Return meshes of a link's visual geometry; unreadable parts are omitted or get defaults."""
    meshes = []
    for part in link.element.findall("visual"):
        for mesh in part.findall("geometry/mesh"):
            name = mesh.get("filename", "")
            try:
                origin = origin_of(part, f"link {link.name!r}")
            except RobotFileError:
                continue
            if not name:
                continue
            x, y, z = origin.xyz.tolist()
            qx, qy, qz, qw = origin.quaternion().tolist()
            scale = _numbers(mesh.get("scale", ""), 3, _LARGEST_SCALE)
            meshes.append(
                VisualMesh(
                    name,
                    (x, y, z, qx, qy, qz, qw),
                    (1.0, 1.0, 1.0) if scale is None else (scale[0], scale[1], scale[2]),
                    _material_of(part, colours),
                )
            )
    return tuple(meshes)


def _material_of(part: ET.Element, colours: Mapping[str, Colour]) -> Colour | None:
    material = part.find("material")
    if material is None:
        return None
    return _colour(material) or colours.get(material.get("name", ""))


def _colour(material: ET.Element) -> Colour | None:
    element = material.find("color")
    numbers = None if element is None else _numbers(element.get("rgba", ""), 4, 1.0)
    if numbers is None or min(numbers) < 0.0:
        return None
    return (numbers[0], numbers[1], numbers[2], numbers[3])


def _numbers(text: str, count: int, largest: float) -> list[float] | None:
    try:
        values = [float(part) for part in text.split()]
    except ValueError:
        return None
    fits = all(math.isfinite(value) and abs(value) <= largest for value in values)
    return values if len(values) == count and fits else None


def mesh_bounds(path: Path) -> Floats | None:
    """Return least and largest coordinates of a mesh's vertices (2, 3), in the file's units."""
    # Slow to import, and seldom needed.
    import coal  # noqa: PLC0415

    try:
        vertices = np.asarray(coal.MeshLoader().load(str(path), np.ones(3)).vertices())
    except (ValueError, RuntimeError):
        return None
    if vertices.size == 0 or not np.isfinite(vertices).all():
        return None
    return np.array([vertices.min(axis=0), vertices.max(axis=0)])
