"""A robot as MJCF, MuJoCo's model format.

Written without MuJoCo. Joints keep the order of the robot's joint arrays. Every foot is a site of
the leg's name, with a sensor of its position and one of its velocity.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.kernel.parameters import gravity_on
from gaitswarm.sim.robot.description import Contact
from gaitswarm.sim.robot.limbs import limbs_of
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.urdf import BodyInertia
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.terrain import HeightGrid, height_grid

if TYPE_CHECKING:
    from gaitswarm.sim.robot.shapes import Shape, VisibleLink

Soles = Literal["none", "spheres", "points"]
"""Contact with the ground: none, with external forces on the feet; spheres of the sole's length
about the tibias' ends; or, with the ground raised by that length, these ends as points."""

_FULL: Final = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
"""MJCF's order of an inertia's elements: xx, yy, zz, xy, xz, yz."""

_POINT: Final = "1e-7"
"""Radius of a sphere that represents a point [m]."""

_COLOURS: Final[Mapping[str, str]] = {
    "body": "0.45 0.5 0.55 1",
    "coxa": "0.85 0.55 0.2 1",
    "femur": "0.3 0.45 0.7 1",
    "tibia": "0.4 0.6 0.45 1",
    "foot": "0.2 0.2 0.2 1",
    "load": "0.6 0.35 0.3 1",
}


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """Properties of a robot's model that depend on the walk."""

    body: BodyInertia  # inertia of the body with its load, in its own frame
    gravity: Floats  # in a world whose z axis is normal to the ground, (3,) [m/s2]
    contacts: tuple[Contact, ...]  # of the feet, in the order of the legs
    ground: HeightGrid | None = None  # if it is uneven
    reach: float = 0.0  # distance from the start to which uneven ground extends [m]

    @classmethod
    def of(cls, robot: Robot, scenario: Scenario | None = None) -> Surroundings:
        """Of a scenario: its load as a point mass, its slope as level ground in tilted gravity."""
        if scenario is None:
            return cls(robot.body, gravity_on(0.0), robot.contacts())
        at = np.array([0.0, 0.0, robot.description.load_height])
        load = BodyInertia(scenario.load, at, np.zeros((3, 3)))
        body = robot.body.joined(load) if scenario.load else robot.body
        gravity = gravity_on(scenario.slope, scenario.slope_direction)
        ground, reach = height_grid(scenario.terrain), reach_of(scenario.duration)
        return cls(body, gravity, robot.contacts(), ground, reach)


def reach_of(duration: float) -> float:
    """Distance [m] that a robot does not leave in a time [s]."""
    return 1.0 + 0.25 * duration


class HeightField(NamedTuple):
    """Uneven ground around the start as MuJoCo has it."""

    heights: Floats  # from 0 to 1, (n, m) over y and x
    size: tuple[float, float, float]  # half the extents along x and y, and the range of z [m]
    at: tuple[float, float, float]  # of its middle, at the least height [m]


def height_field(surroundings: Surroundings, soles: Soles) -> HeightField:
    """Return the ground within reach, at the corners of its own cells unless soles are spheres."""
    ground, reach = surroundings.ground, surroundings.reach
    assert ground is not None  # noqa: S101
    cell, axes = ground.cell, []
    if soles == "spheres":
        # A sphere touches the triangles of all cells below it, each with the whole stiffness.
        cell = max(cell, 4.0 * max(contact.sole for contact in surroundings.contacts))
    for origin, cells in zip(ground.origin, ground.cells, strict=True):
        first, last = math.floor((-reach - origin) / cell), math.ceil((reach - origin) / cell)
        corners = origin + cell * np.arange(first, last + 1.0)
        axes.append(corners if cells > 1 else np.array([-reach, reach]))
    (x, y), heights = axes, ground.height(*np.meshgrid(*axes))
    low = float(heights.min())
    # MuJoCo requires a positive range.
    rise = max(float(heights.max()) - low, 1e-6)
    half_x, half_y, middle_x, middle_y = (
        float(0.5 * (axis[-1] + sign * axis[0])) for sign in (-1.0, 1.0) for axis in (x, y)
    )
    return HeightField((heights - low) / rise, (half_x, half_y, rise), (middle_x, middle_y, low))


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """Optional parts of a model besides its rigid bodies."""

    timestep: float = 2e-4  # of MuJoCo's steps [s]
    soles: Soles = "none"
    # attributes of each foot's contact pair, in the order of the legs; empty for MuJoCo's defaults
    contacts: Sequence[Mapping[str, str]] = ()
    # MuJoCo's impratio: stiffness [1] of a contact's tangential constraint over the normal one
    friction_impedance: float = 1.0
    # whether each foot touches a plane of its own, to be laid along uneven ground below it
    tangent_planes: bool = False
    # whether joints have actuators that turn a motor's voltage [V] into its torque, quasi-static,
    # friction included (torque-controlled joints: that take the torque [N m]); else torques are
    # external
    voltage_motors: bool = False
    looks: Sequence[VisibleLink] = ()  # links with visible shapes; soles are drawn as they are
    start: Floats | None = None  # qpos of a keyframe `start`; None for no keyframe


