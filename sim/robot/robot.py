"""A robot ready to be simulated: description, leg geometry, and numbers by joint and by foot."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ValidationError

from sim.errors import RobotFileError, SimulationInputError
from sim.former_names import as_written
from sim.robot.description import (
    JOINTS_PER_LEG,
    Actuator,
    Contact,
    Gearhead,
    Leg,
    Motor,
    Pwm,
    RobotDescription,
    Sensors,
    Supply,
)
from sim.robot.toml_lines import line_of

SHIPPED: Final = ("szabadka2",)

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LegGeometry:
    """What inverse kinematics needs of a leg.

    hip: coxa axis in the body frame (3,) [m]; side: +1 left, -1 right;
    coxa, femur, tibia: link lengths [m].
    """

    name: str
    hip: tuple[float, float, float]
    side: float
    coxa: float
    femur: float
    tibia: float


@dataclass(frozen=True, slots=True, eq=False)
class JointActuators:
    """Motors and gears by joint, in joint order, referred to the joint; arrays (J,).

    torque: r K_M [N m/A], also the back-EMF [V s/rad]; resistance [ohm]; inductance [H];
    armature: J_M r^2 [kg m2]; motor_friction: B_M r^2, gear_friction: B_G at eta = 0
    [N m s/rad], to be multiplied by 1 - eta; efficiency: eta [1]; backlash: play, end to end
    [rad]; shaft_stiffness [N m/rad] and shaft_damping [N m s/rad] of the closed play.
    """

    torque: Floats
    resistance: Floats
    inductance: Floats
    armature: Floats
    motor_friction: Floats
    gear_friction: Floats
    efficiency: Floats
    backlash: Floats
    shaft_stiffness: Floats
    shaft_damping: Floats

    @property
    def viscous(self) -> Floats:
        """(J,) viscous friction at the joint [N m s/rad], eq. 2.8 and the gearhead's."""
        return self.motor_friction + (1.0 - self.efficiency) * self.gear_friction


