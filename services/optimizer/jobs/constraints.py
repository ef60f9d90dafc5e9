"""Constraints: limits on quantities of simulations, and by how much designs violate them

An infeasible design has no fitness. Among infeasible designs, the one of least violation is the
best, and any feasible design is better (Deb 2000).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Annotated, Final, NamedTuple, Self

import numpy as np
from pydantic import (
    BeforeValidator,
    Field,
    TypeAdapter,
    ValidationError,
    field_validator,
    model_validator,
)

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.input import Data, message_of
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.outcome import OBJECTIVE_NAMES, Objective
from gaitswarm.sim.variables import VariableName, VariableValue

ALL: Final = "*"
"""All scenarios; all of f1 to f5."""

PUBLISHED: Final = "published:"
_JOB: Final = "job:"
"""Of references."""

_TEXT: Final = re.compile(
    r"(?:(?P<scenario>[^:<>=]+):)?(?P<quantity>[^:<>=]+)(?P<sign><=|>=)(?P<limit>[^<>=]+)"
)

FORM: Final = (
    "[SCENARIO:]QUANTITY<=LIMIT or >=LIMIT, such as speed>=0.05, slope-fast:speed>=0.03 or"
    " energy<=0.9*published:A"
)

ReferenceChoice = (
    Annotated[str, Field(min_length=1, max_length=200)]
    | Annotated[dict[VariableName, VariableValue], Field(min_length=1, max_length=128)]
)
"""`published:NAME`, a job's id, or a design."""

_DESIGN: Final = TypeAdapter(dict[VariableName, VariableValue])


def reference_choice(text: str) -> ReferenceChoice:
    """Return the reference of a text; a design is JSON. Raises ValueError."""
    if not text.lstrip().startswith("{"):
        return text.removeprefix(_JOB)
    try:
        return _DESIGN.validate_json(text)
    except ValidationError as error:
        raise ValueError(f"is no design: {message_of(error.errors()[0])}") from error


class Constraint(Data):
    """A limit on a quantity, in a scenario or in all."""

    quantity: str = Field(min_length=1, max_length=100, examples=["speed"])
    """Measurement or objective; `*`, with `relative_to`: each of f1 to f5."""
    scenario: str = Field(default=ALL, min_length=1, max_length=200, examples=["slope-fast"])
    """Name of a scenario, or `*` for each."""
    min: float | None = Field(default=None, examples=[0.05])
    """Least value, in the quantity's unit; with `relative_to`, as a multiple of the reference's
    value in the same scenario [1]."""
    max: float | None = Field(default=None, description="Greatest value, likewise.")
    relative_to: ReferenceChoice | None = Field(default=None, examples=["published:A"])
    """Reference: `published:NAME`, a published design of the controller; the id of a job, whose
    best design is meant; or a design by name of its variables."""
    reference: dict[str, dict[str, float]] | None = None
    """Values of the reference, by case and quantity; simulated at submission."""

    @field_validator("relative_to")
    @classmethod
    def _is_reference(cls, relative_to: ReferenceChoice | None) -> ReferenceChoice | None:
        return relative_to.removeprefix(_JOB) if isinstance(relative_to, str) else relative_to

    @model_validator(mode="after")
    def _limits(self) -> Self:
        if self.min is None and self.max is None:
            raise ValueError("has no limit; set min, max or both")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError(f"min: {self.min:g} exceeds max, which is {self.max:g}")
        if self.relative_to is None and self.reference is not None:
            raise ValueError("reference: requires relative_to")
        if self.relative_to is None and self.quantity == ALL:
            raise ValueError("quantity: * requires relative_to")
        return self

    @property
    def quantities(self) -> tuple[str, ...]:
        return OBJECTIVE_NAMES[:5] if self.quantity == ALL else (self.quantity,)

    def __str__(self) -> str:
        return " and ".join(self.texts())

    def texts(self) -> list[str]:
        """Return the limits in the form of `FORM`, except that a design has none."""
        where = "" if self.scenario == ALL else f"{self.scenario}:"
        to = "" if self.relative_to is None else "design"
        if isinstance(self.relative_to, str):
            prefix = "" if self.relative_to.startswith(PUBLISHED) else _JOB
            to = f"{prefix}{self.relative_to}"
        limits = []
        for sign, limit in ((">=", self.min), ("<=", self.max)):
            if limit is not None:
                factor = "" if to and limit == 1.0 else f"{limit:g}"
                times = "*" if to and factor else ""
                limits.append(f"{where}{self.quantity}{sign}{factor}{times}{to}")
        return limits


