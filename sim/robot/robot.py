"""Robots ready for simulation: description, leg geometry, and values by joint and foot."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Final

import numpy as np
from pydantic import ValidationError

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import RobotFileError, SimulationInputError
from gaitswarm.sim.input import description_of, message_of, with_known_keys
from gaitswarm.sim.robot.bounds import check_toml, shortened
from gaitswarm.sim.robot.description import (
    DIRECTIONAL_FRICTION,
    JOINTS_PER_LEG,
    Actuator,
    Contact,
    DryFriction,
    Leg,
    RobotDescription,
    TorqueActuator,
)
from gaitswarm.sim.robot.legs import (
    ChainLeg,
    KneeUpLeg,
    LegKinematics,
    chain_of,
    check_joints,
    check_owners,
)
from gaitswarm.sim.robot.urdf import MOST_TURNED, BodyInertia, Urdf, by_line, numbered, parse_urdf

_TABLE: Final = re.compile(r"(\[\[?)([^\[\]]++)\]\]?(?:\s*+#.*)?")
_KEY: Final = re.compile(r"([^=#\[\]\s][^=]*+)=")
"""Matches a line without surrounding blanks in linear time (possessive quantifiers)."""

_FIELD: Final = re.compile(r"`(\w+)`")
"""Field of a leg in a message."""


def first_problem(error: ValidationError, text: str) -> str:
    first = with_known_keys(error.errors(), RobotDescription)[0]
    location = _without_kind(first["loc"])
    where = shortened(".".join(str(part) for part in location))
    line = line_of(text, [part for part in location if not _is_class(part)])
    message = message_of(first)
    meaning = description_of(RobotDescription, first["loc"])
    return (
        "robot.toml"
        + (f", line {line}" if line else "")
        + (f": {where}" if where else "")
        + f": {message}"
        + (f" ({meaning})" if meaning else "")
    )


def _line_of_part(text: str, legs: Sequence[Leg], message: str) -> int | None:
    """Find the line of the leg, or of the held joints, that a message is about."""
    for k, leg in enumerate(legs):
        if message.startswith(f"robot.toml: leg {leg.name!r}: "):
            return line_of(text, ["legs", k, *_FIELD.findall(message)[-1:]])
    if message.startswith("robot.toml: held_joints"):
        return line_of(text, ["held_joints"])
    return None


def line_of(text: str, path: Sequence[str | int]) -> int | None:
    """Return the line of a field in a TOML file; an inline table counts as one line."""
    found, depth = None, 0
    table: list[str | int] = []
    counts: dict[str, int] = {}
    for number, line in enumerate(map(str.strip, text.splitlines()), start=1):
        if match := _TABLE.fullmatch(line):
            name = match[2].strip()
            table = list(_split(name))
            if match[1] == "[[":
                index = counts.get(name, -1) + 1
                counts[name] = index
                table.append(index)
            here = table
        elif match := _KEY.match(line):
            here = [*table, *_split(match[1])]
        else:
            continue
        if len(here) > depth and list(path[: len(here)]) == here:
            found, depth = number, len(here)
    return found


def _split(key: str) -> list[str]:
    return [part.strip().strip("\"'") for part in re.findall(r'"[^"]*"|\'[^\']*\'|[^.]+', key)]


def _without_kind(location: tuple[str | int, ...]) -> tuple[str | int, ...]:
    """Remove the kind that pydantic adds after an actuator's name."""
    if len(location) > 2 and location[0] == "actuators":
        return (*location[:2], *location[3:])
    return location


def _is_class(part: str | int) -> bool:
    """Recognize members of unions, which pydantic adds to locations."""
    return isinstance(part, str) and part[:1].isupper() and part.isidentifier()


_DEGREES: Final = "; it seems to be in degrees: 45 degrees are 0.7854 rad"


