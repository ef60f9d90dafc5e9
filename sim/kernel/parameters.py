"""Run-time parameters of the kernel: everything that a scenario or a calibration may vary."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.robot.bounds import ContactLaw
from gaitswarm.sim.robot.description import DIRECTIONAL_FRICTION, JOINTS_PER_LEG, DryFriction
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.urdf import parallel_axis
from gaitswarm.sim.scenario import Scenario

GRAVITY = 9.81
"""[m/s2], table 5."""

JAM_STIFFNESS: Final = 2000.0
"""Of the obstacle that holds a jammed joint [N m/rad]: a stalled coxa moves it by 0.3 degrees."""

JAM_DAMPING: Final = 10.0
"""[N m s/rad]: about half of the critical damping of a coxa's rotor on the obstacle."""

HOLDING_FREQUENCY: Final = 1000.0
"""Of a rotor alone on the spring of its gear's dry friction [rad/s]; critically damped."""

DRY_FRICTION: Final = tuple(DryFriction.model_fields)
"""Fields of the parameters of dry friction, at the joints; the last are `DIRECTIONAL_FRICTION`."""

SHOVE_DURATION: Final = 0.1
"""Duration of a shove's constant force [s]."""


@dataclass(frozen=True, slots=True)
class ContactData:
    """Kernel inputs of a contact law."""

    # read for each foot, fields of `gaitswarm.sim.robot.description.Contact`
    parameters: tuple[str, ...]
    internal_state_size: int = 0  # numbers carried for each foot from step to step


_NORMAL: Final = ("stiffness", "damping", "sole", "friction")

CONTACT_LAWS: Final[Mapping[ContactLaw, ContactData]] = {
    "linear_zone": ContactData((*_NORMAL, "slip_velocity")),
    "karnopp": ContactData((*_NORMAL, "stick_velocity")),
    "stick": ContactData((*_NORMAL, "stick_stiffness", "stick_damping"), 2),
    "dead_zone": ContactData((*_NORMAL, "slip_velocity", "stick_velocity")),
}
"""By name; the formulas are in `gaitswarm.sim.kernel.dynamics.contact`."""


def internal_state_size(robot: Robot) -> int:
    """Return the length of a walk's internal state, which it carries besides q and v.

    First angles [rad] and rates [rad/s] of motors with backlash, then torques of dry friction's
    springs and of links [N m], then the contact law's, foot by foot.
    """
    motors = 2 * robot.n_joints * (robot.has_backlash + robot.has_dry_friction)
    law = CONTACT_LAWS[robot.description.contact_law]
    return motors + law.internal_state_size * len(robot.legs)


def _has(robot: Robot, friction: str) -> bool:
    """Whether the kernel has this field of dry friction."""
    if friction in DIRECTIONAL_FRICTION:
        return robot.has_directional_friction
    return robot.has_dry_friction