def _parsed(choice: object) -> object:
    """Convert text to a document; see `FORM`. Raises ValueError."""
    if not isinstance(choice, str):
        return choice
    match = _TEXT.fullmatch(choice.strip())
    if match is None:
        raise ValueError(f"{choice[:100]!r} is not {FORM}")
    text, reference = match["limit"].strip(), None
    if PUBLISHED in text or _JOB in text:
        factor, star, reference = text.partition("*")
        text, reference = (factor, reference.strip()) if star else ("1", text)
    try:
        limit = float(text)
    except ValueError:
        raise ValueError(f"{choice[:100]!r} is not {FORM}") from None
    document: dict[str, object] = {
        "quantity": match["quantity"].strip(),
        "min" if match["sign"] == ">=" else "max": limit,
    }
    if match["scenario"] is not None:
        document["scenario"] = match["scenario"].strip()
    return document if reference is None else document | {"relative_to": reference}


ConstraintChoice = Annotated[
    Constraint, BeforeValidator(_parsed, json_schema_input_type=Constraint | str)
]
"""A constraint, as an object or as text; see `FORM`."""

Constraints = Annotated[
    tuple[ConstraintChoice, ...],
    Field(
        max_length=100,
        description="Limits that a design must keep to be feasible, each an object or a text such"
        " as `speed>=0.05`, `slope-fast:speed>=0.03` or `energy<=0.9*published:A`. Any feasible"
        " design is better than every infeasible one; of these, the one of least violation is the"
        " best.",
        examples=[["speed>=0.05", {"quantity": "*", "relative_to": "published:A", "max": 1.0}]],
    ),
]


class Limit(NamedTuple):
    """A limit on one quantity in one case."""

    constraint: int  # index
    case: int  # index
    column: int  # index among the columns of a result
    sign: float  # 1: at most the bound; -1: at least
    bound: float


