"""Compiled models of a robot, with MuJoCo's contacts fitted to it, and their export.

MuJoCo's contact force is [s p - b v - d a] / ((1 - d) A) for a penetration p with the acceleration
a due to the force, s and b being solref's direct stiffness and damping, d the impedance and A the
inverse mass that MuJoCo assigns to the two bodies at the contact.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from gaitswarm.sim.gait.gaits import leg_gaits
from gaitswarm.sim.gait.trajectory import desired_angles, require_reachable
from gaitswarm.sim.mujoco.mjcf import Rig, Surroundings, mjcf
from gaitswarm.sim.robot.description import Contact
from gaitswarm.sim.robot.limbs import resting_height
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.shapes import visible_links
from gaitswarm.sim.scenario import Scenario


@dataclass(frozen=True, slots=True)
class Feet:
    """MuJoCo's own contact of soles on a plane, in place of applied forces."""

    # tangential force per slip velocity below the friction limit, by leg [N s/m]
    drags: tuple[float, ...]
    # whether the ground is raised by the sole's length and touched by the tibias' ends, so that its
    # forces act there, as in the kernel, and not at the bottom of a sphere
    points: bool = False
    # MuJoCo's d, the share of a contact's effect that the constraint may force. The smaller, the
    # closer the soft constraint is to a spring and damper; the default is MuJoCo's minimum.
    impedance: float = 1e-4
    # impratio, stiffness of the tangential constraint relative to the normal one. At 1 a sliding
    # foot would also be lifted; the tangential impedance is this times `impedance`.
    friction_impedance: float = 100.0


def with_contacts(robot: Robot, surroundings: Surroundings, rig: Rig, feet: Feet) -> Rig:
    """Let MuJoCo compute the contacts, with the robot's spring and damper for each pair."""
    rig = replace(rig, soles="points" if feet.points else "spheres")
    free = mujoco.MjModel.from_xml_string(mjcf(robot, surroundings, rig))
    return replace(
        rig,
        contacts=[
            _pair(free, leg.foot, contact, drag, feet)
            for leg, contact, drag in zip(
                robot.description.legs, surroundings.contacts, feet.drags, strict=True
            )
        ],
        friction_impedance=feet.friction_impedance,
    )


def even_drags(
    robot: Robot, surroundings: Surroundings, standing: float | None = None
) -> tuple[float, ...]:
    """Drags, by leg [N s/m], with which friction is full at the same slip as in the robot's law."""
    mass = robot.urdf.total_mass - robot.urdf.body.mass + surroundings.body.mass
    share = -float(surroundings.gravity[2]) * mass / (standing or 0.5 * len(robot.legs))
    zoned = robot.description.contact_law in {"linear_zone", "dead_zone"}
    return tuple(
        contact.friction * share / (contact.slip_velocity if zoned else contact.stick_velocity)
        for contact in surroundings.contacts
    )


def _pair(
    free: mujoco.MjModel, foot: str, contact: Contact, drag: float, feet: Feet
) -> Mapping[str, str]:
    """Attributes of a foot's contact pair."""
    d = feet.impedance
    body = free.site_bodyid[free.site(foot).id]
    per_force = float(free.body_invweight0[body, 0]) * (1.0 - d)
    spring, damper = contact.stiffness * per_force, contact.damping * per_force
    # Tangential constraints have no position, hence no relevant stiffness.
    rub = drag * per_force / feet.friction_impedance
    return {
        "solimp": f"{d!r} {d!r} 0.001 0.5 2",
        "solref": f"{-spring!r} {-damper!r}",
        "solreffriction": f"-1 {-rub!r}",
    }


def exported(robot: Robot, scenario: Scenario, *, contacts: bool = True) -> str:
    """Write a robot in a scenario as MJCF for MuJoCo's viewer, with the pose at its start.

    Backlash, limits of torque by speed, the battery's sag and, of dry friction, all but
    `coulomb_friction` are omitted.
    """
    require_reachable(robot, scenario)
    surroundings = Surroundings.of(robot, scenario)
    joints = desired_angles(robot, scenario).start
    mass = robot.mass + scenario.load
    weight = mass * -float(surroundings.gravity[2])
    height = resting_height(robot, joints, weight, surroundings.ground)
    rig = Rig(
        voltage_motors=True,
        looks=visible_links(robot, scenario.load),
        start=np.array([0.0, 0.0, height + scenario.drop, 1.0, 0.0, 0.0, 0.0, *joints]),
    )
    if contacts:
        standing = sum(gait.support_share for gait in leg_gaits(robot, scenario))
        feet = Feet(even_drags(robot, surroundings, standing))
        rig = with_contacts(robot, surroundings, rig, feet)
    text = mjcf(robot, surroundings, rig)
    mujoco.MjModel.from_xml_string(text)
    return text
