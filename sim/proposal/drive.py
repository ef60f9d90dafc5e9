"""Actuators and soles for a robot of which nothing but its URDF is known."""

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
"""Torques of a file that are believed, in units of what standing on half the legs takes."""

_GUESSED_TORQUE: Final = 5.0
"""Stall torque where the file's is not believed, in the same units."""

_SLOWEST, _FASTEST = 2.0, 100.0
"""Rates of a file that are believed [rad/s]."""

_GUESSED_SPEED: Final = 20.0
"""No-load rate where the file's is not believed [rad/s]."""

_ARMATURE: Final = 0.02
"""Rotor inertia at a joint, as a share of a leg's part of the mass at the leg's length."""

_SINKS: Final = 0.01
"""How far soles yield when half the legs carry the robot, as a share of its height."""

_SOLE: Final = 0.05
"""Sole where no sphere says it, as a share of the leg's length."""


_DIRECT: Final = 12.0
"""Rate of the slowest joint from which on drives are taken as quasi-direct: a gear of a hundred or
more leaves less of a small motor's [rad/s]."""

ActuatorChoice = Literal["auto", "dc", "torque"]
"""Kind of actuators to be proposed: that which the URDF's limits speak for, or a given one."""

ACTUATOR_CHOICES: Final[tuple[ActuatorChoice, ...]] = get_args(ActuatorChoice)


@dataclass(frozen=True, slots=True)
class DriveNumbers:
    """What drives a joint, by what it does there."""

    torque: float  # at standstill, of a DC motor at full voltage [N m]
    speed: float  # without load, of a DC motor at full voltage [rad/s]
    armature: float  # inertia of the rotor, seen at the joint [kg m2]
    note: str  # where the numbers come from
    believed: bool = False  # whether torque and speed are the URDF's


@dataclass(frozen=True, slots=True)
class SoleNumbers:
    """Soles on ground."""

    length: float  # of the sole's spring beyond the leg's end [m]
    stiffness: float  # [N/m]
    damping: float  # [N s/m]


def propose_drives(
    urdf: Urdf, names: Sequence[Sequence[str]], legs: Sequence[ChainLeg], stance: Stance
) -> list[list[DriveNumbers]]:
    """Propose a drive for every joint, by leg.

    Torque and rate are the limits that the URDF gives (`effort`, `velocity`), where these could be
    meant: a torque of 1000 N m stands in many files for "unknown". Else they are a multiple of what
    the joint needs to stand on half the legs.
    """
    joints = {joint.name: joint for joint in urdf.joints}
    force = urdf.total_mass * GRAVITY / (len(legs) / 2.0)
    needs = []
    for leg, angles in zip(legs, stance.angles, strict=True):
        _, slopes = leg.feet(np.array([angles]))
        needs.append(np.abs(slopes[0, 2, :]) * force)
    # Of a leg in motion any joint may need what the worst one needs at rest.
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
    """The kind of actuators to propose."""
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
        "torque of the URDF's effort"
        if given
        else f"torque guessed, {_GUESSED_TORQUE:g} times what standing takes"
        + (f" (the URDF's {joint.effort:g} N m is not plausible)" if joint.effort else ""),
        "speed of its velocity" if fast else "speed guessed",
    ]
    numbers = _short(torque), _short(speed), _short(armature)
    return DriveNumbers(*numbers, "; ".join(sources), believed=given and fast)


def propose_sole(
    urdf: Urdf, legs: Sequence[ChainLeg], stance: Stance, spheres: Sequence[float | None]
) -> tuple[SoleNumbers, str]:
    """Propose the soles' spring and damper.

    Args:
        spheres: Radius of each foot's sphere [m], None for none.
    """
    known = [radius for radius in spheres if radius is not None]
    length = float(np.median(known)) if known else _SOLE * sum(legs[0].lengths)
    note = "radius of the feet's spheres" if known else "guessed from the legs' length"
    carried = urdf.total_mass / (len(legs) / 2.0)
    stiffness = carried * GRAVITY / (_SINKS * stance.height)
    damping = 1.4 * math.sqrt(stiffness * carried)
    return SoleNumbers(_short(length), _short(stiffness), _short(damping)), note


def _short(value: float) -> float:
    """Three digits: more would claim a precision that a guess has not."""
    return float(f"{value:.3g}")