@dataclass(frozen=True, slots=True, eq=False)
class Robot:
    """A robot description with its URDF; immutable, hence shared between threads."""

    description: RobotDescription
    urdf: str
    legs: tuple[LegGeometry, ...]

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints in the order of every joint array: leg by leg, coxa, femur, tibia."""
        return tuple(name for leg in self.description.legs for name in leg.joints)

    @property
    def n_joints(self) -> int:
        """J."""
        return JOINTS_PER_LEG * len(self.legs)

    @property
    def has_backlash(self) -> bool:
        """Motors and links move apart: any joint has play."""
        return any(
            self.description.actuators[name].backlash > 0.0
            for leg in self.description.legs
            for name in leg.actuators
        )

    def contacts(self) -> tuple[Contact, ...]:
        """Each foot's contact parameters, its own or the robot's."""
        return tuple(leg.contact or self.description.contact for leg in self.description.legs)

    def actuators(self) -> JointActuators:
        """Motor and gear numbers by joint."""
        d = self.description
        rows = []
        for leg in d.legs:
            for name in leg.actuators:
                actuator = d.actuators[name]
                motor, gear = d.motors[actuator.motor], d.gearheads[actuator.gearhead]
                ratio = gear.ratio * actuator.bevel
                rows.append(
                    (
                        ratio * motor.torque_constant,
                        motor.resistance,
                        motor.inductance,
                        motor.rotor_inertia * ratio**2,
                        motor.viscous_friction * ratio**2,
                        gear.nominal_torque * gear.ratio / gear.nominal_speed * actuator.bevel**2,
                        gear.efficiency,
                        actuator.backlash,
                        actuator.shaft_stiffness,
                        actuator.shaft_damping,
                    )
                )
        return JointActuators(*np.array(rows).T.copy())


@lru_cache(maxsize=8)
def shipped_robot(name: str) -> Robot:
    """A robot that ships with gaitswarm. Raises SimulationInputError for an unknown name."""
    if name not in SHIPPED:
        raise SimulationInputError(f"robot: unknown {name!r}; known are {', '.join(SHIPPED)}")
    folder = resources.files("sim.robot") / name
    return parse_robot(
        (folder / "robot.toml").read_text(encoding="utf-8"),
        (folder / "robot.urdf").read_text(encoding="utf-8"),
    )


def parse_robot(toml: str, urdf: str) -> Robot:
    """A robot from the text of its two files. Raises RobotFileError that names the field."""
    try:
        document = tomllib.loads(toml)
    except tomllib.TOMLDecodeError as error:
        raise RobotFileError(f"robot.toml: {error}") from error
    try:
        description = RobotDescription.model_validate(document)
    except ValidationError as error:
        raise RobotFileError(_describe(error, toml, document)) from error
    joints = _joint_origins(urdf)
    return Robot(
        description,
        urdf,
        tuple(_geometry(leg.name, joints) for leg in description.legs),
    )


def _describe(error: ValidationError, toml: str, document: dict[str, Any]) -> str:
    """What is wrong first, with field, line, and what the field means in which unit."""
    first = error.errors()[0]
    location = as_written(document, first["loc"])
    where = ".".join(str(part) for part in location)
    line = line_of(toml, [part for part in location if not _is_class(part)])
    message = first["msg"].removeprefix("Value error, ")
    meaning = _meaning(str(first["loc"][-1])) if first["loc"] else None
    return (
        "robot.toml"
        + (f", line {line}" if line else "")
        + (f": {where}" if where else "")
        + f": {message}"
        + (f" ({meaning})" if meaning else "")
    )


def _is_class(part: str | int) -> bool:
    """Pydantic names the members of unions among the keys."""
    return isinstance(part, str) and part[:1].isupper() and part.isidentifier()


def _meaning(field: str) -> str | None:
    """Description, with unit, of a field of any part of a robot description."""
    parts: tuple[type[BaseModel], ...] = (
        RobotDescription,
        Motor,
        Gearhead,
        Actuator,
        Supply,
        Pwm,
        Sensors,
        Contact,
        Leg,
    )
    for part in parts:
        if field in part.model_fields:
            return part.model_fields[field].description
    return None


def _joint_origins(urdf: str) -> dict[str, tuple[float, float, float]]:
    """Origin of every joint in its parent's frame, by the name of the joint and of its child."""
    try:
        # Robot files are the user's own; no network input is ever parsed here.
        root = ET.fromstring(urdf)  # noqa: S314
    except ET.ParseError as error:
        raise RobotFileError(f"robot.urdf: {error}") from error
    origins: dict[str, tuple[float, float, float]] = {}
    for joint in root.findall("joint"):
        origin, child = joint.find("origin"), joint.find("child")
        text = "0 0 0" if origin is None else origin.get("xyz", "0 0 0")
        turn = "0" if origin is None else origin.get("rpy", "0")
        if joint.get("type") != "fixed" and set(turn.split()) - {"0", "0.0", "-0", "-0.0"}:
            raise RobotFileError(
                f"robot.urdf: joint {joint.get('name')!r}: rpy {turn!r} turns its frame, which the"
                " inverse kinematics does not know; let every frame be parallel to the body's"
            )
        try:
            x, y, z = (float(part) for part in text.split())
        except ValueError as error:
            raise RobotFileError(
                f"robot.urdf: joint {joint.get('name')!r}: origin {text!r} is not three numbers"
            ) from error
        origins[joint.get("name", "")] = (x, y, z)
        if child is not None:
            origins[child.get("link", "")] = (x, y, z)
    return origins


def _geometry(leg: str, origins: dict[str, tuple[float, float, float]]) -> LegGeometry:
    names = {part: f"{leg}_{part}" for part in ("coxa", "femur", "tibia", "foot")}
    for name in names.values():
        if name not in origins:
            raise RobotFileError(f"robot.urdf: leg {leg!r} has no joint or frame {name!r}")
    hip = origins[names["coxa"]]
    if hip[1] == 0.0:
        raise RobotFileError(f"robot.urdf: {names['coxa']}: a hip must lie left or right of y = 0")
    return LegGeometry(
        name=leg,
        hip=hip,
        side=math.copysign(1.0, hip[1]),
        coxa=math.hypot(*origins[names["femur"]]),
        femur=math.hypot(*origins[names["tibia"]]),
        tibia=math.hypot(*origins[names["foot"]]),
    )
