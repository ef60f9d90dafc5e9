"""A number that an optimizer may choose: its name, bounds and unit.

Controllers and gaits declare theirs as data, so the design space of a job, the
form that asks for one and the check of a design file all read the same list.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, Tag, model_validator

from sim.choice import NAME, OWN, alternatives

VariableName = Annotated[
    str,
    Field(
        min_length=1,
        max_length=40,
        pattern=r"^[A-Za-z][A-Za-z0-9_]*$",
        description="Name of the variable, as in the tables of the thesis.",
        examples=["FI1R"],
    ),
]


class Variable(BaseModel):
    """One coordinate of a design: closed box bounds, a unit, continuous or integer."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: VariableName
    low: FiniteFloat = Field(description="Lower bound, in `unit`.", examples=[1500.0])
    high: FiniteFloat = Field(description="Upper bound, in `unit`.", examples=[6000.0])
    unit: str = Field(default="1", description="Unit of value and bounds.", examples=["counts"])
    kind: Literal["continuous", "integer"] = Field(
        default="continuous",
        description="An `integer` variable is rounded to the nearest integer when it is evaluated.",
    )
    description: str = Field(default="", description="What the variable does.")

    @model_validator(mode="after")
    def _bounds_enclose_a_value(self) -> Variable:
        if not self.low < self.high:
            raise ValueError(
                f"bounds of {self.name} are inverted or empty: low {self.low:g} must be less than"
                f" high {self.high:g}; to hold it at one value, name it in `fixed` instead"
            )
        if self.kind == "integer" and not (self.low.is_integer() and self.high.is_integer()):
            raise ValueError(f"bounds of the integer variable {self.name} must be integers")
        return self


VariableChoice = Annotated[
    Annotated[VariableName, Tag(NAME)] | Annotated[Variable, Tag(OWN)],
    alternatives("must be a variable's name, or an object: a variable with bounds of your own"),
]
"""How jobs choose what is searched."""
