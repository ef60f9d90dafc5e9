"""A walk in other worlds: the nominal walk's setup with what each world changes of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.kernel.parameters import Layout, gravity_on
from gaitswarm.sim.kernel.sensors import DEVIATION, SensorErrors, byte_sums
from gaitswarm.sim.kernel.walk import WalkSetup
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.robot.posture import feet_in_body, height_on_soles
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.worlds.perturbations import NOMINAL

Floats = NDArray[np.float64]

_SCALED: Final[Mapping[str, tuple[str, ...]]] = {
    "friction_factor": ("friction",),
    "stiffness_factor": ("stiffness", "stick_stiffness"),
    "damping_factor": ("damping", "stick_damping"),
    "sole_factor": ("sole",),
    "backlash_factor": ("backlash",),
    "battery_voltage_factor": ("supply_voltage",),
    "battery_resistance_factor": ("supply_resistance",),
}
"""Fields of the kernel's parameters that are a factor's, where a robot has them."""

_START: Final = 1
"""Stream of a world's seed for the angles at the start."""


def perturbed_setups(
    robot: Robot,
    scenario: Scenario,
    nominal: WalkSetup,
    variables: Sequence[str],
    worlds: Floats,
) -> list[WalkSetup]:
    """What walks in every world; the robot's controller and gait know nothing of it.

    Args:
        worlds: (n, len(variables)), as `check_worlds` wants them.
    """
    columns = dict(zip(variables, worlds.T, strict=True))
    values = {
        name: columns.get(name, np.full(len(worlds), default)) for name, default in NOMINAL.items()
    }
    parameters = _parameters(robot, scenario, nominal.parameters, values)
    starts = _starts(robot, scenario, nominal, parameters, values)
    internal_states = np.tile(nominal.internal_state, (len(worlds), 1))
    if robot.has_backlash:
        internal_states[:, : robot.n_joints] = starts[:, 7:]
    drops = nominal.drop + values["start_height"]
    errors = _sensor_errors(values)
    rows = zip(starts, internal_states, parameters, drops.tolist(), errors, strict=True)
    return [
        replace(
            nominal,
            start=start,
            internal_state=internal_state,
            parameters=packed,
            drop=drop,
            sensors=sensors,
        )
        for start, internal_state, packed, drop, sensors in rows
    ]


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


def _starts(
    robot: Robot,
    scenario: Scenario,
    nominal: WalkSetup,
    parameters: Floats,
    values: Mapping[str, Floats],
) -> Floats:
    """Positions at which the world's soles carry its weight, and above, (n, 7+J)."""
    slices = Layout(robot).slices
    starts = np.tile(nominal.start, (len(parameters), 1))
    seeds = values["world_seed"].astype(np.uint64)
    deviates = byte_sums(seeds, 0, robot.n_joints, _START)[..., 0] / DEVIATION
    offsets = values["start_angle"][:, np.newaxis] * deviates
    starts[:, 7:] += offsets
    # A jammed leg is held where it begins.
    jammed = parameters[:, slices["jam_stiffness"]] > 0.0
    parameters[:, slices["jam_angle"]] += jammed * offsets
    further = (values["body_mass_factor"] - 1.0) * robot.body.mass
    mass = robot.mass + further + (scenario.load + values["load_added"])
    weight = mass * -parameters[:, slices["gravity"]][:, 2]
    tilts = np.radians(np.stack([values["start_roll"], values["start_pitch"]], axis=1))
    for start, packed, carried, tilt in zip(
        starts, parameters, weight.tolist(), tilts, strict=True
    ):
        start[3:7], up = _attitude(*tilt.tolist())
        reach = packed[slices["sole"]] - feet_in_body(robot, start[7:]) @ up
        start[2] = height_on_soles(reach, packed[slices["stiffness"]], carried)
    starts[:, 2] += nominal.drop + values["start_height"]
    return starts


def _attitude(roll: float, pitch: float) -> tuple[Floats, Floats]:
    """Rolled, then pitched [rad]: quaternion x y z w, and the world's z in the body's frame."""
    x, a = math.sin(0.5 * roll), math.cos(0.5 * roll)
    y, b = math.sin(0.5 * pitch), math.cos(0.5 * pitch)
    up = [-math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)]
    return np.array([b * x, y * a, 0.0 - y * x, a * b]), np.array(up)


def _sensor_errors(values: Mapping[str, Floats]) -> list[SensorErrors]:
    names = ("angle_noise", "current_noise", "angle_delay", "current_delay", "world_seed")
    columns = zip(*(values[name].tolist() for name in names), strict=True)
    return [
        SensorErrors(angle, current, round(late_angle), round(late_current), round(seed))
        for angle, current, late_angle, late_current, seed in columns
    ]