def mjcf(robot: Robot, surroundings: Surroundings, rig: Rig) -> str:
    """Write a robot on a free joint as MJCF."""
    limbs_of(robot)  # Raises for robots that cannot be simulated.
    root = ET.Element("mujoco", model=robot.description.name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="false")
    option = ET.SubElement(
        root,
        "option",
        timestep=repr(rig.timestep),
        gravity=_numbers(surroundings.gravity),
        integrator="Euler",
        cone="elliptic",
        jacobian="dense",
        impratio=repr(rig.friction_impedance),
    )
    if rig.soles == "none":
        free = {} if robot.has_dry_friction else {"constraint": "disable"}
        ET.SubElement(option, "flag", {"contact": "disable"} | free)
    world = ET.SubElement(root, "worldbody")
    if rig.looks:
        ET.SubElement(world, "light", pos="0 0 3", dir="0 0 -1", directional="true")
    if surroundings.ground is not None:
        _add_height_field(root, world, surroundings, rig)
    elif rig.soles != "none":
        height = repr(_plane_height(surroundings.contacts, rig.soles))
        ET.SubElement(world, "geom", name="ground", type="plane", size="0 0 1", pos=f"0 0 {height}")
    drawn = _shapes(robot, rig.looks)
    first = next(iter(robot.urdf.links))
    at = {} if rig.start is None else {"pos": _numbers(rig.start[:3])}
    body = ET.SubElement(world, "body", {"name": first} | at)
    ET.SubElement(body, "freejoint", name="base")
    _add_inertia(body, surroundings.body)
    _add_shapes(body, drawn.get(first, ()))
    for leg in range(len(robot.legs)):
        foot = _add_leg(body, robot, leg, drawn)
        if rig.soles != "none":
            radius = surroundings.contacts[leg].sole
            name = robot.description.legs[leg].foot
            _add_geom(
                foot,
                "foot",
                name=f"{name}_sole",
                type="sphere",
                size=repr(radius) if rig.soles == "spheres" else _POINT,
                pos=_numbers(robot.urdf.place(name).position),
            )
    feet = [leg.foot for leg in robot.description.legs]
    if rig.soles != "none":
        _add_pairs(root, world, feet, surroundings.contacts, rig)
    _add_sensors(root, feet)
    if rig.voltage_motors:
        _add_motors(root, robot)
    if rig.start is not None:
        keys = ET.SubElement(root, "keyframe")
        ET.SubElement(keys, "key", name="start", qpos=_numbers(rig.start))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode")


def _add_height_field(
    root: ET.Element, world: ET.Element, surroundings: Surroundings, rig: Rig
) -> None:
    """Add the ground; with visible shapes its heights are in the text, else they are to be set."""
    field = height_field(surroundings, "none" if rig.tangent_planes else rig.soles)
    rows, columns = field.heights.shape
    data = {"elevation": " ".join(f"{x:.4g}" for x in field.heights.ravel())} if rig.looks else {}
    ET.SubElement(
        ET.SubElement(root, "asset"),
        "hfield",
        {"name": "ground", "nrow": str(rows), "ncol": str(columns)} | data,
        size=_numbers([*field.size, 0.1]),
    )
    x, y, low = field.at
    at = _numbers([x, y, low + _plane_height(surroundings.contacts, rig.soles)])
    ET.SubElement(world, "geom", name="ground", type="hfield", hfield="ground", pos=at)


def _plane_height(contacts: Sequence[Contact], soles: Soles) -> float:
    if soles != "points":
        return 0.0
    lengths = {contact.sole for contact in contacts}
    if len(lengths) > 1:
        raise ValueError("point contacts require soles of equal length")
    return lengths.pop()


_DRY_FRICTION: Final = {"solimpfriction": "0.9999 0.9999", "solreffriction": "0.0004 1"}
"""MuJoCo's dry friction, almost hard: a held joint creeps at some 1e-6 rad/s."""


