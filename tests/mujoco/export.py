"""Our robot as MuJoCo's MJCF text, straight from its URDF.

The URDF is read with ElementTree, so that neither Pinocchio nor the simulator's own reading of it
has a part in what MuJoCo is given. Joints keep the order of the robot's joint arrays; every foot
is a site of the same name, with a sensor of its position and one of its velocity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal
from xml.etree import ElementTree as ET

import mujoco
import numpy as np

from sim.robot import Robot
from sim.scenario import Scenario

GRAVITY = 9.81
"""[m/s2], table 5."""

TENSOR = ("xx", "yy", "zz", "xy", "xz", "yz")
"""MJCF's order of an inertia's elements."""


@dataclass(frozen=True, slots=True)
class Feet:
    """MuJoCo's own contact of spherical soles on a plane, in place of applied forces.

    impedance: MuJoCo's d, the share of a contact's effect that the constraint may force. The
        smaller, the more exactly the soft constraint is a spring and damper; the default is the
        least that MuJoCo takes.
    drag: tangential force per slip velocity below the friction limit [N s/m].
    friction_impedance: impratio, how much stiffer than the normal constraint the tangential one
        is. At 1 a sliding foot would also be lifted; the tangential impedance is this times d.
    points: the ground is raised by the sole's length and met by the tibias' ends themselves, so
        that its forces act there, as ours do, and not at the bottom of a sphere.
    """

    drag: float
    points: bool = False
    impedance: float = 1e-4
    friction_impedance: float = 100.0


def model(
    robot: Robot,
    *,
    scenario: Scenario | None = None,
    timestep: float = 2e-4,
    feet: Feet | None = None,
    motor_voltage: bool = False,
) -> mujoco.MjModel:
    """The compiled MuJoCo model; see `mjcf`."""
    compiled = mujoco.MjModel.from_xml_string(
        mjcf(
            robot,
            scenario=scenario,
            timestep=timestep,
            soles=None if feet is None else "points" if feet.points else "spheres",
            motor_voltage=motor_voltage,
        )
    )
    if feet is not None:
        _fit_contacts(compiled, robot, feet)
    return compiled


def mjcf(
    robot: Robot,
    *,
    scenario: Scenario | None = None,
    timestep: float = 2e-4,
    soles: Literal["spheres", "points"] | None = None,
    motor_voltage: bool = False,
) -> str:
    """MJCF of a robot on a free joint, with a scenario's load and tilted gravity.

    soles: what meets a ground plane, spheres of the sole's length about the tibias' ends or, with
        the plane raised by as much, these ends themselves. None for no contact.
    motor_voltage: one actuator a joint that turns a motor's voltage into its torque at the joint,
        quasi-static, friction included. Without it, torques are applied from outside.
    """
    urdf = ET.fromstring(robot.urdf.text)  # noqa: S314
    root = ET.Element("mujoco", model=robot.description.name)
    # URDF's roll, pitch, yaw turn about fixed axes.
    ET.SubElement(root, "compiler", angle="radian", eulerseq="XYZ", autolimits="false")
    option = ET.SubElement(
        root,
        "option",
        timestep=repr(timestep),
        gravity=_numbers(_gravity(scenario)),
        integrator="Euler",
        cone="elliptic",
        jacobian="dense",
    )
    if soles is None:
        ET.SubElement(option, "flag", contact="disable", constraint="disable")
    world = ET.SubElement(root, "worldbody")
    if soles is not None:
        lengths = {contact.sole for contact in robot.contacts()}
        (height,) = lengths if soles == "points" else (0.0,)
        ET.SubElement(
            world, "geom", name="ground", type="plane", size="0 0 1", pos=f"0 0 {height!r}"
        )
    children = {_attribute(_child(joint, "child"), "link") for joint in urdf.findall("joint")}
    (base,) = (link for link in urdf.findall("link") if _attribute(link, "name") not in children)
    body = ET.SubElement(world, "body", name=_attribute(base, "name"))
    ET.SubElement(body, "freejoint", name="base")
    _base_inertial(body, base, robot, scenario.load if scenario else 0.0)
    for leg in robot.description.legs:
        _add_leg(body, urdf, robot, leg.name, leg.joints)
    if soles is not None:
        _add_soles(root, robot, points=soles == "points")
    _add_sensors(root, [leg.foot for leg in robot.description.legs])
    if motor_voltage:
        _add_motors(root, robot)
    return ET.tostring(root, encoding="unicode")


def _add_leg(
    base: ET.Element, urdf: ET.Element, robot: Robot, leg: str, joints: Sequence[str]
) -> None:
    # Behind backlash, rotors do not turn with the links.
    rotors = np.zeros(robot.n_joints) if robot.has_backlash else robot.actuators().armature
    armature = dict(zip(robot.joint_names, rotors, strict=True))
    parent = base
    for name in joints:
        joint = _named(urdf, "joint", name)
        link = _attribute(_child(joint, "child"), "link")
        parent = ET.SubElement(parent, "body", {"name": link} | _placement(joint))
        ET.SubElement(
            parent,
            "joint",
            name=name,
            type="hinge",
            axis=_attribute(_child(joint, "axis"), "xyz"),
            armature=repr(float(armature[name])),
            damping="0",
        )
        _inertial(parent, _named(urdf, "link", link))
    (fixed,) = (
        joint
        for joint in urdf.findall("joint")
        if _attribute(_child(joint, "child"), "link") == f"{leg}_foot"
    )
    assert fixed.get("type") == "fixed"
    assert _attribute(_child(fixed, "parent"), "link") == parent.get("name")
    ET.SubElement(parent, "site", {"name": f"{leg}_foot"} | _placement(fixed))


def _inertial(body: ET.Element, link: ET.Element) -> None:
    inertial = _child(link, "inertial")
    tensor = _child(inertial, "inertia")
    numbers = {
        "mass": _attribute(_child(inertial, "mass"), "value"),
        "fullinertia": " ".join(_attribute(tensor, f"i{axes}") for axes in TENSOR),
    }
    ET.SubElement(body, "inertial", numbers | _placement(inertial))


def _base_inertial(body: ET.Element, link: ET.Element, robot: Robot, load: float) -> None:
    """The body's inertia, of the robot's own mass of it if it has one and the URDF's shape.

    A load is a point mass that moves the common centre of mass.
    """
    inertial = _child(link, "inertial")
    drawn = float(_attribute(_child(inertial, "mass"), "value"))
    own = robot.description.body_mass or drawn
    if not load and own == drawn:
        _inertial(body, link)
        return
    place = _placement(inertial)
    assert "euler" not in place
    centre = np.array([float(x) for x in place["pos"].split()])
    element = _child(inertial, "inertia")
    xx, yy, zz, xy, xz, yz = (
        float(_attribute(element, f"i{axes}")) * (own / drawn) for axes in TENSOR
    )
    between = np.array([0.0, 0.0, robot.description.load_height]) - centre
    reduced = own * load / (own + load)
    total = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) + reduced * (
        float(between @ between) * np.eye(3) - np.outer(between, between)
    )
    ET.SubElement(
        body,
        "inertial",
        mass=repr(own + load),
        pos=_numbers(centre + between * load / (own + load)),
        fullinertia=_numbers(total[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]),
    )


def _add_soles(root: ET.Element, robot: Robot, *, points: bool) -> None:
    contact = ET.SubElement(root, "contact")
    for leg, ground in zip(robot.description.legs, robot.contacts(), strict=True):
        (parent,) = (
            b for b in root.iter("body") if b.find(f"./site[@name='{leg.foot}']") is not None
        )
        ET.SubElement(
            parent,
            "geom",
            name=f"{leg.foot}_sole",
            type="sphere",
            size="1e-7" if points else repr(ground.sole),
            pos=_attribute(_child(parent, "site"), "pos"),
            contype="0",
            conaffinity="0",
            mass="0",
        )
        ET.SubElement(
            contact,
            "pair",
            geom1=f"{leg.foot}_sole",
            geom2="ground",
            condim="3",
            friction=_numbers([ground.friction] * 2 + [0.0] * 3),
        )


def _add_sensors(root: ET.Element, sites: Sequence[str]) -> None:
    """All feet's positions, then all their velocities, in the world."""
    sensor = ET.SubElement(root, "sensor")
    for kind in ("framepos", "framelinvel"):
        for site in sites:
            ET.SubElement(sensor, kind, objtype="site", objname=site)


