"""Robot description: legs, actuators, supply, sensors and contact, as in a robot.toml."""

from __future__ import annotations

import operator
from typing import Annotated, Any, Final, Literal

from pydantic import ConfigDict, Field, model_validator

from gaitswarm.sim.input import Lines
from gaitswarm.sim.robot.actuators import (
    CONTROL_RATE,
    FASTEST_INNER_RATE,
    LARGEST_OUTPUT,
    Actuator,
    ActuatorKind,
    AnyActuator,
    Data,
    Gearhead,
    Motor,
    PositionLoop,
    TorqueCommand,
)
from gaitswarm.sim.robot.bounds import LONGEST_LEG_NAME, MOST_LEGS, Number, PartName, Sentence

JOINTS_PER_LEG = 3
"""Coxa, femur, tibia."""

MOST_COUNTS: Final = 10**8
"""Largest number of counts per unit; codes of some units then fit into 32 bits."""


def _is_default_rate(rate: int) -> bool:
    return rate == 1000


def _is_none(value: Any) -> bool:
    return value is None


EnergyConvention = Literal["signed", "positive", "absolute"]
"""Electrical power of a motor that counts as spent: all of it, so that braking returns energy;
only where positive, so that braking energy is lost; or its absolute value."""


class Supply(Data):
    """One battery for all motors."""

    voltage: Number = Field(gt=0.0, description="open-circuit voltage [V]")
    resistance: Number = Field(ge=0.0, description="internal resistance [ohm]")
    nominal_voltage: Number | None = Field(
        default=None,
        gt=0.0,
        exclude_if=_is_none,
        description="supply voltage at which the PWM's full scale applies [V]; DC motors only",
    )
    energy: EnergyConvention = Field(
        default="signed",
        description="electrical power of each motor that counts as spent and loads the battery:"
        " signed (braking returns energy), positive (braking energy is lost) or absolute",
    )


class Pwm(Data):
    """Coded control signal: integer counts, full scale at the nominal supply voltage."""

    counts: int = Field(gt=0, le=LARGEST_OUTPUT, description="full scale [counts]")
    full_scale: Number = Field(gt=0.0, description="motor voltage at full scale [V]")
    step: int = Field(default=1, ge=1, le=LARGEST_OUTPUT, description="resolution [counts]")


class Sensors(Data):
    """Coded readings (thesis table 4.4): integers, in steps of the converter's resolution."""

    angle_counts: Number = Field(
        gt=0.0, le=MOST_COUNTS, description="code of one radian [counts/rad]"
    )
    angle_step: int = Field(
        default=1, ge=1, le=MOST_COUNTS, description="encoder resolution [counts]"
    )
    current_counts: Number = Field(
        gt=0.0, le=MOST_COUNTS, description="code of one ampere [counts/A]"
    )
    current_step: int = Field(
        default=16, ge=1, le=MOST_COUNTS, description="resolution of the ADC [counts]"
    )
    current_filter: Number = Field(
        default=0.0,
        ge=0.0,
        le=1.0,
        description="time constant of the first-order low-pass of the absolute current before the"
        " ADC; 0 for none [s]",
    )


ContactLaw = Literal["linear_zone", "karnopp", "stick", "dead_zone"]
"""Friction law of soles; see `gaitswarm.sim.kernel.dynamics.contact`."""

PlannedSoles = Literal["nominal", "own"]
"""Sole lengths that a gait assumes: the robot's common one, or each leg's."""


class Contact(Data):
    """Contact of sole and ground (thesis 2.2.6): spring, damper and friction parameters."""

    stiffness: Number = Field(gt=0.0, description="k [N/m]")
    damping: Number = Field(ge=0.0, description="c [N s/m]")
    sole: Number = Field(ge=0.0, description="length of the sole's spring below the tibia [m]")
    friction: Number = Field(ge=0.0, description="mu [1]")
    slip_velocity: Number = Field(
        gt=0.0, description="linear_zone, dead_zone: v_lin, full friction from this speed [m/s]"
    )
    stick_velocity: Number = Field(
        default=0.005, gt=0.0, description="karnopp, dead_zone: v_d, no friction below [m/s]"
    )
    stick_stiffness: Number = Field(
        default=10000.0, gt=0.0, description="stick: stiffness of the sole along the ground [N/m]"
    )
    stick_damping: Number = Field(
        default=100.0, ge=0.0, description="stick: damping of the sole along the ground [N s/m]"
    )


GroupName = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _.-]{0,59}$")]
"""Name of a group of legs, as in names of variables."""


