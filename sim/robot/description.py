"""Robot description as in a robot.toml, and the library of actuators in actuators.toml."""

from __future__ import annotations

import operator
import tomllib
from collections.abc import Mapping
from functools import lru_cache
from importlib import resources
from typing import Annotated, Any, Final, Literal

from pydantic import ConfigDict, Discriminator, Field, Tag, model_validator

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.input import Data, Lines
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.robot.bounds import (
    LONGEST_LEG_NAME,
    MOST_LEGS,
    ContactLaw,
    Number,
    PartName,
    PlannedSoles,
    Sentence,
)

ActuatorKind = Literal["dc", "torque"]
"""What a controller commands: a DC motor's voltage, or an actuator's torque."""

LARGEST_OUTPUT: Final = 32767
"""Largest full scale of a controller's output [counts]."""

CONTROL_RATE: Final = 500
"""Control frequency [Hz]."""

FASTEST_INNER_RATE: Final = 40_000
"""Largest frequency of an actuator's own control [Hz]."""


class Motor(Data):
    """A DC motor (thesis 2.2.5)."""

    torque_constant: Number = Field(gt=0.0)
    """K_M [N m/A]; also the back-EMF constant [V s/rad]"""
    resistance: Number = Field(gt=0.0, description="R [ohm]")
    inductance: Number = Field(gt=0.0, description="L [H]")
    rotor_inertia: Number = Field(gt=0.0, description="J_M [kg m2]")
    viscous_friction: Number = Field(ge=0.0, description="B_M [N m s/rad], motor side")


def _share(description: str) -> Any:
    return Field(default=0.0, ge=0.0, lt=1.0, exclude_if=operator.not_, description=description)


class DryFriction(Data):
    """Dry friction at a gear's output, which also holds the gear at rest.

    With the torque tau_M of the motor, tau_L passed to the link, and s = 1 / (1 + (rate /
    stribeck_speed)^2), or exp(-|rate / stribeck_speed|^stribeck_exponent), the limit is
    coulomb_friction + |k_M tau_M + k_L tau_L| + s (stribeck_friction + |stribeck_motor_load tau_M +
    stribeck_link_load tau_L| + Q), where k_M = load_friction + motor_load_friction, k_L =
    load_friction + link_load_friction, and Q, if both torques have the same direction, is
    link_load_square tau_L^2 where |tau_L| < |tau_M|, else motor_load_square tau_M^2.
    """

    coulomb_friction: Number = Field(default=0.0, ge=0.0)
    """part independent of speed and load [N m]"""
    stribeck_friction: Number = Field(default=0.0, ge=0.0)
    """additional part at rest, halved at stribeck_speed [N m]"""
    stribeck_speed: Number = Field(default=0.1, gt=0.0)
    """speed at which stribeck_friction is halved [rad/s]"""
    load_friction: Number = Field(default=0.0, ge=0.0, lt=1.0)
    """part of the sum of the torques on both sides of the gear [1]"""
    stribeck_exponent: Number = Field(default=0.0, ge=0.0, le=20.0, exclude_if=operator.not_)
    """of an exponential decay with speed; 0 for Hess and Soom's curve [1]"""
    motor_load_friction: Number = _share("further part of the motor's torque [1]")
    link_load_friction: Number = _share("further part of the torque passed to the link [1]")
    stribeck_motor_load: Number = _share("part of the motor's torque at rest [1]")
    stribeck_link_load: Number = _share("part of the torque passed to the link at rest [1]")
    motor_load_square: Number = _share(
        "part of the square of the motor's torque at rest, where the link drives [1/(N m)]"
    )
    link_load_square: Number = _share(
        "part of the square of the link's torque at rest, where the motor drives [1/(N m)]"
    )


DIRECTIONAL_FRICTION: Final = tuple(DryFriction.model_fields)[4:]
"""Fields of dry friction that distinguish motor and link, or decay exponentially with speed."""