@dataclass(frozen=True, slots=True, eq=False)
class JointActuators:
    """Motors and gears in joint order, referred to joints; read-only arrays (J,), 0 if absent."""

    torque: Floats  # r K_M [N m/A], also the back-EMF [V s/rad]
    resistance: Floats  # [ohm]
    inductance: Floats  # [H]
    armature: Floats  # J_M r^2 [kg m2]
    motor_friction: Floats  # B_M r^2 [N m s/rad]
    gear_friction: Floats  # B_G at eta = 0 [N m s/rad], to be multiplied by 1 - eta
    efficiency: Floats  # eta [1]
    coulomb_friction: Floats  # part of the dry friction's limit, constant [N m]
    stribeck_friction: Floats  # part at rest [N m]
    stribeck_speed: Floats  # at which the latter is halved [rad/s]
    load_friction: Floats  # part per torque on both sides of the gear [1]
    stribeck_exponent: Floats  # of an exponential decay of the part at rest; 0 for none [1]
    motor_load_friction: Floats  # further part per torque of the motor [1]
    link_load_friction: Floats  # further part per torque passed to the link [1]
    stribeck_motor_load: Floats  # the same at rest [1]
    stribeck_link_load: Floats  # [1]
    motor_load_square: Floats  # part per square of the motor's torque at rest [1/(N m)]
    link_load_square: Floats  # part per square of the link's torque at rest [1/(N m)]
    backlash: Floats  # play, end to end [rad]
    shaft_stiffness: Floats  # of the closed play [N m/rad]
    shaft_damping: Floats  # of the closed play [N m s/rad]
    torque_limit: Floats  # of torque-controlled actuators [N m]
    stall_torque: Floats  # of the line by which speed limits their torque, at rest [N m]
    stall_torque_per_volt: Floats  # the same where the battery's voltage makes that line [N m/V]
    torque_drop: Floats  # by which that line falls with the rate [N m s/rad]

    @property
    def viscous(self) -> Floats:
        """Viscous friction at the joint: eq. 2.8 and the gearhead's, (J,) [N m s/rad]."""
        return self.motor_friction + (1.0 - self.efficiency) * self.gear_friction


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot description with its URDF; immutable, hence shared between threads.

    Attributes:
        description: its robot.toml.
        urdf: its robot.urdf.
        legs: geometry of the description's legs, in its order.
            ships: whether its kinematic tree ships with gaitswarm; others are untrusted.
    """

    description: RobotDescription
    urdf: Urdf
    legs: tuple[LegKinematics, ...]
    ships: bool = False

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints in the order of all joint arrays: leg by leg; coxa, femur, tibia."""
        return tuple(name for leg in self.description.legs for name in leg.joints)

    @property
    def n_joints(self) -> int:
        return JOINTS_PER_LEG * len(self.legs)

    @cached_property
    def has_backlash(self) -> bool:
        """Whether motors and links can move apart: with backlash or elastic shafts."""
        return self.description.elastic_shafts or any(
            self.description.actuators[name].backlash > 0.0
            for leg in self.description.legs
            for name in leg.actuators
        )

    @property
    def is_torque_controlled(self) -> bool:
        """Whether controllers command joint torques instead of motor voltages."""
        return self.description.actuator_kind == "torque"

    @cached_property
    def servos(self) -> Floats | None:
        """Position control in servos, read-only (4, J); None without servos.

        Duty per error and unit of a tunable P [1/count], duty per error with another P [1/count],
        dead band [counts] and largest duty [1].
        """
        servos, counts = self.description.servos, self.description.sensors.angle_counts
        if not servos:
            return None
        rows = [
            (
                servo.position_gain / counts * servo.tunable,
                servo.position_gain * servo.default_p / counts * (not servo.tunable),
                servo.dead_band * counts,
                servo.duty_limit,
            )
            for servo in servos
        ]
        columns = np.array(rows).T.copy()
        columns.flags.writeable = False
        return columns

    @property
    def no_load_speeds(self) -> Floats:
        """Speeds at which motors at full duty only overcome viscous friction, (J,) [rad/s]."""
        a, voltage = self.actuators(), self.description.supply.voltage
        if self.is_torque_controlled:
            torque = a.stall_torque + a.stall_torque_per_volt * voltage
            return torque / (a.torque_drop + a.viscous)
        largest = 1.0 if self.servos is None else self.servos[3]
        resisting = a.torque**2 + a.resistance * a.viscous
        return largest * voltage * a.torque / resisting

    @property
    def has_inner_loop(self) -> bool:
        """Whether actuators have their own control between control ticks."""
        return self.is_torque_controlled or self.servos is not None

    @cached_property
    def has_dry_friction(self) -> bool:
        fields = (name for name in DryFriction.model_fields if name != "stribeck_speed")
        return any(getattr(self.actuators(), name).any() for name in fields)

    @cached_property
    def has_directional_friction(self) -> bool:
        """Whether dry friction distinguishes motor and link, or decays exponentially."""
        return any(getattr(self.actuators(), name).any() for name in DIRECTIONAL_FRICTION)

    @property
    def body(self) -> BodyInertia:
        """Inertia of the unloaded body; `body_mass` scales it."""
        mass, own = self.description.body_mass, self.urdf.body
        if mass is None:
            return own
        if own.mass == 0.0:
            raise RobotFileError("robot.urdf: the body needs a mass, which body_mass then scales")
        return BodyInertia(mass, own.centre, own.rotational * (mass / own.mass))

    @property
    def mass(self) -> float:
        return self.urdf.total_mass - self.urdf.body.mass + self.body.mass

    def contacts(self) -> tuple[Contact, ...]:
        return tuple(leg.contact or self.description.contact for leg in self.description.legs)

    def planned_soles(self) -> tuple[float, ...]:
        if self.description.planned_soles == "own":
            return tuple(contact.sole for contact in self.contacts())
        return (self.description.contact.sole,) * len(self.legs)

    def actuators(self) -> JointActuators:
        return self._actuators

    @cached_property
    def _actuators(self) -> JointActuators:
        """Cached: each simulation needs it several times."""
        d = self.description
        rows = []
        for leg in d.legs:
            for name in leg.actuators:
                actuator = d.actuators[name]
                rows.append(
                    _torque_row(actuator)
                    if isinstance(actuator, TorqueActuator)
                    else _dc_row(d, actuator)
                )
        columns = np.array(rows).T.copy()
        columns.flags.writeable = False
        return JointActuators(*columns)


