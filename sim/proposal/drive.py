"""Proposed actuators, soles and control, from the load on a leg, as text of a robot.toml."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from types import MappingProxyType
from typing import Any, Final, Literal, get_args

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.kernel.parameters import GRAVITY
from gaitswarm.sim.proposal.stance import Stance
from gaitswarm.sim.robot.description import (
    ActuatorKind,
    DryFriction,
    ListedActuator,
    listed_actuator,
)
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.urdf import Joint, Urdf

_ENOUGH, _PLAUSIBLE = 2.0, 60.0
"""Plausible torques of a URDF, relative to what standing on half the legs takes."""

_GUESSED_TORQUE: Final = 5.0
"""Stall torque where the URDF's is implausible, in the same units."""

_SLOWEST, _FASTEST = 2.0, 100.0
"""Plausible speeds of a URDF [rad/s]."""

_GUESSED_SPEED: Final = 20.0
"""No-load speed where the URDF's is implausible [rad/s]."""

_ARMATURE: Final = 0.02
"""Rotor inertia at a joint, relative to a leg's share of the mass at the leg's length."""

_STUCK: Final = 0.5
"""Friction at full speed beyond which it is implausible, relative to the torque at standstill."""

_SINKS: Final = 0.01
"""Deflection of soles when half the legs carry the robot, relative to its height."""

_SOLE: Final = 0.05
"""Length of soles without spheres, relative to the leg's length."""


_DIRECT: Final = 12.0
"""Speed of the slowest joint above which drives count as quasi-direct [rad/s]; small motors with a
gear ratio of a hundred or more are slower."""

ActuatorChoice = Literal["auto", "dc", "torque"]
"""Kind of actuators to propose: as the URDF's limits suggest, or a given one."""

ACTUATOR_CHOICES: Final[tuple[ActuatorChoice, ...]] = get_args(ActuatorChoice)


@dataclass(frozen=True, slots=True)
class DriveNumbers:
    """A joint's drive, by its effect at the joint."""

    torque: float  # at standstill and a DC motor's full voltage [N m]
    speed: float  # without load at a DC motor's full voltage [rad/s]
    armature: float  # of the rotor at the joint [kg m2]
    note: str  # source of the numbers
    damping: float = 0.0  # at the joint [N m s/rad]
    friction: float = 0.0  # dry, at the joint [N m]
    believed: bool = False  # whether torque and speed are the URDF's
    listed: str | None = None  # name in the library of actuators


@dataclass(frozen=True, slots=True)
class SoleNumbers:
    """Contact of soles with the ground."""

    length: float  # of the sole's spring beyond the leg's end [m]
    stiffness: float  # [N/m]
    damping: float  # [N s/m]


def propose_drives(
    urdf: Urdf,
    names: Sequence[Sequence[str]],
    legs: Sequence[ChainLeg],
    stance: Stance,
    actuators: Mapping[str, str],
) -> list[list[DriveNumbers]]:
    """Propose a drive for every joint, by leg: those of the library, if there are any."""
    joints = {joint.name: joint for joint in urdf.joints}
    if actuators:
        return _listed_drives(names, actuators)
    needs = _standing_torques(urdf, legs, stance)
    # In motion any joint of a leg may need what its worst one needs at rest.
    worst = np.maximum(np.max(needs, axis=0), 0.5 * np.max(needs))
    share = urdf.total_mass / len(legs)
    return [
        [
            _drive(joints[name], float(need), _ARMATURE * share * sum(leg.lengths) ** 2)
            for name, need in zip(of_leg, worst, strict=True)
        ]
        for of_leg, leg in zip(names, legs, strict=True)
    ]


def _standing_torques(urdf: Urdf, legs: Sequence[ChainLeg], stance: Stance) -> list[Floats]:
    """Torques of each leg's joints when half the legs carry the robot [N m]."""
    force = urdf.total_mass * GRAVITY / (len(legs) / 2.0)
    slopes = [leg.feet(np.array([at]))[1] for leg, at in zip(legs, stance.angles, strict=True)]
    return [np.abs(slope[0, 2, :]) * force for slope in slopes]