class Leg(Data):
    """One leg: three joints of the URDF from the body outwards, and the frame of its foot."""

    model_config = ConfigDict(validate_by_name=True, validate_by_alias=True, defer_build=True)

    name: Annotated[PartName, Field(max_length=LONGEST_LEG_NAME)]
    phase: Number = Field(ge=0.0, lt=1.0, description="start of support, share of the cycle [1]")
    actuators: tuple[PartName, PartName, PartName] = Field(
        description="actuators of coxa, femur, tibia"
    )
    own_joints: tuple[PartName, PartName, PartName] | None = Field(
        default=None,
        alias="joints",
        exclude_if=_is_none,
        description="joints, from the body outwards; default `<name>_coxa`, `_femur` and `_tibia`",
    )
    own_foot: PartName | None = Field(
        default=None,
        alias="foot",
        exclude_if=_is_none,
        description="link or fixed joint at the leg's end; default `<name>_foot`",
    )
    stance: tuple[Number, Number, Number] | None = Field(
        default=None,
        exclude_if=_is_none,
        description="joint angles of the leg's stance, for which its gait is planned [rad]; default"
        " for legs with all frames parallel to the body's: knee up",
    )
    contact: Contact | None = Field(default=None, description="contact parameters of this foot")

    @property
    def joints(self) -> tuple[str, str, str]:
        return self.own_joints or (f"{self.name}_coxa", f"{self.name}_femur", f"{self.name}_tibia")

    @property
    def foot(self) -> str:
        return self.own_foot or f"{self.name}_foot"


_DEFAULT_COMMAND: Final = TorqueCommand()


def _refuse(wrong: bool, field: str, why: str) -> None:
    if wrong:
        raise ValueError(f"{field}: {why}")


