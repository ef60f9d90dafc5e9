"""Actuator models: DC motors with gearheads (`dc`) and torque-controlled actuators (`torque`)."""

from __future__ import annotations

import operator
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

from gaitswarm.sim.robot.bounds import Number, PartName

ActuatorKind = Literal["dc", "torque"]
"""What a controller commands: a DC motor's voltage, or an actuator's torque."""

LARGEST_OUTPUT: Final = 32767
"""Largest full scale of a controller's output [counts]."""

CONTROL_RATE: Final = 500
"""Control frequency [Hz]."""

FASTEST_INNER_RATE: Final = 40_000
"""Largest frequency of an actuator's own control [Hz]."""


class Data(BaseModel):
    """Base class: immutable, without unknown fields, infinities and NaN."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


class Motor(Data):
    """A DC motor (thesis 2.2.5)."""

    torque_constant: Number = Field(
        gt=0.0, description="K_M [N m/A]; also the back-EMF constant [V s/rad]"
    )
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

    coulomb_friction: Number = Field(
        default=0.0, ge=0.0, description="part independent of speed and load [N m]"
    )
    stribeck_friction: Number = Field(
        default=0.0, ge=0.0, description="additional part at rest, halved at stribeck_speed [N m]"
    )
    stribeck_speed: Number = Field(
        default=0.1, gt=0.0, description="speed at which stribeck_friction is halved [rad/s]"
    )
    load_friction: Number = Field(
        default=0.0,
        ge=0.0,
        lt=1.0,
        description="part of the sum of the torques on both sides of the gear [1]",
    )
    stribeck_exponent: Number = Field(
        default=0.0,
        ge=0.0,
        le=20.0,
        exclude_if=operator.not_,
        description="of an exponential decay with speed; 0 for Hess and Soom's curve [1]",
    )
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


def _is_default_kind(kind: str) -> bool:
    return kind == "dc"


class Shaft(Data):
    """Backlash between an actuator and its link."""

    backlash: Number = Field(
        default=0.0,
        ge=0.0,
        le=0.5,
        description="backlash between gearhead and link, end to end (thesis: gearlash) [rad]",
    )
    shaft_stiffness: Number = Field(
        default=500.0,
        gt=0.0,
        description="stiffness once backlash is closed; only with backlash [N m/rad]",
    )
    shaft_damping: Number = Field(
        default=0.5,
        ge=0.0,
        description="damping once backlash is closed; only with backlash [N m s/rad]",
    )


class PositionLoop(Data):
    """Position control in a servo's firmware: duty = P position_gain error, with a dead band."""

    position_gain: Number = Field(
        gt=0.0, description="duty of the PWM per error and unit of P [1/rad]"
    )
    duty_limit: Number = Field(default=1.0, gt=0.0, le=1.0, description="largest duty [1]")
    dead_band: Number = Field(
        default=0.0, ge=0.0, le=0.5, description="error up to which the motor is off [rad]"
    )
    default_p: Number = Field(
        gt=0.0, le=LARGEST_OUTPUT, description="P of the firmware [units of its register]"
    )
    tunable: bool = Field(default=True, description="whether P can be set")


class Actuator(Shaft):
    """DC motor, gearhead and bevel gear of one joint."""

    kind: Literal["dc"] = Field(
        default="dc", exclude_if=_is_default_kind, description="dc: a motor's voltage is controlled"
    )
    motor: PartName
    gearhead: PartName
    bevel: Number = Field(default=1.0, gt=0.0, description="ratio of a bevel gear at the joint [1]")
    servo: PositionLoop | None = Field(
        default=None,
        exclude_if=operator.not_,
        description="position control of a servo; of all actuators of the legs or of none",
    )


class TorqueActuator(Shaft, DryFriction):
    """A motor with field-oriented control behind a low gear ratio.

    Torque is proportional to current, so the current loop is assumed perfect. The motor is its
    equivalent DC circuit, referred to the motor's side of the gear; limits and friction are at the
    joint.
    """

    kind: Literal["torque"] = Field(description="torque: the actuator's torque is controlled")
    gear_ratio: Number = Field(gt=0.0, description="turns of the motor per turn of the joint [1]")
    torque_constant: Number = Field(
        gt=0.0, description="k_t of the motor [N m/A]; also the back-EMF constant [V s/rad]"
    )
    resistance: Number = Field(gt=0.0, description="R, which heats with R I^2 [ohm]")
    rotor_inertia: Number = Field(gt=0.0, description="J_M of the rotor [kg m2]")
    torque_limit: Number = Field(
        gt=0.0, description="largest torque at the joint, full scale of a controller's output [N m]"
    )
    speed_limit: Number | None = Field(
        default=None,
        gt=0.0,
        description="speed of the joint at which torque along the motion reaches zero [rad/s];"
        " default: limited by the battery voltage, R I + k_e omega <= U",
    )
    knee_speed: Number | None = Field(
        default=None,
        ge=0.0,
        description="speed of the joint up to which torque_limit is available; beyond it torque"
        " falls to zero at speed_limit [rad/s]",
    )
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

    counts: int = Field(
        default=2047,
        gt=0,
        le=LARGEST_OUTPUT,
        description="full scale of a controller's output, equal to torque_limit [counts]",
    )
    step: int = Field(default=1, ge=1, le=LARGEST_OUTPUT, description="resolution [counts]")
    rate: int = Field(
        default=1000,
        ge=CONTROL_RATE,
        le=FASTEST_INNER_RATE,
        multiple_of=CONTROL_RATE,
        description="frequency of the actuators' joint PD, whose torque is held between ticks [Hz]",
    )