def _add_leg(
    base: ET.Element, robot: Robot, number: int, drawn: Mapping[str, Sequence[Shape]]
) -> ET.Element:
    """Add a leg; return its last body."""
    urdf, leg = robot.urdf, robot.description.legs[number]
    # With backlash, rotors do not turn with the links.
    rotors = np.zeros(robot.n_joints) if robot.has_backlash else robot.actuators().armature
    armature = dict(zip(robot.joint_names, rotors.tolist(), strict=True))
    dry = robot.has_dry_friction and not robot.has_backlash
    coulomb = dict(zip(robot.joint_names, robot.actuators().coulomb_friction.tolist(), strict=True))
    joints = {joint.name: joint for joint in urdf.joints}
    parent = base
    for name in leg.joints:
        joint = joints[name]
        carrier = urdf.place(joint.parent)
        turned = carrier.rotation @ joint.origin.matrix()
        at = carrier.rotation @ joint.origin.xyz + carrier.position
        parent = ET.SubElement(parent, "body", {"name": joint.child} | _placement(at, turned))
        element = ET.SubElement(
            parent,
            "joint",
            name=name,
            type="hinge",
            axis=_numbers(joint.axis),
            armature=repr(armature[name]),
            damping="0",
        )
        if dry:
            element.attrib |= _DRY_FRICTION | {"frictionloss": repr(coulomb[name])}
        _add_inertia(parent, urdf.bodies[joint.child])
        _add_shapes(parent, drawn.get(joint.child, ()))
    foot = urdf.place(leg.foot)
    ET.SubElement(parent, "site", {"name": leg.foot} | _placement(foot.position, foot.rotation))
    return parent


def _add_geom(body: ET.Element, colour: str, **attributes: str) -> None:
    """Add a shape that is seen, without contacts of its own."""
    unseen = {"contype": "0", "conaffinity": "0", "mass": "0", "rgba": _COLOURS[colour]}
    ET.SubElement(body, "geom", attributes | unseen)


def _add_inertia(body: ET.Element, inertia: BodyInertia) -> None:
    ET.SubElement(
        body,
        "inertial",
        mass=repr(float(inertia.mass)),
        pos=_numbers(inertia.centre),
        fullinertia=_numbers(inertia.rotational[_FULL]),
    )


def _shapes(robot: Robot, looks: Sequence[VisibleLink]) -> dict[str, list[Shape]]:
    """Shapes by link, for links that are bodies of their own, without soles."""
    return {
        link.name: [shape for shape in link.shapes if shape.role != "foot"]
        for link in looks
        if robot.urdf.places[link.name].body == link.name
    }


def _add_shapes(body: ET.Element, shapes: Sequence[Shape]) -> None:
    for shape in shapes:
        *at, x, y, z, w = shape.origin
        halves = np.array(shape.size) * {"box": [0.5] * 3, "sphere": [1.0]}.get(
            shape.type, [1.0, 0.5]
        )
        _add_geom(
            body,
            shape.role,
            type=shape.type,
            size=_numbers(halves),
            pos=_numbers(at),
            quat=_numbers([w, x, y, z]),
        )


def _add_pairs(
    root: ET.Element,
    world: ET.Element,
    feet: Sequence[str],
    contacts: Sequence[Contact],
    rig: Rig,
) -> None:
    element = ET.SubElement(root, "contact")
    for number, (foot, contact) in enumerate(zip(feet, contacts, strict=True)):
        ground = "ground"
        if rig.tangent_planes:
            ground = f"{foot}_ground"
            plane = {"type": "plane", "size": "0 0 1", "contype": "0", "conaffinity": "0"}
            body = ET.SubElement(world, "body", name=ground, mocap="true")
            ET.SubElement(body, "geom", {"name": ground} | plane)
        pair = {
            "geom1": f"{foot}_sole",
            "geom2": ground,
            "condim": "3",
            "friction": _numbers([contact.friction] * 2 + [0.0] * 3),
        }
        ET.SubElement(element, "pair", pair | dict(rig.contacts[number] if rig.contacts else {}))


def _add_sensors(root: ET.Element, sites: Sequence[str]) -> None:
    """Positions of all feet, then their velocities, in the world."""
    sensor = ET.SubElement(root, "sensor")
    for kind in ("framepos", "framelinvel"):
        for site in sites:
            ET.SubElement(sensor, kind, objtype="site", objname=site)


def _add_motors(root: ET.Element, robot: Robot) -> None:
    actuator, a = ET.SubElement(root, "actuator"), robot.actuators()
    for k, name in enumerate(robot.joint_names):
        if robot.is_torque_controlled:
            limit, gain, damping = float(a.torque_limit[k]), "1", a.viscous[k]
            limits = {"ctrllimited": "true", "ctrlrange": _numbers([-limit, limit])}
        else:
            per_volt = a.torque[k] / a.resistance[k]
            gain, limits = repr(float(per_volt)), {}
            damping = a.torque[k] * a.torque[k] / a.resistance[k] + a.viscous[k]
        unit = "torque" if robot.is_torque_controlled else "voltage"
        ET.SubElement(
            actuator,
            "general",
            {"name": f"{name}_{unit}", "joint": name} | limits,
            gainprm=gain,
            biastype="affine",
            biasprm=_numbers([0.0, 0.0, -damping]),
        )


def _placement(position: Floats, rotation: Floats) -> dict[str, str]:
    place = {"pos": _numbers(position)}
    if not np.array_equal(rotation, np.eye(3)):
        place["xyaxes"] = _numbers(rotation[:, :2].T.ravel())
    return place


def _numbers(values: Sequence[float] | Floats) -> str:
    return " ".join(repr(float(value)) for value in values)