class RobotDescription(Data):
    """Everything about a robot that its URDF does not contain."""

    name: PartName
    description: Lines = Field(default="", max_length=2000)
    load_height: Number = Field(description="height of a load above the body's centre [m]")
    contact_law: ContactLaw = Field(default="linear_zone", description="friction law of all feet")
    planned_soles: PlannedSoles = Field(
        default="nominal",
        description="sole lengths that the gait assumes: nominal, the common contact's, since a"
        " controller does not know the true ones; or own, each leg's",
    )
    body_mass: Number | None = Field(
        default=None,
        gt=0.0,
        description="mass that replaces the body's in the URDF and scales its inertia [kg]",
    )
    elastic_shafts: bool = Field(
        default=False,
        description="model elastic shafts between motors and links, even without backlash",
    )
    servo_rate: int = Field(
        default=1000,
        ge=CONTROL_RATE,
        le=FASTEST_INNER_RATE,
        multiple_of=CONTROL_RATE,
        exclude_if=_is_default_rate,
        description="frequency of the servos' position control [Hz]; for servos only",
    )
    motors: dict[PartName, Motor] = Field(default={}, description="of DC actuators, by name")
    gearheads: dict[PartName, Gearhead] = Field(default={}, description="likewise")
    actuators: dict[PartName, AnyActuator]
    supply: Supply
    pwm: Pwm | None = Field(
        default=None, exclude_if=_is_none, description="required for DC motors, and only for them"
    )
    torque_command: TorqueCommand | None = Field(
        default=None,
        exclude_if=_is_none,
        description="only for torque-controlled actuators; default: the defaults of its fields",
    )
    sensors: Sensors
    contact: Contact
    legs: tuple[Leg, ...] = Field(min_length=2, max_length=MOST_LEGS)
    leg_groups: dict[GroupName, tuple[PartName, ...]] = Field(
        default={},
        max_length=MOST_LEGS,
        exclude_if=operator.not_,
        description="groups of legs for gait parameters, by the names of their legs, besides front,"
        " middle, hind, left, right, all and each leg",
    )
    guesses: tuple[Sentence, ...] = Field(
        default=(),
        exclude_if=operator.not_,
        description="guesses of `robot init`, shown by `robot check`; remove verified ones",
    )
    held_joints: dict[PartName, Number] = Field(
        default={},
        exclude_if=operator.not_,
        description="movable joints that belong to no leg, each with the angle at which it is fixed"
        " [rad]",
    )

    @model_validator(mode="after")
    def _names_exist(self) -> RobotDescription:
        for name, actuator in self.actuators.items():
            if not isinstance(actuator, Actuator):
                continue
            if actuator.motor not in self.motors:
                raise ValueError(
                    f"actuators.{name}.motor: no motor {actuator.motor!r} is described"
                )
            if actuator.gearhead not in self.gearheads:
                raise ValueError(f"actuators.{name}.gearhead: no gearhead {actuator.gearhead!r}")
        names = [leg.name for leg in self.legs]
        for k, leg in enumerate(self.legs):
            if leg.name in names[:k]:
                raise ValueError(f"legs.{k}.name: {leg.name!r} is the name of another leg")
            for actuator_name in leg.actuators:
                if actuator_name not in self.actuators:
                    raise ValueError(
                        f"legs.{k}.actuators: no actuator {actuator_name!r} is described"
                    )
        return self

    @model_validator(mode="after")
    def _groups_are_of_legs(self) -> RobotDescription:
        names = {leg.name for leg in self.legs}
        for group, members in self.leg_groups.items():
            unknown = [member for member in members if member not in names]
            if unknown:
                raise ValueError(f"leg_groups.{group}: no leg {unknown[0]!r} is described")
            if not members or len(set(members)) < len(members):
                raise ValueError(f"leg_groups.{group}: name at least one leg, and each leg once")
        return self

    @model_validator(mode="after")
    def _is_commanded_as_its_actuators_are(self) -> RobotDescription:
        kinds = {self.actuators[name].kind: name for leg in self.legs for name in leg.actuators}
        if len(kinds) > 1:
            raise ValueError(
                f"actuators: {kinds['dc']!r} is of kind dc and {kinds['torque']!r} of kind"
                " torque; all legs must have actuators of one kind"
            )
        if self.actuator_kind == "torque":
            _refuse(self.pwm is not None, "pwm", "applies to DC motors only; use torque_command")
            _refuse(
                self.supply.nominal_voltage is not None,
                "supply.nominal_voltage",
                "applies to the PWM of DC motors only; remove it",
            )
        else:
            _refuse(self.pwm is None, "pwm", "required for DC motors")
            _refuse(
                self.supply.nominal_voltage is None,
                "supply.nominal_voltage",
                "required for DC motors",
            )
            _refuse(
                self.torque_command is not None,
                "torque_command",
                'applies to actuators of kind = "torque" only',
            )
        return self

    @property
    def actuator_kind(self) -> ActuatorKind:
        return self.actuators[self.legs[0].actuators[0]].kind

    @property
    def servos(self) -> tuple[PositionLoop, ...]:
        """Position control of every joint, leg by leg; empty if the actuators have none."""
        of_joints = [self.actuators[name] for leg in self.legs for name in leg.actuators]
        return tuple(a.servo for a in of_joints if isinstance(a, Actuator) and a.servo)

    @model_validator(mode="after")
    def _servos_are_alike(self) -> RobotDescription:
        if not self.servos:
            return self
        for leg in self.legs:
            for name in leg.actuators:
                actuator = self.actuators[name]
                if isinstance(actuator, Actuator) and actuator.servo is None:
                    raise ValueError(
                        f"actuators.{name}.servo: required, as other joints have servos"
                    )
        defaults = {servo.default_p for servo in self.servos if servo.tunable}
        if len(defaults) > 1:
            raise ValueError(
                "actuators: all servos have one P, but theirs are in different units (default_p"
                f" {' and '.join(f'{p:g}' for p in sorted(defaults))}); set tunable = false for one"
                " kind"
            )
        return self

    @property
    def inner_rate(self) -> int:
        """Frequency of the actuators' own control [Hz]; without any that of the control."""
        if self.actuator_kind == "dc":
            return self.servo_rate if self.servos else CONTROL_RATE
        return (self.torque_command or _DEFAULT_COMMAND).rate

    @property
    def output(self) -> tuple[int, int, float]:
        """Full scale and resolution of a controller's output [counts], and a count's value [1]."""
        if self.pwm is None or self.supply.nominal_voltage is None:
            command = self.torque_command or _DEFAULT_COMMAND
            return command.counts, command.step, 1.0 / command.counts
        pwm = self.pwm
        per_count = pwm.full_scale / (self.supply.nominal_voltage * pwm.counts)
        return pwm.counts, pwm.step, per_count

    @model_validator(mode="after")
    def _dead_zone_lies_below_the_linear_one(self) -> RobotDescription:
        if self.contact_law == "dead_zone":
            feet = {f"legs.{k}.contact": leg.contact for k, leg in enumerate(self.legs)}
            for where, contact in {"contact": self.contact, **feet}.items():
                if contact is not None and contact.stick_velocity >= contact.slip_velocity:
                    raise ValueError(
                        f"{where}.stick_velocity: must be less than slip_velocity"
                        f" ({contact.slip_velocity:g} m/s) under the contact law dead_zone"
                    )
        return self
