"""A walk in other worlds: the nominal walk's setup with what each world changes of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sim.kernel.parameters import Layout, gravity_on
from sim.kernel.walk import WalkSetup
from sim.robot import Robot
from sim.robot.posture import feet_below_body, height_on_soles
from sim.scenario import Scenario
from sim.worlds.perturbations import NOMINAL

Floats = NDArray[np.float64]

_SCALED: Final[Mapping[str, tuple[str, ...]]] = {
    "friction_factor": ("friction",),
    "stiffness_factor": ("stiffness", "stick_stiffness"),
    "damping_factor": ("damping", "stick_damping"),
    "sole_factor": ("sole",),
    "battery_voltage_factor": ("supply_voltage",),
    "battery_resistance_factor": ("supply_resistance",),
}
"""Fields of the kernel's parameters that are a factor's, where a robot has them."""


def perturbed_setups(
    robot: Robot,
    scenario: Scenario,
    nominal: WalkSetup,
    variables: Sequence[str],
    worlds: Floats,
) -> list[WalkSetup]:
    """What walks in every world; the robot's controller and gait know nothing of it.

    Args:
        robot: As described.
        scenario: Of the walk, with the gait that is walked in.
        nominal: The walk of the robot as described.
        variables: Columns of the worlds.
        worlds: (n, len(variables)), as `check_worlds` wants them.

    Returns:
        One setup a world. That of a world in which all is nominal has the nominal one's bits.
    """
    columns = dict(zip(variables, worlds.T, strict=True))
    values = {
        name: columns.get(name, np.full(len(worlds), default)) for name, default in NOMINAL.items()
    }
    parameters = _parameters(robot, scenario, nominal.parameters, values)
    heights = _resting_heights(robot, scenario, nominal, parameters, values)
    setups = []
    for packed, height in zip(parameters, heights, strict=True):
        start = nominal.start.copy()
        start[2] = height + nominal.drop
        setups.append(replace(nominal, start=start, parameters=packed))
    return setups


def _parameters(
    robot: Robot, scenario: Scenario, nominal: Floats, values: Mapping[str, Floats]
) -> Floats:
    """The kernel's parameters in every world, (n, P)."""
    slices = Layout(robot).slices
    packed = np.tile(nominal, (len(values["load_added"]), 1))
    for factor, fields in _SCALED.items():
        for field in fields:
            if field in slices:
                packed[:, slices[field]] *= values[factor][:, np.newaxis]
    actuators = robot.actuators()
    efficiency = np.minimum(actuators.efficiency * values["efficiency_factor"][:, np.newaxis], 1.0)
    packed[:, slices["viscous"]] = values["viscous_friction_factor"][:, np.newaxis] * (
        actuators.motor_friction + (1.0 - efficiency) * actuators.gear_friction
    )
    _add_masses(robot, scenario, packed, values)
    slopes = zip(values["slope_added"], values["slope_added_direction"], strict=True)
    for row, (slope, direction) in zip(packed, slopes, strict=True):
        if slope > 0.0:
            row[slices["gravity"]] = _gravity(scenario, float(slope), float(direction))
    return packed


def _add_masses(
    robot: Robot, scenario: Scenario, packed: Floats, values: Mapping[str, Floats]
) -> None:
    """The body's other mass and the load's other mass and place, in place."""
    slices, body = Layout(robot).slices, robot.body
    further = values["body_mass_factor"][:, np.newaxis] - 1.0
    load = (scenario.load + values["load_added"])[:, np.newaxis]
    at = np.array([[0.0, 0.0, robot.description.load_height]])
    moved = at + np.stack([values[f"load_{way}"] for way in ("ahead", "left", "raised")], axis=1)
    packed[:, slices["base_mass"]] += further * body.mass + (load - scenario.load)
    packed[:, slices["base_moment"]] += further * (body.mass * body.centre) + (
        load * moved - scenario.load * at
    )
    own = body.rotational[_ROWS, _COLUMNS] + body.mass * _parallel_axes(body.centre[np.newaxis])
    packed[:, slices["base_inertia"]] += further * own + (
        load * _parallel_axes(moved) - scenario.load * _parallel_axes(at)
    )


_ROWS, _COLUMNS = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
"""Of an inertia xx, yy, zz, xy, xz, yz."""


def _parallel_axes(offset: Floats) -> Floats:
    """Rotational inertia of unit point masses, (n, 3) [m] -> (n, 6) [m2]."""
    x, y, z = offset.T
    return np.stack([y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z], axis=1)


def _gravity(scenario: Scenario, slope: float, direction: float) -> Floats:
    """On two slopes at once, which add as vectors along which the ground rises, (3,) [m/s2]."""
    x = y = 0.0
    for angle, towards in ((scenario.slope, scenario.slope_direction), (slope, direction)):
        x += angle * math.cos(math.radians(towards))
        y += angle * math.sin(math.radians(towards))
    return gravity_on(math.hypot(x, y), math.degrees(math.atan2(y, x)))


def _resting_heights(
    robot: Robot,
    scenario: Scenario,
    nominal: WalkSetup,
    parameters: Floats,
    values: Mapping[str, Floats],
) -> list[float]:
    """Height of a level body at which the world's soles carry its weight [m]."""
    slices = Layout(robot).slices
    further = (values["body_mass_factor"] - 1.0) * robot.body.mass
    mass = robot.mass + further + (scenario.load + values["load_added"])
    weight = mass * -parameters[:, slices["gravity"]][:, 2]
    reach = parameters[:, slices["sole"]] - feet_below_body(robot, nominal.start[7:])
    stiffness = parameters[:, slices["stiffness"]]
    return [height_on_soles(*row) for row in zip(reach, stiffness, weight.tolist(), strict=True)]