def _dc_row(d: RobotDescription, actuator: Actuator) -> tuple[float, ...]:
    motor, gear = d.motors[actuator.motor], d.gearheads[actuator.gearhead]
    ratio = gear.ratio * actuator.bevel
    return (
        ratio * motor.torque_constant,
        motor.resistance,
        motor.inductance,
        motor.rotor_inertia * ratio**2,
        motor.viscous_friction * ratio**2,
        gear.nominal_torque * gear.ratio / gear.nominal_speed * actuator.bevel**2,
        gear.efficiency,
        gear.coulomb_friction * actuator.bevel,
        gear.stribeck_friction * actuator.bevel,
        gear.stribeck_speed / actuator.bevel,
        gear.load_friction,
        *_directional(gear, actuator.bevel),
        actuator.backlash,
        actuator.shaft_stiffness,
        actuator.shaft_damping,
        *(0.0,) * 4,
    )


def _directional(friction: DryFriction, bevel: float = 1.0) -> Iterator[float]:
    for name in DIRECTIONAL_FRICTION:
        yield getattr(friction, name) / (bevel if name.endswith("_square") else 1.0)


def _torque_row(actuator: TorqueActuator) -> tuple[float, ...]:
    """Row of `JointActuators`; friction is at the joint, so the gearhead has none."""
    return (
        actuator.gear_ratio * actuator.torque_constant,
        actuator.resistance,
        0.0,
        actuator.rotor_inertia * actuator.gear_ratio**2,
        actuator.viscous_friction,
        0.0,
        1.0,
        actuator.coulomb_friction,
        actuator.stribeck_friction,
        actuator.stribeck_speed,
        actuator.load_friction,
        *_directional(actuator),
        actuator.backlash,
        actuator.shaft_stiffness,
        actuator.shaft_damping,
        actuator.torque_limit,
        actuator.stall_torque,
        actuator.stall_torque_per_volt,
        actuator.torque_drop,
    )


def with_shafts(robot: Robot) -> Robot:
    """Return the robot with elastic shafts between motors and links, even without backlash.

    Args:
        robot: Robot to start from.
    """
    if robot.has_backlash:
        return robot
    description = robot.description.model_copy(update={"elastic_shafts": True})
    return replace(robot, description=description)


def parse_robot(toml: str, urdf: str) -> Robot:
    check_toml(toml)
    try:
        document = tomllib.loads(toml)
    except ValueError as error:  # no TOML, or an integer of thousands of digits
        raise RobotFileError(f"robot.toml: {error}") from error
    try:
        description = RobotDescription.model_validate(document)
    except ValidationError as error:
        raise RobotFileError(first_problem(error, toml)) from error
    with numbered("robot.toml", partial(_line_of_part, toml, description.legs)):
        return assembled(description, urdf)