def weak_actuators(
    urdf: Urdf,
    names: Sequence[Sequence[str]],
    legs: Sequence[ChainLeg],
    stance: Stance,
    drives: Sequence[Sequence[DriveNumbers]],
) -> list[str]:
    """Return a warning for each listed actuator whose motor cannot carry the robot."""
    worst: dict[str, tuple[float, str, float]] = {}
    needs = _standing_torques(urdf, legs, stance)
    for joints, torques, of_leg in zip(names, needs, drives, strict=True):
        for joint, need, drive in zip(joints, torques.tolist(), of_leg, strict=True):
            if drive.listed and need > max(drive.torque, worst.get(drive.listed, (0.0,))[0]):
                worst[drive.listed] = need, joint, drive.torque
    return [
        f"warning: {name} is too weak: standing on half the legs takes {need:.2g} N m at {joint},"
        f" its motor has {torque:.2g} N m; choose another actuator, or correct the mass (`--mass`)"
        for name, (need, joint, torque) in worst.items()
    ]


def _listed_drives(
    names: Sequence[Sequence[str]], actuators: Mapping[str, str]
) -> list[list[DriveNumbers]]:
    def drive_of(joint: str) -> DriveNumbers:
        matches = [name for pattern, name in actuators.items() if fnmatchcase(joint, pattern)]
        if not matches:
            raise RobotFileError(
                f"joint {joint!r} has no actuator; name one for all others first, as"
                f" `--actuator {next(iter(actuators.values()))}`"
            )
        name = matches[-1]
        numbers = listed_actuator(name)
        torque, speed, armature = numbers.stall_torque, numbers.no_load_speed, numbers.armature
        return DriveNumbers(torque, speed, armature, numbers.note, believed=True, listed=name)

    joints = [joint for of_leg in names for joint in of_leg]
    for pattern in actuators:
        if not any(fnmatchcase(joint, pattern) for joint in joints):
            raise RobotFileError(
                f"no leg has a joint {pattern!r} for an actuator; there are {', '.join(joints[:6])}"
            )
    drives = [[drive_of(joint) for joint in of_leg] for of_leg in names]
    of_kinds = {listed.kind: name for name, listed in _listed_in(drives).items()}
    if len(of_kinds) > 1:
        raise RobotFileError(
            f"actuator {of_kinds['torque']!r} is torque-controlled and {of_kinds['dc']!r} is not;"
            " a robot has actuators of one kind"
        )
    return drives


def _listed_in(drives: Sequence[Sequence[DriveNumbers]]) -> dict[str, ListedActuator]:
    """Actuators of the library by name."""
    names = dict.fromkeys(drive.listed for of_leg in drives for drive in of_leg)
    return {name: listed_actuator(name) for name in names if name is not None}


def chosen_kind(choice: ActuatorChoice, drives: Sequence[Sequence[DriveNumbers]]) -> ActuatorKind:
    for actuator in _listed_in(drives).values():
        return actuator.kind
    if choice != "auto":
        return choice
    of_joints = [drive for of_leg in drives for drive in of_leg]
    direct = all(drive.believed and drive.speed >= _DIRECT for drive in of_joints)
    return "torque" if direct else "dc"


def _drive(joint: Joint, need: float, armature: float) -> DriveNumbers:
    given = _ENOUGH * need <= joint.effort <= _PLAUSIBLE * need
    torque = joint.effort if given else _GUESSED_TORQUE * need
    fast = _SLOWEST <= joint.velocity <= _FASTEST
    speed = joint.velocity if fast else _GUESSED_SPEED
    sources = [
        "torque from the URDF's effort"
        if given
        else f"torque guessed, {_GUESSED_TORQUE:g} times the torque to stand"
        + (f" (the URDF's {joint.effort:g} N m is not plausible)" if joint.effort else ""),
        "speed from its velocity" if fast else "speed guessed",
    ]
    rotor, damping, friction = joint.dynamics or (0.0, 0.0, 0.0)
    if joint.dynamics:
        sources.append("rotor inertia and friction from the MJCF")
    if friction + damping * speed > _STUCK * torque:
        sources.append(
            f"without friction, as {friction:g} N m and {damping:g} N m s/rad are too large"
        )
        damping = friction = 0.0
    return DriveNumbers(
        torque=_short(torque),
        speed=_short(speed),
        armature=_short(rotor or armature),
        note="; ".join(sources),
        damping=_short(damping),
        friction=_short(friction),
        believed=given and fast,
    )


