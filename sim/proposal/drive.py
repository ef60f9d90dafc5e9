"""Proposed actuators and soles for a robot known only by its URDF."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np

from gaitswarm.sim.proposal.stance import Stance
from gaitswarm.sim.robot.actuators import ActuatorKind
from gaitswarm.sim.robot.joints import Joint
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.urdf import Urdf

GRAVITY: Final = 9.81
"""[m/s2]"""

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
    believed: bool = False  # whether torque and speed are the URDF's


@dataclass(frozen=True, slots=True)
class SoleNumbers:
    """Contact of soles with the ground."""

    length: float  # of the sole's spring beyond the leg's end [m]
    stiffness: float  # [N/m]
    damping: float  # [N s/m]


def propose_drives(
    urdf: Urdf, names: Sequence[Sequence[str]], legs: Sequence[ChainLeg], stance: Stance
) -> list[list[DriveNumbers]]:
    """Propose a drive for every joint, by leg.

    Torque and speed are the URDF's limits (`effort`, `velocity`) if they are plausible: many files
    say 1000 N m for "unknown". Else they are multiples of what standing on half the legs takes.
    """
    joints = {joint.name: joint for joint in urdf.joints}
    force = urdf.total_mass * GRAVITY / (len(legs) / 2.0)
    needs = []
    for leg, angles in zip(legs, stance.angles, strict=True):
        _, slopes = leg.feet(np.array([angles]))
        needs.append(np.abs(slopes[0, 2, :]) * force)
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


def chosen_kind(choice: ActuatorChoice, drives: Sequence[Sequence[DriveNumbers]]) -> ActuatorKind:
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
    numbers = _short(torque), _short(speed), _short(armature)
    return DriveNumbers(*numbers, "; ".join(sources), believed=given and fast)


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
