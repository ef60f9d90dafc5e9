"""Design variables: numbers and choices with bounds and units.

variables.toml declares those of gaits and controllers, robot/variables.toml and
worlds/variables.toml those of robots and worlds, which a job's design space, the page's form and
the check of design files all use.
"""

from __future__ import annotations

import math
import operator
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib import resources
from typing import Annotated, Any, Final, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    FiniteFloat,
    Tag,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from gaitswarm.sim.input import NAME, OWN, alternatives

VariableName = Annotated[
    str,
    Field(
        min_length=1,
        max_length=102,
        pattern=r"^[A-Za-z][A-Za-z0-9_]{0,39}(\[[A-Za-z0-9][A-Za-z0-9 _.-]{0,59}\])?$",
        description="Name of the variable, as in the tables of the thesis; gait variables of some"
        " legs include their group, such as `stride[front]`.",
        examples=["FI1R"],
    ),
]

ChoiceName = Annotated[
    str,
    Field(min_length=1, max_length=60, pattern=r"^[A-Za-z][A-Za-z0-9_.-]*$", examples=["stick"]),
]
"""Name of a choice of a categorical variable."""

_NUMBER: Final = "<number>"


def _number_or_name(value: Any) -> str:
    if not isinstance(value, str):
        return _NUMBER
    try:
        float(value)
    except ValueError:
        return NAME
    return _NUMBER


VariableValue = Annotated[
    Annotated[FiniteFloat, Tag(_NUMBER)] | Annotated[ChoiceName, Tag(NAME)],
    Discriminator(_number_or_name),
]
"""A variable's value in user input: a number, or the name of a choice."""


def _with_bounds(schema: dict[str, Any]) -> None:
    """Require bounds in the schema; descriptions say that a categorical variable may omit them."""
    schema["required"] = ["name", "low", "high"]
    for bound in ("low", "high"):
        del schema["properties"][bound]["default"]


class Variable(BaseModel):
    """One coordinate of a design: closed box bounds, a unit; continuous, integer or categorical."""

    model_config = ConfigDict(frozen=True, extra="forbid", json_schema_extra=_with_bounds)

    name: VariableName
    low: FiniteFloat = Field(
        default=None,
        validate_default=True,
        description="Lower bound, in `unit`; 0 for a categorical variable, which may omit it.",
        examples=[1500.0],
    )
    high: FiniteFloat = Field(
        default=None,
        validate_default=True,
        description="Upper bound, in `unit`; the last index for a categorical variable, which may"
        " omit it.",
        examples=[6000.0],
    )
    unit: str = Field(default="1", description="Unit of value and bounds.", examples=["counts"])
    kind: Literal["continuous", "integer", "categorical"] = Field(
        default="continuous",
        description="An `integer` variable is rounded to the nearest integer for evaluation. A"
        " `categorical` one is one of `choices`, each with an equal share of the search range.",
    )
    choices: tuple[ChoiceName, ...] = Field(
        default=(),
        max_length=64,
        description="Choices of a categorical variable. Its number is the index, from 0.",
        examples=[["linear_zone", "karnopp", "stick"]],
    )
    default: FiniteFloat | None = Field(
        default=None,
        description="Value if a design omits the variable; null if it is required, or if the"
        " default depends on something else.",
    )
    by_leg_group: bool = Field(
        default=False,
        exclude_if=operator.not_,
        description="Whether groups of legs may have values of their own: `NAME[GROUP]`.",
    )
    description: str = Field(default="", description="What the variable does.")

    @model_validator(mode="before")
    @classmethod
    def _bound_the_indices(cls, document: Any) -> Any:
        if not isinstance(document, dict) or document.get("kind") != "categorical":
            return document
        choices = document.get("choices", ())
        if not isinstance(choices, list | tuple):
            return document
        return {"low": 0.0, "high": len(choices) - 1.0, **document}

    @field_validator("low", "high", mode="before")
    @classmethod
    def _is_given(cls, bound: Any) -> Any:
        if bound is None:
            raise PydanticCustomError("missing", "Field required")
        return bound

    @model_validator(mode="after")
    def _bounds_enclose_a_value(self) -> Variable:
        if self.kind == "categorical":
            return self._has_choices()
        if self.choices:
            raise ValueError(f"choices of {self.name}: only a categorical variable has any")
        if not self.low < self.high:
            raise ValueError(
                f"bounds of {self.name} are inverted or empty: low {self.low:g} must be less than"
                f" high {self.high:g}; to hold it at one value, use `fixed` instead"
            )
        if self.kind == "integer" and not (self.low.is_integer() and self.high.is_integer()):
            raise ValueError(f"bounds of the integer variable {self.name} must be integers")
        return self

    def _has_choices(self) -> Variable:
        if len(self.choices) < 2:
            raise ValueError(
                f"choices of {self.name}: at least two; to hold it at one, use `fixed` instead"
            )
        for choice in self.choices:
            if self.choices.count(choice) > 1:
                raise ValueError(f"choices of {self.name}: {choice!r} is listed twice")
        if (self.low, self.high) != (0.0, len(self.choices) - 1.0):
            raise ValueError(
                f"bounds of the categorical variable {self.name} are 0 and {len(self.choices) - 1},"
                " or left out; to search fewer choices, shorten `choices`"
            )
        return self

    @property
    def range_in_words(self) -> str:
        """Bounds and unit, as in `1500 to 6000 counts`, or choices."""
        if self.kind == "categorical":
            return ", ".join(self.choices)
        whole = "integers, " if self.kind == "integer" else ""
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"{whole}{self.low:g} to {self.high:g}{unit}"

    def number(self, value: float | str) -> float:
        """Convert a value to a number in arrays of designs.

        Args:
            value: A number in the variable's unit; of a categorical variable a choice or its index.

        Returns:
            The number; for a categorical variable the index of the choice.

        Raises:
            ValueError: Unknown choice; names the choices.
        """
        if self.kind == "categorical":
            if value in self.choices:
                return float(self.choices.index(str(value)))
            if not isinstance(value, str) and value in range(len(self.choices)):
                return float(value)
            shown = repr(value) if isinstance(value, str) else f"{value:g}"
            raise ValueError(
                f"{self.name}: {shown} is not one of its choices {', '.join(self.choices)}"
            )
        if isinstance(value, str):
            raise ValueError(f"{self.name}: {value!r} is not a number")  # noqa: TRY004
        return float(value)

    def shown(self, number: float) -> float | str:
        """Convert a number of a design array to a value; the inverse of `number`.

        Args:
            number: In the variable's unit; of a categorical variable the index of a choice.
        """
        if self.kind != "categorical" or math.isnan(number):
            return number
        return self.choices[round(number)]


