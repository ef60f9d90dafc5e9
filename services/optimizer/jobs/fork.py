"""Forks: the request, the lineage, and the history taken over"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.constraints import Constraints
from gaitswarm.services.optimizer.jobs.documents import AnySpec, checked_spec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import (
    ScenarioAggregate,
    ScenarioWeights,
    other_measure,
)
from gaitswarm.services.optimizer.jobs.preference import PreferenceChoice
from gaitswarm.services.optimizer.jobs.provenance import ProvenanceRecords
from gaitswarm.services.optimizer.jobs.spec import OptimizerChoice
from gaitswarm.sim.input import Line
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.robot import RobotSource
from gaitswarm.sim.scenario import ScenarioChoice
from gaitswarm.sim.variables import VariableName

_SPEC_FIELDS: Final = (
    *("name", "preference", "constraints", "scenario_weights", "scenario_aggregate"),
    *("optimizer", "scenarios", "robot", "iterations"),
)
"""Fields of a request that are also fields of a spec."""

_FREE: Final = frozenset({"name", "iterations", "start"})
"""Fields of a spec that no lineage lists as changed."""


class ForkRequest(BaseModel):
    """The iteration at which to fork a job, and the changes from there on."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    from_iteration: int = Field(
        ge=1,
        description="First iteration that the fork runs itself, counted from 0: it takes over"
        " iterations 0 to `from_iteration` - 1.",
        examples=[10],
    )
    name: Annotated[Line, Field(max_length=200)] | None = Field(
        default=None, description="Display name; null: the parent's."
    )
    preference: PreferenceChoice | None = Field(
        default=None, description="Weights of the objectives; null: the parent's."
    )
    constraints: Constraints | None = Field(
        default=None,
        description="Limits that a design must keep, as in a spec; null: the parent's.",
        examples=[["speed>=0.05"]],
    )
    scenario_weights: ScenarioWeights | None = Field(
        default=None, description="As in a spec; null: the parent's."
    )
    scenario_aggregate: ScenarioAggregate | None = Field(
        default=None, description="As in a spec; null: the parent's."
    )
    optimizer: OptimizerChoice | None = Field(
        default=None, description="Search method and its settings; null: the parent's."
    )
    particles: Annotated[int, Field(ge=1, le=10_000)] | None = Field(
        default=None,
        description="Maximum number of designs per iteration; overrides the optimizer's [1].",
    )
    scenarios: tuple[ScenarioChoice, ...] | None = Field(
        default=None,
        min_length=1,
        max_length=32,
        description="Scenarios in which every design is simulated; null: the parent's.",
    )
    robot: RobotSource | None = Field(
        default=None, description="Robot to simulate; null: the parent's."
    )
    bounds: dict[VariableName, tuple[FiniteFloat, FiniteFloat]] = Field(
        default_factory=dict,
        max_length=128,
        description="Lower and upper bounds of searched variables, by name, in their units; those"
        " of the parent for all others.",
        examples=[{"FI1R": [1500.0, 8250.0]}],
    )
    iterations: Annotated[int, Field(ge=1, le=1_000_000)] | None = Field(
        default=None,
        description="Total budget, including the iterations taken over; null: the parent's.",
    )
    start_count: int = Field(
        default=5,
        ge=1,
        le=10_000,
        description="Maximum number of the parent's best designs to start from, if the search"
        " state cannot be taken over [1].",
    )
    accept_changes: bool = Field(
        default=False,
        description="Continue from the parent's iterations even if code or libraries have changed"
        " since; the change is recorded in the fork's `provenance`.",
    )


class Lineage(BaseModel):
    """Origin of a forked job."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    parent: str = Field(
        description="Identifier of the parent job, which may have been deleted since.",
        examples=["k2q7zr5dm9xw"],
    )
    from_iteration: int = Field(
        ge=1,
        description="First iteration of the parent that was not taken over, counted from 0.",
        examples=[10],
    )
    carried: Literal["search", "designs"] = Field(
        description="What was taken over: `search`, the earlier iterations and the state of the"
        " search, which continues from there; or `designs`, the best designs of those iterations,"
        " from which a new search starts.",
        examples=["search"],
    )
    changed: tuple[str, ...] = Field(
        default=(),
        description="Fields of the spec that differ from the parent's.",
        examples=[["preference"]],
    )
    reason: str = Field(
        default="",
        description="Why the search was not taken over; empty if it was.",
    )
    evaluations: int = Field(
        default=0, ge=0, description="Number of evaluations taken over [1].", examples=[250]
    )
    budgets: tuple[int, ...] = Field(
        default=(),
        description="Budgets, in iterations, under which the iterations taken over were run.",
        examples=[[25]],
    )
    digest: str | None = Field(
        default=None,
        description="Chained digest of the parent's last iteration taken over; null if the"
        " parent's history is not chained.",
    )

    @property
    def own_from(self) -> int:
        """Index of the first iteration that was not taken over."""
        return self.from_iteration if self.carried == "search" else 0


class TakenHistory(NamedTuple):
    """What a fork takes over besides its parent's rows."""

    state: dict[str, Any]  # the optimizer's dump after the last ask taken over
    # (n,) of each iteration if rejudged; None: unchanged
    fitness: tuple[NDArray[np.float64], ...] | None
    provenance: ProvenanceRecords
    accepts_changes: bool = False  # whether the fork continues under another provenance


class Fork(NamedTuple):
    """Origin of a forked job, as stored."""

    lineage: Lineage
    taken: TakenHistory | None = None  # None if the fork starts from designs


def forked_spec(parent: AnySpec, request: ForkRequest) -> AnySpec:
    """Return the spec of a fork, resolved."""
    changes = other_measure({name: getattr(request, name) for name in _SPEC_FIELDS})
    if request.bounds:
        # Start designs may lie outside; the best designs replace them.
        changes |= {"variables": _within(parent, request.bounds), "start": ()}
    if request.particles is not None:
        settings = changes.get("optimizer", parent.optimizer)
        changes["optimizer"] = settings.model_dump() | {"particles": request.particles}
    for name in changes:
        if name not in type(parent).model_fields:
            raise InvalidRequest(f"a job of kind {parent.kind} has no such field", field=name)
    return checked_spec(parent, changes).resolved()


def _within(
    parent: AnySpec, bounds: Mapping[str, tuple[float, float]]
) -> tuple[dict[str, Any], ...]:
    """Return the parent's variables within other bounds."""
    variables = {variable.name: variable for variable in parent.design_space().variables}
    for name, (low, high) in bounds.items():
        if name not in variables:
            text = f"the job does not search {name!r}; {instead_of(name, variables)}"
            raise InvalidRequest(text, field="bounds")
        if variables[name].kind == "categorical" or not low < high:
            text = "is categorical" if low < high else f"{low:g} is not less than {high:g}"
            raise InvalidRequest(text, field=f"bounds.{name}")
        variables[name] = variables[name].model_copy(update={"low": low, "high": high})
    return tuple(variable.model_dump() for variable in variables.values())


def changed_fields(parent: AnySpec, fork: AnySpec) -> tuple[str, ...]:
    """Return the fields that differ, except name, budget and start."""
    names = (name for name in type(parent).model_fields if name not in _FREE)
    return tuple(name for name in names if getattr(parent, name) != getattr(fork, name))