def propose_sole(
    urdf: Urdf, legs: Sequence[ChainLeg], stance: Stance, spheres: Sequence[float | None]
) -> tuple[SoleNumbers, str]:
    """Propose the soles' spring and damper, with feet's spheres by radius [m] (None: no sphere)."""
    radii = [radius for radius in spheres if radius is not None]
    length = float(np.median(radii)) if radii else _SOLE * sum(legs[0].lengths)
    note = "radius of the feet's spheres" if radii else "guessed from the legs' length"
    carried = urdf.total_mass / (len(legs) / 2.0)
    stiffness = carried * GRAVITY / (_SINKS * stance.height)
    damping = 1.4 * math.sqrt(stiffness * carried)
    return SoleNumbers(_short(length), _short(stiffness), _short(damping)), note


def _short(value: float) -> float:
    """Round to three digits: a guess is no more precise."""
    return float(f"{value:.3g}")


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
    listed, torque = _listed_in(drives), kind == "torque"
    step = 65536 // min((actuator.encoder_counts for actuator in listed.values()), default=65536)
    voltage = min((actuator.voltage for actuator in listed.values()), default=_VOLTAGE)
    largest = max(d.torque * d.speed for of_leg in drives for d in of_leg) / voltage
    if listed:
        actuators = [line for name in listed for line in _listed_tables(name, listed[name])]
    else:
        actuators = _torque_actuators(drives) if torque else _dc_motors(drives)
    return [
        *actuators,
        "",
        f"[supply]                            # {'of the actuators' if listed else 'guessed'}",
        f"voltage = {voltage}                 # V, open circuit",
        "resistance = 0.01                   # ohm",
        *(_TORQUE_COMMAND if torque else _pwm(voltage)),
        "",
        f"[sensors]                           # {65536 // step} steps per turn, 12 bits of current",
        "angle_counts = 10430.0              # per rad",
        f"angle_step = {step}",
        f"current_counts = {_LARGEST_CODE / largest:.6g}    # an A",
        "current_step = 16",
    ]


