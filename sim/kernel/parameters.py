"""Run-time parameters of the kernel: everything that a scenario or a calibration may vary."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.robot import Robot
from sim.scenario import Scenario

GRAVITY = 9.81
"""[m/s2], table 5."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class BodyInertia:
    """Mass [kg], centre of mass (3,) [m] and rotational inertia about it (3, 3) [kg m2]."""

    mass: float
    centre: Floats
    rotational: Floats


class Layout:
    """Where each parameter lies in the kernel's flat parameter vector.

    field (length): timestep (1), gravity (3), base_mass (1), base_moment (3), base_inertia (6:
    xx yy zz xy xz yz about the body frame's origin), viscous (J), supply_voltage (1),
    supply_resistance (1), and by foot stiffness, damping, sole, friction, slip_velocity (L each).
    """

    def __init__(self, n_joints: int, n_feet: int) -> None:
        lengths = {
            "timestep": 1,
            "gravity": 3,
            "base_mass": 1,
            "base_moment": 3,
            "base_inertia": 6,
            "viscous": n_joints,
            "supply_voltage": 1,
            "supply_resistance": 1,
            "stiffness": n_feet,
            "damping": n_feet,
            "sole": n_feet,
            "friction": n_feet,
            "slip_velocity": n_feet,
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


def gravity_on(slope: float) -> Floats:
    """Gravity (3,) [m/s2] in a world whose z axis is normal to ground rising by slope [deg]."""
    angle = math.radians(slope)
    return GRAVITY * np.array([-math.sin(angle), 0.0, -math.cos(angle)])


def pack_parameters(robot: Robot, body: BodyInertia, scenario: Scenario, timestep: float) -> Floats:
    """The kernel's parameters for one robot in one scenario, (Layout.size,).

    A load is a point mass at `load_height` over the body's centre.
    """
    d = robot.description
    contacts = robot.contacts()
    at = np.array([0.0, 0.0, d.load_height])
    inertia = (
        body.rotational
        + body.mass * _parallel_axis(body.centre)
        + scenario.load * _parallel_axis(at)
    )
    by_foot = {
        name: np.array([getattr(contact, name) for contact in contacts])
        for name in ("stiffness", "damping", "sole", "friction", "slip_velocity")
    }
    return Layout(robot.n_joints, len(robot.legs)).pack(
        timestep=timestep,
        gravity=gravity_on(scenario.slope),
        base_mass=body.mass + scenario.load,
        base_moment=body.mass * body.centre + scenario.load * at,
        base_inertia=inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
        viscous=robot.drives().viscous,
        supply_voltage=d.supply.voltage,
        supply_resistance=d.supply.resistance,
        **by_foot,
    )


def _parallel_axis(at: Floats) -> Floats:
    return float(at @ at) * np.eye(3) - np.outer(at, at)