class Gearhead(DryFriction):
    """A planetary gearhead; its losses are viscous and dry friction on the output side."""

    ratio: Number = Field(gt=0.0, description="r_G [1]")
    nominal_torque: Number = Field(gt=0.0, description="M_NG [N m]")
    nominal_speed: Number = Field(gt=0.0, description="omega_NG [rad/s], motor side")
    efficiency: Number = Field(gt=0.0, le=1.0, description="eta at the nominal point [1]")


class Shaft(Data):
    """Backlash between an actuator and its link."""

    backlash: Number = Field(default=0.0, ge=0.0, le=0.5)
    """backlash between gearhead and link, end to end (thesis: gearlash) [rad]"""
    shaft_stiffness: Number = Field(default=500.0, gt=0.0)
    """stiffness once backlash is closed; only with backlash [N m/rad]"""
    shaft_damping: Number = Field(default=0.5, ge=0.0)
    """damping once backlash is closed; only with backlash [N m s/rad]"""


class PositionLoop(Data):
    """Position control in a servo's firmware: duty = P position_gain error, with a dead band."""

    position_gain: Number = Field(gt=0.0)
    """duty of the PWM per error and unit of P [1/rad]"""
    duty_limit: Number = Field(default=1.0, gt=0.0, le=1.0, description="largest duty [1]")
    dead_band: Number = Field(default=0.0, ge=0.0, le=0.5)
    """error up to which the motor is off [rad]"""
    default_p: Number = Field(gt=0.0, le=LARGEST_OUTPUT)
    """P of the firmware [units of its register]"""
    tunable: bool = Field(default=True, description="whether P can be set")


class Actuator(Shaft):
    """DC motor, gearhead and bevel gear of one joint."""

    kind: Literal["dc"] = Field(default="dc", exclude_if="dc".__eq__)
    """dc: a motor's voltage is controlled"""
    motor: PartName
    gearhead: PartName
    bevel: Number = Field(default=1.0, gt=0.0, description="ratio of a bevel gear at the joint [1]")
    servo: PositionLoop | None = Field(default=None, exclude_if=operator.not_)
    """position control of a servo; of all actuators of the legs or of none"""


class TorqueActuator(Shaft, DryFriction):
    """A motor with field-oriented control behind a low gear ratio.

    Torque is proportional to current, so the current loop is assumed perfect. The motor is its
    equivalent DC circuit, referred to the motor's side of the gear; limits and friction are at the
    joint.
    """

    kind: Literal["torque"] = Field(description="torque: the actuator's torque is controlled")
    gear_ratio: Number = Field(gt=0.0, description="turns of the motor per turn of the joint [1]")
    torque_constant: Number = Field(gt=0.0)
    """k_t of the motor [N m/A]; also the back-EMF constant [V s/rad]"""
    resistance: Number = Field(gt=0.0, description="R, which heats with R I^2 [ohm]")
    rotor_inertia: Number = Field(gt=0.0, description="J_M of the rotor [kg m2]")
    torque_limit: Number = Field(gt=0.0)
    """largest torque at the joint, full scale of a controller's output [N m]"""
    speed_limit: Number | None = Field(default=None, gt=0.0)
    """speed of the joint at which torque along the motion reaches zero [rad/s]; default: limited by
    the battery voltage, R I + k_e omega <= U"""
    knee_speed: Number | None = Field(default=None, ge=0.0)
    """speed of the joint up to which torque_limit is available; beyond it torque falls to zero at
    speed_limit [rad/s]"""
    viscous_friction: Number = Field(default=0.0, ge=0.0, description="at the joint [N m s/rad]")

    @model_validator(mode="after")
    def _limits_go_together(self) -> TorqueActuator:
        if (self.speed_limit is None) != (self.knee_speed is None):
            raise ValueError(
                "give both speed_limit and knee_speed, or neither: the battery voltage then limits"
                " the speed"
            )
        knee, top = self.knee_speed, self.speed_limit
        if knee is not None and top is not None and knee >= top:
            raise ValueError(
                f"knee_speed: {knee:g} rad/s must be less than speed_limit ({top:g} rad/s)"
            )
        return self

    @property
    def stall_torque(self) -> float:
        """Torque at zero speed of the line that limits torque; 0 without speed_limit [N m]."""
        if self.speed_limit is None or self.knee_speed is None:
            return 0.0
        return self.torque_limit * self.speed_limit / (self.speed_limit - self.knee_speed)

    @property
    def stall_torque_per_volt(self) -> float:
        """Torque at zero speed per battery voltage; 0 with speed_limit [N m/V]."""
        if self.speed_limit is not None:
            return 0.0
        return self.gear_ratio * self.torque_constant / self.resistance

    @property
    def torque_drop(self) -> float:
        """Slope of the line that limits torque by speed [N m s/rad]."""
        if self.speed_limit is None:
            return (self.gear_ratio * self.torque_constant) ** 2 / self.resistance
        return self.stall_torque / self.speed_limit


