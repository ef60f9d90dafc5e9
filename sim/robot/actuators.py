"""Actuators as data: what drives a joint, and by which numbers.

Two kinds: a DC motor with gearhead whose voltage is controlled (`dc`), and an actuator whose torque
is controlled (`torque`), as in quadrupeds with quasi-direct drives.
"""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

from gaitswarm.sim.robot.bounds import Number, PartName

ActuatorKind = Literal["dc", "torque"]
"""What a controller commands: a DC motor's voltage, or an actuator's torque."""

LARGEST_OUTPUT: Final = 32767
"""Full scale of a controller's output, at most [counts]."""

CONTROL_RATE: Final = 500
"""Control ticks a second [Hz]."""

FASTEST_INNER_RATE: Final = 40_000
"""Of an actuator's own control [Hz]."""


class Data(BaseModel):
    """Immutable, without unknown fields, infinities and NaN."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Motor(Data):
    """A DC motor (thesis 2.2.5)."""

    torque_constant: Number = Field(
        gt=0.0, description="K_M [N m/A]; also the back-EMF's [V s/rad]"
    )
    resistance: Number = Field(gt=0.0, description="R [ohm]")
    inductance: Number = Field(gt=0.0, description="L [H]")
    rotor_inertia: Number = Field(gt=0.0, description="J_M [kg m2]")
    viscous_friction: Number = Field(ge=0.0, description="B_M [N m s/rad], motor side")


class Gearhead(Data):
    """A planetary gearhead; its losses are viscous and static friction on the output side."""

    ratio: Number = Field(gt=0.0, description="r_G [1]")
    nominal_torque: Number = Field(gt=0.0, description="M_NG [N m]")
    nominal_speed: Number = Field(gt=0.0, description="omega_NG [rad/s], motor side")
    efficiency: Number = Field(gt=0.0, le=1.0, description="eta at the nominal point [1]")
    static_friction: Number = Field(
        default=0.0,
        ge=0.0,
        description="against the motion at the output, whatever its speed [N m]",
    )


def _is_default_kind(kind: str) -> bool:
    return kind == "dc"


class Shaft(Data):
    """Play between an actuator and its link."""

    backlash: Number = Field(
        default=0.0,
        ge=0.0,
        le=0.5,
        description="play between gearhead and link, end to end, the thesis's gearlash [rad]",
    )
    shaft_stiffness: Number = Field(
        default=500.0,
        gt=0.0,
        description="of the closed play, only with backlash [N m/rad]",
    )
    shaft_damping: Number = Field(
        default=0.5,
        ge=0.0,
        description="of the closed play, only with backlash [N m s/rad]",
    )


class Actuator(Shaft):
    """Motor, gearhead and bevel gear of one joint, by the names of its parts."""

    kind: Literal["dc"] = Field(
        default="dc", exclude_if=_is_default_kind, description="dc: a motor's voltage is controlled"
    )
    motor: PartName
    gearhead: PartName
    bevel: Number = Field(default=1.0, gt=0.0, description="ratio of a bevel gear at the joint [1]")


class TorqueActuator(Shaft):
    """A torque-controlled actuator: a motor with field-oriented control behind a low gear ratio.

    Torque and current are proportional, so its current loop is taken as perfect. The motor is its
    equivalent DC circuit, all of it referred to the motor's side of the gear; limits and friction
    are at the joint.
    """

    kind: Literal["torque"] = Field(description="torque: the actuator's torque is controlled")
    gear_ratio: Number = Field(gt=0.0, description="motor's turns for one of the joint [1]")
    torque_constant: Number = Field(
        gt=0.0, description="k_t of the motor [N m/A]; also the back-EMF's [V s/rad]"
    )
    resistance: Number = Field(gt=0.0, description="R, of which the heat is R I^2 [ohm]")
    rotor_inertia: Number = Field(gt=0.0, description="J_M of the rotor [kg m2]")
    torque_limit: Number = Field(
        gt=0.0, description="largest torque at the joint, full scale of a controller's output [N m]"
    )
    speed_limit: Number | None = Field(
        default=None,
        gt=0.0,
        description="rate of the joint from which on there is no torque along the motion [rad/s];"
        " left out: the one that the battery's voltage allows, R I + k_e omega <= U",
    )
    knee_speed: Number | None = Field(
        default=None,
        ge=0.0,
        description="rate of the joint up to which there is all of torque_limit, which falls from"
        " there to none at speed_limit [rad/s]",
    )
    viscous_friction: Number = Field(default=0.0, ge=0.0, description="at the joint [N m s/rad]")
    static_friction: Number = Field(
        default=0.0, ge=0.0, description="against the motion of the joint, whatever its speed [N m]"
    )

    @model_validator(mode="after")
    def _limits_go_together(self) -> TorqueActuator:
        if (self.speed_limit is None) != (self.knee_speed is None):
            raise ValueError(
                "speed_limit and knee_speed go together; without both the battery's voltage limits"
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
        """Of the line by which speed limits the torque, where it is given: at rest [N m]."""
        if self.speed_limit is None or self.knee_speed is None:
            return 0.0
        return self.torque_limit * self.speed_limit / (self.speed_limit - self.knee_speed)

    @property
    def stall_torque_per_volt(self) -> float:
        """The same of the line that the battery's voltage makes [N m/V]."""
        if self.speed_limit is not None:
            return 0.0
        return self.gear_ratio * self.torque_constant / self.resistance

    @property
    def torque_drop(self) -> float:
        """By which that line falls with the rate [N m s/rad]."""
        if self.speed_limit is None:
            return (self.gear_ratio * self.torque_constant) ** 2 / self.resistance
        return self.stall_torque / self.speed_limit


def _kind_of(actuator: Any) -> str:
    """The tag of an actuator; one without a kind is a DC motor."""
    kind = actuator.get("kind", "dc") if isinstance(actuator, dict) else actuator.kind
    return kind if isinstance(kind, str) else repr(kind)


AnyActuator = Annotated[
    Annotated[Actuator, Tag("dc")] | Annotated[TorqueActuator, Tag("torque")],
    Discriminator(
        _kind_of,
        custom_error_type="kind",
        custom_error_message="kind: must be dc (as without it) or torque",
    ),
]
"""Of either kind; a document's `kind` says which."""


class TorqueCommand(Data):
    """How torque-controlled actuators are commanded."""

    counts: int = Field(
        default=2047,
        gt=0,
        le=LARGEST_OUTPUT,
        description="full scale of a controller's output, which stands for torque_limit [counts]",
    )
    step: int = Field(default=1, ge=1, le=LARGEST_OUTPUT, description="resolution [counts]")
    rate: int = Field(
        default=1000,
        ge=CONTROL_RATE,
        le=FASTEST_INNER_RATE,
        multiple_of=CONTROL_RATE,
        description="of the actuators' joint PD, whose torque is held from tick to tick [Hz]",
    )