@cache
def _tables(folder: str) -> Mapping[str, Mapping[str, Any]]:
    file = resources.files("gaitswarm.sim") / folder / "variables.toml"
    return tomllib.loads(file.read_text(encoding="utf-8"))


@cache
def listed_variables(table: str, folder: str = "") -> tuple[Variable, ...]:
    """Return the variables of a table of a folder's variables.toml, in its order."""
    return tuple(Variable(name=name, **fields) for name, fields in _tables(folder)[table].items())


def listed_limits(table: str, folder: str = "") -> Mapping[str, tuple[float, float]]:
    """Return the least and largest value of variables that can be simulated, by name."""
    return {name: (low, high) for name, (low, high) in _tables(folder)["limits"][table].items()}


def split_name(name: str) -> tuple[str, str | None]:
    """Split a variable's name from its group of legs: `stride[front]` is `stride`, `front`."""
    base, bracket, group = name.partition("[")
    return (base, group[:-1]) if bracket and group.endswith("]") else (name, None)


class VariableCatalogue(Mapping[str, Variable]):
    """Variables by name; those of groups are found as `NAME[GROUP]`, too.

    Iterates over the names without groups, since groups depend on the robot.
    """

    def __init__(self, variables: Iterable[Variable]) -> None:
        self._variables = {variable.name: variable for variable in variables}

    def __getitem__(self, name: str) -> Variable:
        variable = self._variables.get(name)
        if variable is not None:
            return variable
        base, group = split_name(name)
        known = self._variables.get(base)
        if not group or known is None or not known.by_leg_group:
            raise KeyError(name)
        return known.model_copy(update={"name": name})

    def __contains__(self, name: object) -> bool:
        if name in self._variables:
            return True
        base, group = split_name(str(name))
        return bool(group) and base in self._variables and self._variables[base].by_leg_group

    def __iter__(self) -> Iterator[str]:
        return iter(self._variables)

    def __len__(self) -> int:
        return len(self._variables)


VariableChoice = Annotated[
    Annotated[VariableName, Tag(NAME)] | Annotated[Variable, Tag(OWN)],
    alternatives("must be a variable's name, or an object: a variable with custom bounds"),
]
"""A variable to be searched, as in jobs."""