def _kind_of(actuator: Any) -> str:
    kind = actuator.get("kind", "dc") if isinstance(actuator, dict) else actuator.kind
    return kind if isinstance(kind, str) else repr(kind)


AnyActuator = Annotated[
    Annotated[Actuator, Tag("dc")] | Annotated[TorqueActuator, Tag("torque")],
    Discriminator(
        _kind_of,
        custom_error_type="kind",
        custom_error_message="kind: must be dc (the default) or torque",
    ),
]
"""An actuator of either kind, which its `kind` selects."""


class TorqueCommand(Data):
    """Command interface of torque-controlled actuators."""

    counts: int = Field(default=2047, gt=0, le=LARGEST_OUTPUT)
    """full scale of a controller's output, equal to torque_limit [counts]"""
    step: int = Field(default=1, ge=1, le=LARGEST_OUTPUT, description="resolution [counts]")
    rate: int = Field(
        default=1000,
        ge=CONTROL_RATE,
        le=FASTEST_INNER_RATE,
        multiple_of=CONTROL_RATE,
        description="frequency of the actuators' joint PD, whose torque is held between ticks [Hz]",
    )


JOINTS_PER_LEG = 3
"""Coxa, femur, tibia."""

MOST_COUNTS: Final = 10**8
"""Largest number of counts per unit; codes of some units then fit into 32 bits."""


EnergyConvention = Literal["signed", "positive", "absolute"]
"""Electrical power of a motor that counts as spent: all of it, so that braking returns energy;
only where positive, so that braking energy is lost; or its absolute value."""


class Supply(Data):
    """One battery for all motors."""

    voltage: Number = Field(gt=0.0, description="open-circuit voltage [V]")
    resistance: Number = Field(ge=0.0, description="internal resistance [ohm]")
    nominal_voltage: Number | None = Field(default=None, gt=0.0, exclude_if=operator.not_)
    """supply voltage at which the PWM's full scale applies [V]; DC motors only"""
    energy: EnergyConvention = "signed"
    """electrical power of each motor that counts as spent and loads the battery: signed (braking
    returns energy), positive (braking energy is lost) or absolute"""


class Pwm(Data):
    """Coded control signal: integer counts, full scale at the nominal supply voltage."""

    counts: int = Field(gt=0, le=LARGEST_OUTPUT, description="full scale [counts]")
    full_scale: Number = Field(gt=0.0, description="motor voltage at full scale [V]")
    step: int = Field(default=1, ge=1, le=LARGEST_OUTPUT, description="resolution [counts]")


class Sensors(Data):
    """Coded readings (thesis table 4.4): integers, in steps of the converter's resolution."""

    angle_counts: Number = Field(gt=0.0, le=MOST_COUNTS)
    """code of one radian [counts/rad]"""
    angle_step: int = Field(default=1, ge=1, le=MOST_COUNTS)
    """encoder resolution [counts]"""
    current_counts: Number = Field(gt=0.0, le=MOST_COUNTS)
    """code of one ampere [counts/A]"""
    current_step: int = Field(default=16, ge=1, le=MOST_COUNTS)
    """resolution of the ADC [counts]"""
    current_filter: Number = Field(default=0.0, ge=0.0, le=1.0)
    """time constant of the first-order low-pass of the absolute current before the ADC; 0 for none
    [s]"""


