"""Proposed actuators and control as text of a robot.toml."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from gaitswarm.sim.proposal.drive import DriveNumbers
from gaitswarm.sim.robot.actuators import ActuatorKind

_VOLTAGE: Final = 24.0
"""Assumed battery voltage [V]."""

_RATIO: Final = 9.0
"""Assumed efficiency of a gearhead."""

_EFFICIENCY: Final = 0.95

_LARGEST_CODE: Final = 26000.0
"""Code of the current at standstill, somewhat below the largest of 16 bits [counts]."""

ACTUATOR_NOTES: Final[Mapping[ActuatorKind, str]] = MappingProxyType(
    {
        "dc": "actuators are assumed to be DC motors with gearheads; else choose actuator torque",
        "torque": "actuators are assumed to be torque-controlled; choose actuator dc for DC motors",
    }
)

_KNEE: Final = 0.5
"""Share of the speed limit up to which a quasi-direct drive has its full torque."""

_STIFFNESS, _DAMPING = (0.5, 10.0), (0.005, 0.1)
"""Bounds of a joint PD's gains relative to the torque limit [1/rad], [s/rad]."""


def actuator_tables(kind: ActuatorKind, drives: Sequence[Sequence[DriveNumbers]]) -> list[str]:
    """Return lines of robot.toml: actuators, battery, command and sensors."""
    if kind == "torque":
        return [*_torque_actuators(drives), *_torque_electronics(drives)]
    return [*_dc_motors(drives), *_dc_electronics(drives)]


def proposed_control(
    kind: ActuatorKind, drives: Sequence[Sequence[DriveNumbers]]
) -> dict[str, Any]:
    """Return a controller, and bounds of its variables that follow from the torques."""
    if kind == "dc":
        return {"controller": "pid"}
    limit = float(np.median([drive.torque for of_leg in drives for drive in of_leg]))

    def variable(name: str, unit: str, bounds: tuple[float, float]) -> dict[str, Any]:
        low, high = (float(f"{share * limit:.3g}") for share in bounds)
        return {"name": name, "low": low, "high": high, "unit": unit}

    return {
        "controller": "joint-pd",
        "variables": [
            variable("Kp", "N m/rad", _STIFFNESS),
            variable("Kd", "N m s/rad", _DAMPING),
            "feed_forward",
        ],
    }


def drive_names(drives: Sequence[Sequence[DriveNumbers]]) -> dict[DriveNumbers, str]:
    kinds = dict.fromkeys(drive for of_leg in drives for drive in of_leg)
    return {drive: f"drive{number}" for number, drive in enumerate(kinds, start=1)}


def _dc_motors(drives: Sequence[Sequence[DriveNumbers]]) -> list[str]:
    lines = [
        "",
        "# Each drive is a DC motor whose torque falls from standstill to its no-load speed at",
        f"# {_VOLTAGE:g} V; rotor inertia is 2 % of a leg's share of the mass at the leg's length.",
    ]
    for drive, name in drive_names(drives).items():
        constant = _VOLTAGE / drive.speed / _RATIO
        resistance = _VOLTAGE * constant * _RATIO / drive.torque
        lines += [
            "",
            f"[motors.{name}]                     # {drive.note}",
            f"torque_constant = {constant:.6g}    # N m/A",
            f"resistance = {resistance:.6g}       # ohm",
            "inductance = 1e-4                   # H",
            f"rotor_inertia = {drive.armature / _RATIO**2:.6g}    # kg m2",
            "viscous_friction = 0.0              # N m s/rad",
            "",
            f"[gearheads.{name}]",
            f"ratio = {_RATIO}",
            f"nominal_torque = {drive.torque:.6g}    # N m",
            f"nominal_speed = {drive.speed * _RATIO:.6g}    # rad/s, motor side",
            f"efficiency = {_EFFICIENCY}          # guessed",
            "",
            f"[actuators.{name}]",
            f"motor = {quoted(name)}",
            f"gearhead = {quoted(name)}",
        ]
    return lines


def _torque_actuators(drives: Sequence[Sequence[DriveNumbers]]) -> list[str]:
    lines = [
        "",
        "# Each actuator has its full torque up to half its speed limit, and less above that.",
        f"# Guessed: the motor's voltage at the speed limit is {_VOLTAGE:g} V; its heat at the",
        "# torque limit is the largest power on a line between the two limits; rotor inertia is",
        "# 2 % of a leg's share of the mass at the leg's length; there is no friction.",
    ]
    for drive, name in drive_names(drives).items():
        constant = _VOLTAGE / drive.speed
        resistance = constant**2 * drive.speed / (4.0 * drive.torque)
        lines += [
            "",
            f"[actuators.{name}]                  # {drive.note}",
            'kind = "torque"',
            f"gear_ratio = {_RATIO}              # guessed",
            f"torque_constant = {constant / _RATIO:.6g}    # N m/A",
            f"resistance = {resistance:.6g}       # ohm",
            f"rotor_inertia = {drive.armature / _RATIO**2:.6g}    # kg m2",
            f"torque_limit = {drive.torque:.6g}   # N m",
            f"speed_limit = {drive.speed:.6g}     # rad/s",
            f"knee_speed = {_KNEE * drive.speed:.6g}      # rad/s",
        ]
    return lines


def _torque_electronics(drives: Sequence[Sequence[DriveNumbers]]) -> list[str]:
    return [
        "",
        "[supply]                            # guessed",
        f"voltage = {_VOLTAGE}                 # V, open circuit",
        "resistance = 0.01                   # ohm",
        "",
        "[torque_command]",
        "rate = 1000                         # Hz, of the joint PD in the actuators; guessed",
        "",
        *_sensors(max(d.torque * d.speed for of_leg in drives for d in of_leg) / _VOLTAGE),
    ]


def _dc_electronics(drives: Sequence[Sequence[DriveNumbers]]) -> list[str]:
    largest = max(d.torque * d.speed for of_leg in drives for d in of_leg) / _VOLTAGE
    return [
        "",
        "[supply]                            # guessed",
        f"voltage = {_VOLTAGE}                 # V, open circuit",
        "resistance = 0.01                   # ohm",
        f"nominal_voltage = {_VOLTAGE}         # V",
        "",
        "[pwm]                               # 10 bits and a sign",
        "counts = 1023",
        f"full_scale = {_VOLTAGE}              # V",
        "step = 1",
        "",
        *_sensors(largest),
    ]


def _sensors(largest: float) -> list[str]:
    return [
        "[sensors]                           # 16 bits per turn, 12 bits of current",
        "angle_counts = 10430.0              # per rad",
        "angle_step = 1",
        f"current_counts = {_LARGEST_CODE / largest:.6g}    # an A",
        "current_step = 16",
    ]


def quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