class Layout:
    """Position of each parameter in the kernel's flat parameter vector.

    field (length): timestep (1), gravity (3), base_mass (1), base_moment (3), base_inertia (6: xx
    yy zz xy xz yz about the body frame's origin), viscous (J), supply_voltage (1),
    supply_resistance (1), jam_stiffness, jam_damping and jam_angle of the obstacle at every joint
    (J each), push (3: force on the body's origin along the world's axes, during a shove), backlash
    (J, with backlash) and displaced (1, with backlash: whether disturbances are angles),
    `DRY_FRICTION` (J each, if the robot has any; so those of `DIRECTIONAL_FRICTION`), and by foot
    (L each) the parameters of the contact law.

    Attributes:
        by_limb: fields with values for each limb, and the number of these.
        size: P, length of the vector.
    """

    def __init__(self, robot: Robot) -> None:
        n_joints, n_feet = robot.n_joints, len(robot.legs)
        law = CONTACT_LAWS[robot.description.contact_law]
        lengths = {
            "timestep": 1,
            "gravity": 3,
            "base_mass": 1,
            "base_moment": 3,
            "base_inertia": 6,
            "viscous": n_joints,
            "supply_voltage": 1,
            "supply_resistance": 1,
            "jam_stiffness": n_joints,
            "jam_damping": n_joints,
            "jam_angle": n_joints,
            "push": 3,
            "backlash": n_joints if robot.has_backlash else 0,
            "displaced": 1 if robot.has_backlash else 0,
            **{name: n_joints * _has(robot, name) for name in DRY_FRICTION},
            **dict.fromkeys(law.parameters, n_feet),
        }
        limb, whole = {n_joints: JOINTS_PER_LEG, n_feet: 1}, ("base_", "supply_")
        self.by_limb: Mapping[str, int] = {
            name: limb.get(length, 0)
            for name, length in lengths.items()
            if name not in ("timestep", "gravity", "push", "displaced")
            and not name.startswith(whole)
        }
        self.slices: dict[str, slice] = {}
        start = 0
        for name, length in lengths.items():
            self.slices[name] = slice(start, start + length)
            start += length
        self.size = start

    @staticmethod
    @lru_cache(maxsize=32)
    def of(robot: Robot) -> Layout:
        """Return a robot's layout, cached: each simulation needs it several times."""
        return Layout(robot)

    def fields(self, packed: Floats) -> dict[str, Floats]:
        """Split a vector (P,) by field."""
        return {name: packed[where] for name, where in self.slices.items()}

    def pack(self, **values: float | Floats) -> Floats:
        """Return the vector (P,)."""
        if values.keys() != self.slices.keys():
            raise KeyError(sorted(values.keys() ^ self.slices.keys()))
        packed = np.empty(self.size)
        for name, where in self.slices.items():
            packed[where] = values[name]
        return packed


def gravity_on(slope: float, direction: float = 0.0) -> Floats:
    """Gravity (3,) [m/s2] for ground that rises by a slope [deg] towards a direction [deg]."""
    angle, towards = math.radians(slope), math.radians(direction)
    along = -GRAVITY * math.sin(angle)
    return np.array(
        [along * math.cos(towards), along * math.sin(towards), -GRAVITY * math.cos(angle)]
    )


def pack_parameters(
    robot: Robot,
    scenario: Scenario,
    timestep: float,
    *,
    start: Floats | None = None,
    displaced: bool = False,
) -> Floats:
    """Return the kernel's parameters for one robot in one scenario.

    A jammed leg is held at its angles in `start` (J,) [rad]. `displaced`: disturbances are angles.
    """
    if displaced and not robot.has_backlash:
        raise SimulationInputError(
            "noise: an angle between gearhead and link needs a robot with elastic_shafts"
        )
    stuck = np.array([leg.name == scenario.stuck_leg for leg in robot.legs], dtype=np.float64)
    # Counted from x to y.
    towards = math.radians(scenario.shove_direction)
    shove = np.array([math.cos(towards), math.sin(towards), 0.0])
    jammed = np.repeat(stuck, JOINTS_PER_LEG)
    angles = np.zeros(robot.n_joints) if start is None else start
    d, body = robot.description, robot.body
    actuators, contacts = robot.actuators(), robot.contacts()
    at = np.array([0.0, 0.0, d.load_height])
    inertia = (
        body.rotational + body.mass * parallel_axis(body.centre) + scenario.load * parallel_axis(at)
    )
    by_foot = {
        name: np.array([getattr(contact, name) for contact in contacts])
        for name in CONTACT_LAWS[d.contact_law].parameters
    }
    return Layout.of(robot).pack(
        timestep=timestep,
        gravity=gravity_on(scenario.slope, scenario.slope_direction),
        base_mass=body.mass + scenario.load,
        base_moment=body.mass * body.centre + scenario.load * at,
        base_inertia=inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
        viscous=actuators.viscous,
        supply_voltage=d.supply.voltage,
        supply_resistance=d.supply.resistance,
        jam_stiffness=JAM_STIFFNESS * jammed,
        jam_damping=JAM_DAMPING * jammed,
        jam_angle=angles * jammed,
        push=scenario.shove / SHOVE_DURATION * shove,
        backlash=actuators.backlash if robot.has_backlash else np.empty(0),
        displaced=float(displaced) if robot.has_backlash else np.empty(0),
        **{
            name: getattr(actuators, name) if _has(robot, name) else np.empty(0)
            for name in DRY_FRICTION
        },
        **by_foot,
    )
