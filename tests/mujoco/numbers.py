"""A robot's model and its numbers for the forces in MuJoCo, directly from its description."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.kernel.parameters import DRY_FRICTION
from gaitswarm.sim.mujoco.forces import Gears, Ground
from gaitswarm.sim.mujoco.mjcf import Rig, Surroundings, mjcf
from gaitswarm.sim.mujoco.model import Feet, even_drags, with_contacts
from gaitswarm.sim.robot.description import DIRECTIONAL_FRICTION, Contact
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario

Floats = NDArray[np.float64]


def model(
    robot: Robot, *, scenario: Scenario | None = None, feet: Feet | None = None
) -> mujoco.MjModel:
    """A robot in a scenario, compiled by MuJoCo."""
    rig, surroundings = Rig(), Surroundings.of(robot, scenario)
    if feet is not None:
        rig = with_contacts(robot, surroundings, rig, feet)
    return mujoco.MjModel.from_xml_string(mjcf(robot, surroundings, rig))


def own_gears(robot: Robot, angles: Floats) -> Gears:
    """The robot's, with motors and links at the same angles (J,) [rad], at rest."""
    actuators, supply = robot.actuators(), robot.description.supply
    numbers = {
        "viscous": actuators.viscous,
        "supply_voltage": np.array([supply.voltage]),
        "supply_resistance": np.array([supply.resistance]),
        **{
            name: getattr(actuators, name)
            if robot.has_dry_friction and name not in DIRECTIONAL_FRICTION
            else np.empty(0)
            for name in DRY_FRICTION
        },
        "backlash": actuators.backlash,
    }
    return Gears(robot, numbers, angles)


def own_ground(robot: Robot) -> Ground:
    """The robot's law of contact with every foot's own numbers."""
    return Ground(robot.description.contact_law, _contacts(robot))


def even_feet(robot: Robot, scenario: Scenario, *, points: bool = False) -> Feet:
    """MuJoCo's own contacts, with the drag of feet that carry even shares of the weight."""
    standing = scenario.duty_factor * len(robot.legs)
    drags = even_drags(robot, Surroundings.of(robot, scenario), standing)
    return Feet(drags, points=points)


def _contacts(robot: Robot) -> Mapping[str, Floats]:
    return {
        name: np.array([getattr(contact, name) for contact in robot.contacts()])
        for name in Contact.model_fields
    }
