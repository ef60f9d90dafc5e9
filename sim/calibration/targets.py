"""Targets of a calibration: measured or published results of walks, as typed data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from gaitswarm.sim.catalogue import check_design, design_numbers
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.input import check_distinct
from gaitswarm.sim.scenario import Scenario, ScenarioChoice, find_scenario
from gaitswarm.sim.variables import VariableName, VariableValue

WalkName = Annotated[
    str,
    Field(
        min_length=1,
        max_length=40,
        pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$",
        description="Label of the walk, unique in its job.",
        examples=["fuzzy-pso-ps"],
    ),
]

QuantityName = Literal[
    "torque",
    "acceleration",
    "angular_acceleration",
    "energy",
    "height_loss",
    "speed",
    "power",
    "peak_current",
    "mean_current",
    "motor_heat",
    "F",
    "fitness:A",
    "fitness:B",
    "fitness:C",
]


@dataclass(frozen=True, slots=True)
class Quantity:
    """A result of a walk that can be a target."""

    unit: str
    description: str
    # whether all values are positive, so that tolerances are relative; else they are in the unit
    positive: bool = True
    scenarios: bool = False  # whether it is one number over all scenarios of a walk


QUANTITIES: Final[dict[QuantityName, Quantity]] = {
    "torque": Quantity("N m", "f1, rms over time of the sum of the absolute gear torques"),
    "acceleration": Quantity("m/s2", "f2, rms of the body's linear acceleration"),
    "angular_acceleration": Quantity("rad/s2", "f3, rms of the body's angular acceleration"),
    "energy": Quantity("J/m", "f4, electrical energy of the motors per metre walked"),
    "height_loss": Quantity("m", "f6, height at the start less that at the end", positive=False),
    "speed": Quantity("m/s", "mean forward speed"),
    "power": Quantity("W", "mean electrical power of all motors"),
    "peak_current": Quantity("A", "largest absolute current of any motor"),
    "mean_current": Quantity("A", "mean over time and motors of the absolute current"),
    "motor_heat": Quantity("W", "mean of what all windings turn to heat"),
    "F": Quantity("1", "fitness of chapter 3, eq. 3.1; the greater the better"),
    "fitness:A": Quantity("1", "fitness under preference A, eq. 4.2", scenarios=True),
    "fitness:B": Quantity("1", "fitness under preference B, eq. 4.2", scenarios=True),
    "fitness:C": Quantity("1", "fitness under preference C, eq. 4.2", scenarios=True),
}


class TargetWalk(BaseModel):
    """A measured or published walk: its drive and its scenarios."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    name: WalkName
    controller: ControllerName = Field(description="Controller that drove it.")
    design: dict[VariableName, VariableValue] = Field(
        description="Value of each of the controller's variables, and of other known ones: gait"
        " variables, conventions. A calibration does not vary these values.",
        examples=[{"P": 0.454, "I": 0.147, "stride": 0.168}],
    )
    scenarios: tuple[ScenarioChoice, ...] = Field(
        min_length=1,
        max_length=32,
        description="Names or numbers of presets, or custom scenarios; several for a fitness over"
        " all of them.",
        examples=[["normal-fast"]],
    )

    @model_validator(mode="after")
    def _can_walk(self) -> TargetWalk:
        check_design(self.controller, self.design)
        check_distinct("scenarios", [scenario.name for scenario in self.resolved_scenarios()])
        return self

    def resolved_scenarios(self) -> tuple[Scenario, ...]:
        """The scenarios in full, presets looked up."""
        return tuple(find_scenario(s) if isinstance(s, str) else s for s in self.scenarios)

    @property
    def numbers(self) -> tuple[tuple[str, float], ...]:
        """Names and numbers of the design, sorted by name."""
        return tuple(sorted(design_numbers(self.controller, self.design).items()))


class Target(BaseModel):
    """One result of a walk, and the tolerance of its simulation."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    walk: WalkName
    quantity: QuantityName = Field(description="What was measured.", examples=["energy"])
    value: FiniteFloat = Field(
        description="In the quantity's unit; with `relative_to` the ratio to that walk's.",
        examples=[41.96],
    )
    tolerance: float = Field(
        gt=0.0,
        le=1e6,
        description="Deviation that counts as one. Relative, 0.2 for a fifth, except for"
        " height_loss, which may have either sign: in metres.",
        examples=[0.2],
    )
    relative_to: WalkName | None = Field(
        default=None, description="Another walk, if the value is the ratio to its quantity."
    )
    use: Literal["fit", "predict"] = Field(
        default="fit", description="Whether it is fitted, or only predicted and reported."
    )

    @model_validator(mode="after")
    def _has_a_sense(self) -> Target:
        if QUANTITIES[self.quantity].positive:
            if not self.value > 0.0:
                raise ValueError(f"value: {self.value:g}, but {self.quantity} is greater than 0")
        elif self.relative_to is not None:
            raise ValueError(f"relative_to: {self.quantity} may be zero, so it has no ratio")
        if self.relative_to == self.walk:
            raise ValueError("relative_to: the walk itself; its ratio is always 1")
        return self

    @property
    def label(self) -> str:
        """Walk and quantity, for people."""
        ratio = "" if self.relative_to is None else f" / {self.relative_to}"
        return f"{self.walk}{ratio} {self.quantity}"

    @property
    def unit(self) -> str:
        return QUANTITIES[self.quantity].unit if self.relative_to is None else "1"