def assembled(description: RobotDescription, urdf: str) -> Robot:
    check_owners(description.legs)
    tree = parse_urdf(urdf, description.held_joints)
    with by_line(urdf):
        legs = tuple(_kinematics(leg, tree) for leg in description.legs)
        check_joints(tree, description.legs)
    return Robot(description, tree, legs)


def _kinematics(leg: Leg, urdf: Urdf) -> LegKinematics:
    chain = chain_of(urdf, leg)
    places = chain.placements
    if leg.stance is not None:
        stance = np.array(leg.stance)
        _check_stance(leg, stance, chain.limits)
        return ChainLeg.of(leg.name, chain, chain.foot, stance)
    for name, place in zip(leg.joints, places, strict=True):
        if (place.rotation != np.eye(3)).any():
            raise RobotFileError(
                f"robot.urdf: joint {name!r}: its frame is rotated against the body's; give leg"
                f" {leg.name!r} of robot.toml a stance, the angles at which it stands"
            )
    x, y, z = places[0].offset.tolist()
    if y == 0.0:
        raise RobotFileError(
            f"robot.urdf: {leg.joints[0]}: a hip must lie left or right of y = 0; else give leg"
            f" {leg.name!r} of robot.toml a stance, the angles at which it stands"
        )
    ends = (places[1].offset, places[2].offset, chain.foot)
    coxa, femur, tibia = (math.hypot(*end.tolist()) for end in ends)
    if not (femur and tibia):
        raise RobotFileError(f"robot.urdf: leg {leg.name!r}: femur and tibia need a length")
    side = math.copysign(1.0, y)
    return KneeUpLeg(leg.name, (x, y, z), side, (coxa, femur, tibia), chain.limits)


def _check_stance(leg: Leg, stance: Floats, limits: Floats) -> None:
    for name, angle, (lower, upper) in zip(leg.joints, stance, limits, strict=True):
        if not lower <= angle <= upper:
            raise RobotFileError(
                f"robot.toml: leg {leg.name!r}: its `stance` has joint {name!r} at {angle:g} rad,"
                f" but robot.urdf limits it to {lower:g} to {upper:g} rad"
                + (_DEGREES if abs(angle) > MOST_TURNED else "")
            )


def rows_of(legs: Sequence[LegKinematics]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    of_sides: tuple[list[int], list[int]] = [], []
    for number, leg in enumerate(legs):
        of_sides[leg.side < 0.0].append(number)
    left, right = (tuple(sorted(row, key=lambda k: -legs[k].hip[0])) for row in of_sides)
    return left, right


def leg_groups(robot: Robot) -> dict[str, tuple[int, ...]]:
    rows = rows_of(robot.legs)
    first = {row[0] for row in rows if row}
    last = {row[-1] for row in rows if row} - first
    members = {
        "all": set(range(len(robot.legs))),
        "left": set(rows[0]),
        "right": set(rows[1]),
        "front": first if last else set[int](),
        "middle": {leg for row in rows for leg in row} - first - last if last else set[int](),
        "hind": last,
    }
    groups = {name: tuple(sorted(group)) for name, group in members.items() if group}
    names = [leg.name for leg in robot.legs]
    groups |= {name: (number,) for number, name in enumerate(names)}
    for name, group in robot.description.leg_groups.items():
        groups[name] = tuple(sorted(names.index(leg) for leg in group))
    return groups


def values_by_leg(robot: Robot, values: Mapping[str, float], parameter: str) -> dict[int, float]:
    groups = leg_groups(robot)
    for name in values:
        if name not in groups:
            raise SimulationInputError(
                f"{parameter}[{name}]: {robot.description.name} has no such group of legs; it has"
                f" {', '.join(groups)}"
            )
    by_leg: dict[int, tuple[int, str]] = {}
    for name in sorted(values, key=lambda name: len(groups[name])):
        group = groups[name]
        for leg in group:
            size, other = by_leg.setdefault(leg, (len(group), name))
            if size == len(group) and other != name:
                raise SimulationInputError(
                    f"{parameter}[{name}]: leg {robot.legs[leg].name!r} is also in {other!r},"
                    " of the same size; set a value for the leg, or for a smaller"
                    " group"
                )
    return {leg: values[name] for leg, (_, name) in by_leg.items()}
