"""A job that begins with iterations of another one: what is asked for, and what it came from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.documents import AnySpec, checked_spec
from gaitswarm.services.optimizer.jobs.optimizer_choice import OptimizerChoice
from gaitswarm.services.optimizer.jobs.preference import PreferenceChoice
from gaitswarm.services.optimizer.jobs.provenance import ProvenanceRecords
from gaitswarm.sim.robot import RobotSource
from gaitswarm.sim.scenario import ScenarioChoice

_LAID: Final = ("name", "preference", "optimizer", "scenarios", "robot", "iterations")
"""Fields of a request that are those of a spec."""

_FREE: Final = frozenset({"name", "iterations"})
"""Fields of a spec that may differ without a word: the search goes on as it would."""


class ForkRequest(BaseModel):
    """From where a job is forked, and what is to be different from there on."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    from_iteration: int = Field(
        ge=1,
        description="First iteration that is the fork's own, counted from 0 as everywhere: it"
        " begins with those before it, 0 to `from_iteration` - 1.",
        examples=[10],
    )
    name: Annotated[str, Field(max_length=200)] | None = Field(
        default=None, description="For people; null: the parent's."
    )
    preference: PreferenceChoice | None = Field(
        default=None, description="How objectives are weighed; null: as in the parent."
    )
    optimizer: OptimizerChoice | None = Field(
        default=None, description="Search method and its settings; null: the parent's."
    )
    particles: Annotated[int, Field(ge=1, le=10_000)] | None = Field(
        default=None,
        description="Designs of one iteration, at most, in place of the optimizer's [1].",
    )
    scenarios: tuple[ScenarioChoice, ...] | None = Field(
        default=None,
        min_length=1,
        max_length=32,
        description="Walks in which every design is judged; null: the parent's.",
    )
    robot: RobotSource | None = Field(
        default=None, description="Robot to simulate; null: the parent's."
    )
    iterations: Annotated[int, Field(ge=1, le=1_000_000)] | None = Field(
        default=None,
        description="Budget in all, with the iterations that it begins with; null: the parent's.",
    )
    start_count: int = Field(
        default=5,
        ge=1,
        le=10_000,
        description="Where the search cannot be taken over: how many of the parent's best designs"
        " the fork starts from, at most [1].",
    )
    accept_changes: bool = Field(
        default=False,
        description="Whether it goes on with the parent's iterations although what its numbers"
        " depend on has changed since, which is then recorded in its `provenance`.",
    )


class Lineage(BaseModel):
    """Where a forked job comes from."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    parent: str = Field(
        description="Identifier of the job that it was forked from, which may be gone by now.",
        examples=["k2q7zr5dm9xw"],
    )
    from_iteration: int = Field(
        ge=1,
        description="First iteration of the parent that it does without, counted from 0.",
        examples=[10],
    )
    carried: Literal["search", "designs"] = Field(
        description="What it took over: `search`, the iterations before with the state of the"
        " search, so that it goes on where the parent was; or `designs`, the best designs of those"
        " iterations, from which a new search starts.",
        examples=["search"],
    )
    changed: tuple[str, ...] = Field(
        default=(),
        description="Fields of the spec that are not the parent's.",
        examples=[["preference"]],
    )
    reason: str = Field(
        default="", description="Why only designs were taken over; empty if the search was."
    )
    evaluations: int = Field(
        default=0, ge=0, description="Evaluations that it took over [1].", examples=[250]
    )
    budgets: tuple[int, ...] = Field(
        default=(),
        description="Budgets, in iterations, under which what it took over was asked for.",
        examples=[[25]],
    )
    digest: str | None = Field(
        default=None,
        description="Of the parent's last iteration before that one, which is chained to all before"
        " it; null if the parent's history is not chained.",
    )

    @property
    def own_from(self) -> int:
        """Index of the fork's first iteration that was not taken over."""
        return self.from_iteration if self.carried == "search" else 0


@dataclass(frozen=True, slots=True, eq=False)
class TakenHistory:
    """What a fork takes over beside its parent's rows.

    Attributes:
        state: The optimizer's dump after the last ask that is taken over.
        fitness: (n,) of each iteration, where it is judged anew; None: as it is.
        provenance: What the numbers depend on, since which iteration.
        accepts_changes: Whether the fork goes on although that has changed.
    """

    state: dict[str, Any]
    fitness: tuple[NDArray[np.float64], ...] | None
    provenance: ProvenanceRecords
    accepts_changes: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Fork:
    """How a job is stored that is forked from another one.

    Attributes:
        lineage: Where it comes from.
        taken: What it takes over; None where it starts from designs.
    """

    lineage: Lineage
    taken: TakenHistory | None = None


def forked_spec(parent: AnySpec, request: ForkRequest) -> AnySpec:
    """The spec of a fork, resolved."""
    changes = {name: getattr(request, name) for name in _LAID}
    changes = {name: value for name, value in changes.items() if value is not None}
    if request.particles is not None:
        settings = changes.get("optimizer", parent.optimizer)
        changes["optimizer"] = settings.model_dump() | {"particles": request.particles}
    for name in changes:
        if name not in type(parent).model_fields:
            raise InvalidRequest(f"a job of the kind {parent.kind} has none", field=name)
    return checked_spec(parent, changes).resolved()


def changed_fields(parent: AnySpec, fork: AnySpec) -> tuple[str, ...]:
    """What is different of a fork, but for its name and budget."""
    names = (name for name in type(parent).model_fields if name not in _FREE)
    return tuple(name for name in names if getattr(parent, name) != getattr(fork, name))