class Contact(Data):
    """Contact of sole and ground (thesis 2.2.6): spring, damper and friction parameters."""

    stiffness: Number = Field(gt=0.0, description="k [N/m]")
    damping: Number = Field(ge=0.0, description="c [N s/m]")
    sole: Number = Field(ge=0.0, description="length of the sole's spring below the tibia [m]")
    friction: Number = Field(ge=0.0, description="mu [1]")
    slip_velocity: Number = Field(gt=0.0)
    """linear_zone, dead_zone: v_lin, full friction from this speed [m/s]"""
    stick_velocity: Number = Field(default=0.005, gt=0.0)
    """karnopp, dead_zone: v_d, no friction below [m/s]"""
    stick_stiffness: Number = Field(default=10000.0, gt=0.0)
    """stick: stiffness of the sole along the ground [N/m]"""
    stick_damping: Number = Field(default=100.0, ge=0.0)
    """stick: damping of the sole along the ground [N s/m]"""


GroupName = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _.-]{0,59}$")]
"""Name of a group of legs, as in names of variables."""


class Leg(Data):
    """One leg: three joints of the URDF from the body outwards, and the frame of its foot."""

    model_config = ConfigDict(validate_by_name=True, validate_by_alias=True, defer_build=True)

    name: Annotated[PartName, Field(max_length=LONGEST_LEG_NAME)]
    phase: Number = Field(ge=0.0, lt=1.0, description="start of support, share of the cycle [1]")
    actuators: tuple[PartName, PartName, PartName]
    """actuators of coxa, femur, tibia"""
    own_joints: tuple[PartName, PartName, PartName] | None = Field(
        default=None,
        alias="joints",
        exclude_if=operator.not_,
        description="joints, from the body outwards; default `<name>_coxa`, `_femur` and `_tibia`",
    )
    own_foot: PartName | None = Field(
        default=None,
        alias="foot",
        exclude_if=operator.not_,
        description="link or fixed joint at the leg's end; default `<name>_foot`",
    )
    stance: tuple[Number, Number, Number] | None = Field(default=None, exclude_if=operator.not_)
    """joint angles of the leg's stance, for which its gait is planned [rad]; default for legs with
    all frames parallel to the body's: knee up"""
    contact: Contact | None = Field(default=None, description="contact parameters of this foot")

    @property
    def joints(self) -> tuple[str, str, str]:
        return self.own_joints or (f"{self.name}_coxa", f"{self.name}_femur", f"{self.name}_tibia")

    @property
    def foot(self) -> str:
        return self.own_foot or f"{self.name}_foot"


_DEFAULT_COMMAND: Final = TorqueCommand()

_NOMINAL: Final = "supply.nominal_voltage"

_FOR_TORQUE: Final = 'applies to actuators of kind = "torque" only'


