"""Run-time parameters of the kernel: everything that a scenario or a calibration may vary."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.kernel.contact import LAWS
from sim.robot import Robot
from sim.robot.inertia import parallel_axis
from sim.scenario import Scenario

GRAVITY = 9.81
"""[m/s2], table 5."""

Floats = NDArray[np.float64]


class Layout:
    """Where each parameter lies in the kernel's flat parameter vector.

    field (length): timestep (1), gravity (3), base_mass (1), base_moment (3), base_inertia (6:
    xx yy zz xy xz yz about the body frame's origin), viscous (J), supply_voltage (1),
    supply_resistance (1), backlash (J, if the robot has any), and by foot (L each) the parameters
    of the contact law.
    """

    def __init__(self, robot: Robot) -> None:
        n_joints, n_feet = robot.n_joints, len(robot.legs)
        law = LAWS[robot.description.contact_law]
        lengths = {
            "timestep": 1,
            "gravity": 3,
            "base_mass": 1,
            "base_moment": 3,
            "base_inertia": 6,
            "viscous": n_joints,
            "supply_voltage": 1,
            "supply_resistance": 1,
            "backlash": n_joints if robot.has_backlash else 0,
            **dict.fromkeys(law.parameters, n_feet),
        }
        self.slices: dict[str, slice] = {}
        start = 0
        for name, length in lengths.items():
            self.slices[name] = slice(start, start + length)
            start += length
        self.size = start

    def pack(self, **values: float | Floats) -> Floats:
        """All fields by name -> (size,)."""
        if values.keys() != self.slices.keys():
            raise KeyError(sorted(values.keys() ^ self.slices.keys()))
        packed = np.empty(self.size)
        for name, where in self.slices.items():
            packed[where] = values[name]
        return packed


def gravity_on(slope: float, direction: float = 0.0) -> Floats:
    """Gravity (3,) [m/s2] in a world whose z axis is normal to the ground.

    The ground rises by slope [deg] towards direction [deg], counted from x to y.
    """
    angle, towards = math.radians(slope), math.radians(direction)
    along = -GRAVITY * math.sin(angle)
    return np.array(
        [
            along * math.cos(towards),
            along * math.sin(towards),
            -GRAVITY * math.cos(angle),
        ]
    )


def pack_parameters(robot: Robot, scenario: Scenario, timestep: float) -> Floats:
    """The kernel's parameters for one robot in one scenario.

    A load is a point mass at `load_height` over the body's centre.

    Args:
        robot: The robot.
        scenario: Its load and slope count.
        timestep: Of the physics [s].

    Returns:
        (Layout.size,).
    """
    d, body = robot.description, robot.body
    actuators, contacts = robot.actuators(), robot.contacts()
    at = np.array([0.0, 0.0, d.load_height])
    inertia = (
        body.rotational + body.mass * parallel_axis(body.centre) + scenario.load * parallel_axis(at)
    )
    by_foot = {
        name: np.array([getattr(contact, name) for contact in contacts])
        for name in LAWS[d.contact_law].parameters
    }
    return Layout(robot).pack(
        timestep=timestep,
        gravity=gravity_on(scenario.slope, scenario.slope_direction),
        base_mass=body.mass + scenario.load,
        base_moment=body.mass * body.centre + scenario.load * at,
        base_inertia=inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
        viscous=actuators.viscous,
        supply_voltage=d.supply.voltage,
        supply_resistance=d.supply.resistance,
        backlash=actuators.backlash if robot.has_backlash else np.empty(0),
        **by_foot,
    )