def proposed_control(
    kind: ActuatorKind,
    drives: Sequence[Sequence[DriveNumbers]],
    scenarios: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """Return a job's scenarios and controller, and bounds of variables that follow from both."""
    listed = _listed_in(drives)
    if kind == "dc" and listed:
        return _servo_control(listed, scenarios)
    if kind == "dc":
        return {"controller": "pid", "scenarios": scenarios}
    limit = float(np.median([drive.torque for of_leg in drives for drive in of_leg]))

    def variable(name: str, unit: str, bounds: tuple[float, float]) -> dict[str, Any]:
        low, high = (float(f"{share * limit:.3g}") for share in bounds)
        return {"name": name, "low": low, "high": high, "unit": unit}

    return {
        "controller": "joint-pd",
        "scenarios": scenarios,
        "variables": [
            variable("Kp", "N m/rad", _STIFFNESS),
            variable("Kd", "N m s/rad", _DAMPING),
            "feed_forward",
        ],
    }


_FRAMES: Final = {True: 100.0, False: 50.0}
"""Rate at which a host sends angles to servos on a bus, and to hobby servos [Hz]."""


def _servo_control(
    listed: Mapping[str, ListedActuator], scenarios: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """P varies if it can be set, and the gait; the host holds its angles between frames."""
    lift = scenarios[0]["height"]
    bounds = {
        "height": (round(0.5 * lift, 4), round(1.5 * lift, 4), "m"),
        "duty_factor": (0.5, 0.7, "1"),
    }
    tunable = [actuator.bounds_p for actuator in listed.values() if actuator.bounds_p]
    if tunable:
        bounds = {"P": (*tunable[0], "register"), **bounds}
    variables = [
        {"name": name, "low": low, "high": high, "unit": unit}
        for name, (low, high, unit) in bounds.items()
    ]
    rate = min(_FRAMES[actuator.bounds_p is not None] for actuator in listed.values())
    return {
        "controller": "servo",
        "scenarios": [{**scenario, "trajectory_rate": rate, "fir_ms": 0} for scenario in scenarios],
        "variables": variables,
        **({} if tunable else {"fixed": {"P": 1.0}}),
    }


def drive_names(drives: Sequence[Sequence[DriveNumbers]]) -> dict[DriveNumbers, str]:
    kinds = dict.fromkeys(drive for of_leg in drives for drive in of_leg)
    return {drive: drive.listed or f"drive{number}" for number, drive in enumerate(kinds, start=1)}


_FRICTION: Final = ("viscous_friction", *DryFriction.model_fields)


def _listed_tables(name: str, actuator: ListedActuator) -> list[str]:
    def numbers(*fields: str) -> list[str]:
        given = actuator.model_fields_set
        return [
            f"{field} = {getattr(actuator, field)}"
            + ("    # guessed" if field in actuator.guessed else "")
            for field in fields
            if field in given
        ]

    if actuator.kind == "torque":
        return [
            "",
            f"[actuators.{name}]    # {actuator.note}",
            'kind = "torque"',
            f"gear_ratio = {actuator.gear_ratio}",
            *numbers("torque_constant", "resistance", "rotor_inertia"),
            *numbers("torque_limit", "speed_limit", "knee_speed", *_FRICTION),
        ]
    return [
        "",
        f"[motors.{name}]    # {actuator.note}; at the output shaft",
        *numbers("torque_constant", "resistance"),
        "inductance = 1e-4                   # H; guessed",
        *numbers("rotor_inertia", "viscous_friction"),
        "",
        f"[gearheads.{name}]    # its friction is dry",
        "ratio = 1.0",
        f"nominal_torque = {actuator.stall_torque:.6g}",
        f"nominal_speed = {actuator.no_load_speed:.6g}",
        "efficiency = 1.0",
        *numbers(*DryFriction.model_fields),
        "",
        f"[actuators.{name}]",
        f"motor = {quoted(name)}",
        f"gearhead = {quoted(name)}",
        *_position_loop(name, actuator),
    ]


def _position_loop(name: str, actuator: ListedActuator) -> list[str]:
    if actuator.servo is None:
        return []
    loop = actuator.servo
    guessed = "    # guessed" if "servo.position_gain" in actuator.guessed else ""
    return [
        "",
        f"[actuators.{name}.servo]",
        f"position_gain = {loop.position_gain}{guessed}    # duty per rad and unit of P",
        f"duty_limit = {loop.duty_limit}",
        f"dead_band = {loop.dead_band}    # rad",
        f"default_p = {loop.default_p}    # of the register P",
        *([] if loop.tunable else ["tunable = false"]),
    ]


def _dc_motors(drives: Sequence[Sequence[DriveNumbers]]) -> list[str]:
    lines = [
        "",
        "# Each drive is a DC motor whose torque falls from standstill to its no-load speed at",
        f"# {_VOLTAGE:g} V; rotor inertia is 2 % of a leg's share of the mass at the leg's length,",
        "# unless a note says otherwise.",
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
            f"viscous_friction = {drive.damping / _RATIO**2:.6g}    # N m s/rad",
            "",
            f"[gearheads.{name}]",
            f"ratio = {_RATIO}",
            f"nominal_torque = {drive.torque:.6g}    # N m",
            f"nominal_speed = {drive.speed * _RATIO:.6g}    # rad/s, motor side",
            f"efficiency = {_EFFICIENCY}          # guessed",
            *_friction("coulomb_friction", drive.friction),
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
        "# 2 % of a leg's share of the mass at the leg's length, unless a note says otherwise.",
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
            *_friction("viscous_friction", drive.damping),
            *_friction("coulomb_friction", drive.friction),
        ]
    return lines


def _friction(name: str, value: float) -> list[str]:
    return [f"{name} = {value:.6g}"] if value else []


_TORQUE_COMMAND: Final = (
    "",
    "[torque_command]",
    "rate = 1000                         # Hz, of the joint PD in the actuators; guessed",
)


def _pwm(voltage: float) -> list[str]:
    return [
        f"nominal_voltage = {voltage}         # V",
        "",
        "[pwm]                               # 10 bits and a sign",
        "counts = 1023",
        f"full_scale = {voltage}              # V",
        "step = 1",
    ]


def quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