class RobotDescription(Data):
    """Everything about a robot that its URDF does not contain."""

    name: PartName
    description: Lines = Field(default="", max_length=2000)
    load_height: Number = Field(description="height of a load above the body's centre [m]")
    contact_law: ContactLaw = Field(default="linear_zone", description="friction law of all feet")
    planned_soles: PlannedSoles = "nominal"
    """sole lengths that the gait assumes: nominal, the common contact's, since a controller does
    not know the true ones; or own, each leg's"""
    body_mass: Number | None = Field(default=None, gt=0.0)
    """mass that replaces the body's in the URDF and scales its inertia [kg]"""
    elastic_shafts: bool = False
    """model elastic shafts between motors and links, even without backlash"""
    servo_rate: int = Field(
        default=1000,
        ge=CONTROL_RATE,
        le=FASTEST_INNER_RATE,
        multiple_of=CONTROL_RATE,
        exclude_if=(1000).__eq__,
        description="frequency of the servos' position control [Hz]; for servos only",
    )
    motors: dict[PartName, Motor] = Field(default={}, description="of DC actuators, by name")
    gearheads: dict[PartName, Gearhead] = Field(default={}, description="likewise")
    actuators: dict[PartName, AnyActuator]
    supply: Supply
    pwm: Pwm | None = Field(default=None, exclude_if=operator.not_)
    """required for DC motors, and only for them"""
    torque_command: TorqueCommand | None = Field(default=None, exclude_if=operator.not_)
    """only for torque-controlled actuators; default: the defaults of its fields"""
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
    guesses: tuple[Sentence, ...] = Field(default=(), exclude_if=operator.not_)
    """guesses of `robot init`, shown by `robot check`; remove verified ones"""
    held_joints: dict[PartName, Number] = Field(default={}, exclude_if=operator.not_)
    """movable joints that belong to no leg, each with the angle at which it is fixed [rad]"""

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
        torque, volts = "torque" in kinds, self.supply.nominal_voltage
        for wrong, problem in (
            (torque and self.pwm, "pwm: applies to DC motors only; use torque_command"),
            (torque and volts, f"{_NOMINAL}: applies to the PWM of DC motors only; remove it"),
            (not (torque or self.pwm), "pwm: required for DC motors"),
            (not (torque or volts), f"{_NOMINAL}: required for DC motors"),
            (not torque and self.torque_command, f"torque_command: {_FOR_TORQUE}"),
        ):
            if wrong:
                raise ValueError(problem)
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


class ListedActuator(DryFriction):
    """A motor with its gear, by its numbers at the output unless there is a gear ratio."""

    title: str
    source: str
    guessed: tuple[str, ...] = Field(default=())  # numbers that the source does not have
    kind: ActuatorKind = "dc"
    voltage: Number  # recommended [V]
    gear_ratio: Number = 1.0
    torque_constant: Number
    resistance: Number
    rotor_inertia: Number
    viscous_friction: Number
    torque_limit: Number | None = None
    speed_limit: Number | None = None
    knee_speed: Number | None = None
    encoder_counts: int = 65536  # per turn
    bounds_p: tuple[Number, Number] | None = None  # for tuning
    servo: PositionLoop | None = None

    @property
    def stall_torque(self) -> float:
        """Largest torque of the motor at rest and the recommended voltage [N m]."""
        constant = self.gear_ratio * self.torque_constant
        return self.torque_limit or constant * self.voltage / self.resistance

    @property
    def no_load_speed(self) -> float:
        """Speed at which the motor's torque reaches zero at the recommended voltage [rad/s]."""
        return self.speed_limit or self.voltage / (self.gear_ratio * self.torque_constant)

    @property
    def armature(self) -> float:
        """Rotor inertia at the output [kg m2]."""
        return self.rotor_inertia * self.gear_ratio**2

    @property
    def note(self) -> str:
        guessed = f"; guessed: {', '.join(self.guessed)}" if self.guessed else ""
        return f"{self.title} at {self.voltage:g} V, {self.source}{guessed}"


@lru_cache(maxsize=1)
def listed_actuators() -> Mapping[str, ListedActuator]:
    """Return all actuators of actuators.toml by name, with the source of their numbers."""
    file = resources.files("gaitswarm.sim.robot") / "actuators.toml"
    document = tomllib.loads(file.read_text(encoding="utf-8"))
    return {name: ListedActuator.model_validate(entry) for name, entry in document.items()}


def listed_actuator(name: str) -> ListedActuator:
    """Return an actuator of the library.

    Raises:
        RobotFileError: No actuator has this name.
    """
    listed = listed_actuators()
    if name not in listed:
        raise RobotFileError(f"actuator {name!r} is not listed; {instead_of(name, listed)}")
    return listed[name]