def _add_motors(root: ET.Element, robot: Robot) -> None:
    actuator = ET.SubElement(root, "actuator")
    actuators = robot.actuators()
    for name, k, r, b in zip(
        robot.joint_names, actuators.torque, actuators.resistance, actuators.viscous, strict=True
    ):
        ET.SubElement(
            actuator,
            "general",
            joint=name,
            gainprm=repr(float(k / r)),
            biastype="affine",
            biasprm=_numbers([0.0, 0.0, -(k * k / r + b)]),
        )


def _fit_contacts(compiled: mujoco.MjModel, robot: Robot, feet: Feet) -> None:
    """Make every pair's soft constraint the robot's spring and damper.

    MuJoCo's contact force is [s p - b v - d a] / ((1 - d) A) for a penetration p that the force
    gives the acceleration a, s and b being solref's direct stiffness and damping, d the impedance
    and A the inverse mass that MuJoCo ascribes to the two bodies at the contact.
    """
    d = feet.impedance
    for k, (leg, ground) in enumerate(zip(robot.description.legs, robot.contacts(), strict=True)):
        body = compiled.site_bodyid[compiled.site(leg.foot).id]
        per_force = float(compiled.body_invweight0[body, 0]) * (1.0 - d)
        compiled.pair_solimp[k] = [d, d, 1e-3, 0.5, 2.0]
        compiled.pair_solref[k] = [-ground.stiffness * per_force, -ground.damping * per_force]
        # Tangential constraints have no position, hence no stiffness that would matter.
        compiled.pair_solreffriction[k] = [-1.0, -feet.drag * per_force / feet.friction_impedance]
    compiled.opt.impratio = feet.friction_impedance


def _gravity(scenario: Scenario | None) -> np.ndarray:
    """Ground that rises by a slope is level ground under tilted gravity, (3,) [m/s2]."""
    if scenario is None:
        return np.array([0.0, 0.0, -GRAVITY])
    slope, towards = np.deg2rad(scenario.slope), np.deg2rad(scenario.slope_direction)
    uphill = np.array([np.cos(towards), np.sin(towards), 0.0])
    up: np.ndarray = np.sin(slope) * uphill + np.array([0.0, 0.0, np.cos(slope)])
    return -GRAVITY * up


def _placement(element: ET.Element) -> dict[str, str]:
    """URDF's origin as MJCF's attributes."""
    origin = element.find("origin")
    if origin is None:
        return {"pos": "0 0 0"}
    place = {"pos": origin.get("xyz", "0 0 0")}
    if "rpy" in origin.attrib:
        place["euler"] = origin.attrib["rpy"]
    return place


def _named(urdf: ET.Element, tag: str, name: str) -> ET.Element:
    (found,) = (element for element in urdf.findall(tag) if element.get("name") == name)
    return found


def _child(element: ET.Element, tag: str) -> ET.Element:
    (found,) = element.findall(tag)
    return found


def _attribute(element: ET.Element, name: str) -> str:
    return element.attrib[name]


def _numbers(values: Sequence[float] | np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)