class Cases(NamedTuple):
    """Cases of a job, for its constraints: names, scenarios by case, columns of a result."""

    names: Sequence[str]
    scenarios: Sequence[str]
    columns: Sequence[Objective]

    def limited(self, constraint: Constraint) -> Iterator[tuple[int, int]]:
        """Yield the indices of the cases and columns that a constraint limits, at least one."""
        names = [column.name for column in self.columns]
        for quantity in constraint.quantities:
            if quantity not in names:
                raise ValueError(
                    f"quantity: unknown quantity {quantity!r}; {instead_of(quantity, names)}"
                )
        scenario = constraint.scenario
        if scenario not in (ALL, *self.scenarios):
            different = dict.fromkeys(self.scenarios)
            raise ValueError(
                f"scenario: the job has no scenario {scenario!r}; {instead_of(scenario, different)}"
            )
        cases = [k for k, name in enumerate(self.scenarios) if scenario in (ALL, name)]
        yield from product(cases, (names.index(quantity) for quantity in constraint.quantities))

    def limits(self, constraints: Sequence[Constraint], *, known: bool = True) -> list[Limit]:
        """Return limits by case and column; if not `known`, without those of unknown references.

        Raises ValueError, with the constraint's index, for unknown names, and for constraints that
        no design can meet together.
        """
        limits: list[Limit] = []
        for index, constraint in enumerate(constraints):
            try:
                for case, column in self.limited(constraint):
                    limits += self._of(constraint, index, case, column, known=known)
            except ValueError as error:
                raise ValueError(f"{index}.{error}") from error
        self._check_together(constraints, limits)
        return limits

    def _of(
        self, constraint: Constraint, index: int, case: int, column: int, *, known: bool
    ) -> Iterator[Limit]:
        name, where = self.columns[column].name, self.names[case]
        value: float | None = 1.0
        if constraint.relative_to is not None:
            value = (constraint.reference or {}).get(where, {}).get(name)
        if value is None and known:
            raise ValueError(f"reference: has no {name} in {where}")
        for sign, factor in ((-1.0, constraint.min), (1.0, constraint.max)):
            if factor is None or value is None:
                continue
            if value < 0.0 and factor != 1.0:
                raise ValueError(
                    f"relative_to: the reference's {name} in {where} is negative, {value:g}, of"
                    " which a multiple is no limit; set a limit in the quantity's unit"
                )
            yield Limit(index, case, column, sign, factor * value)

    def _check_together(self, constraints: Sequence[Constraint], limits: Sequence[Limit]) -> None:
        """Check that no least value exceeds the greatest one of another constraint."""
        least, greatest = dict[tuple[int, int], Limit](), dict[tuple[int, int], Limit]()
        for limit in limits:
            known = greatest if limit.sign > 0.0 else least
            other = known.setdefault((limit.case, limit.column), limit)
            if limit.sign * (limit.bound - other.bound) < 0.0:
                known[limit.case, limit.column] = limit
        for place, low in least.items():
            high = greatest.get(place, low)
            if low.bound > high.bound:
                first, last = sorted((low.constraint, high.constraint))
                name, unit = self.columns[low.column].name, self.columns[low.column].unit
                raise ValueError(
                    f"{last}: {constraints[last]} contradicts {constraints[first]}: in"
                    f" {self.names[low.case]} {name} would have to be at least"
                    f" {low.bound:.4g} {unit} and at most {high.bound:.4g} {unit}"
                )


def excesses(limits: Sequence[Limit], results: Floats) -> Floats:
    """Return by how much (n, K, m) raw results violate limits, as multiples, (limits, n)."""
    _, case, column, sign, bound = (np.array(part) for part in zip(*limits, strict=True))
    values = np.ascontiguousarray(results[:, case, column].T)
    scale = np.where(bound == 0.0, 1.0, np.abs(bound))[:, np.newaxis]
    excess = sign[:, np.newaxis] * (values - bound[:, np.newaxis]) / scale
    return np.where(np.isfinite(values), np.maximum(excess, 0.0), np.inf)


def violations(limits: Sequence[Limit], results: Floats) -> Floats:
    """Return each design's violation (n,): the sum of its excesses; 0 if it keeps all limits."""
    if not limits:
        return np.zeros(len(results))
    # Along the first axis, numpy adds sequentially.
    total: Floats = np.ascontiguousarray(excesses(limits, results)).sum(axis=0)
    return total


_INFEASIBLE: Final = 1e100
_LEAST, _LARGEST = 1e-15, 1e80


def feasible_first(fitness: Floats, violation: Floats) -> Floats:
    """Return numbers in the order of Deb's rules (n,), for searches that minimize one number.

    A feasible design has its fitness, an infeasible one its violation on a scale far beyond, and
    one without results +inf. Ratios of violations are kept, and squares do not overflow.

    fitness: (n,), +inf unless feasible. violation: (n,), +inf for a design without results.
    """
    infeasible = (violation > 0.0) & np.isfinite(violation)
    beyond = _INFEASIBLE * np.maximum(violation, _LEAST)
    # Fitness beyond 1e80 occurs under preferences of absurd exponents alone.
    feasible = np.where(np.isfinite(fitness), np.minimum(fitness, _LARGEST), np.inf)
    return np.where(infeasible, beyond, feasible)
