"""Bounds and constraints: what stands in the way of a design, and what could be widened"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.constraints import excesses
from gaitswarm.services.optimizer.jobs.iteration import Evaluation
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.views import DesignValues, IterationIndex, Particle, View
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.variables import Variable

End = Literal["low", "high"]

NEAR: Final = 0.01
"""Share of a variable's range within which a value lies at the bound [1]."""

_STEPS: Final = (0.5, 0.25, 0.1)
"""Shares of the range by which a bound may move; the first that can be simulated is used."""


class WidenedView(View):
    """Wider bounds for a variable whose best value lies at a bound."""

    low: float = Field(description="Lower bound, in the variable's unit.", examples=[500.0])
    high: float = Field(description="Upper bound.", examples=[14750.0])


def bound_at(variable: Variable, value: float) -> End | None:
    # Every value of a categorical variable, or of one of two integers, is at an end.
    span = variable.high - variable.low
    if variable.kind == "categorical" or (variable.kind == "integer" and span < 2):
        return None
    if value <= variable.low + NEAR * span:
        return "low"
    return "high" if value >= variable.high - NEAR * span else None


def with_wider_bounds(spec: Spec, variable: Variable, at: End) -> tuple[Spec, WidenedView | None]:
    """Return a job with the widest bounds of a variable that can be simulated, and these."""
    for low, high in _wider(variable, at) if isinstance(spec, JobSpec) else ():
        wider = variable.model_copy(update={"low": low, "high": high})
        chosen = [wider if v.name == variable.name else v for v in spec.design_space().variables]
        widened = spec.model_copy(update={"variables": tuple(chosen)})
        try:
            widened.check_can_be_simulated()
        except InvalidRequest:
            continue
        return widened, WidenedView(low=low, high=high)
    return spec, None


def _wider(variable: Variable, at: End) -> Iterator[tuple[float, float]]:
    low, high = variable.low, variable.high
    for step in _STEPS:
        further = step * (high - low)
        if variable.kind == "integer":
            further = max(1.0, round(further))
        if at == "high":
            yield low, _rounded(variable, high + further)
        # Positive variables stay positive.
        elif low <= 0.0 or low - further > 0.0:
            yield _rounded(variable, low - further), high
    if at == "low" and low > 0.0 and variable.kind != "integer":
        yield _rounded(variable, 0.5 * low), high


def _rounded(variable: Variable, bound: float) -> float:
    return bound if variable.kind == "integer" else float(f"{bound:.6g}")


_LISTED = 3
"""Violated limits in a sentence."""


class LimitView(View):
    """A limit on a quantity of one case, and a design's value."""

    constraint: str = Field(description="The constraint, as text.", examples=["speed>=0.05"])
    case: str = Field(description="Scenario, or world of one.", examples=["slope-fast"])
    quantity: str = Field(description="Name of the quantity.", examples=["speed"])
    unit: str = Field(description="Unit of value and limit.", examples=["m/s"])
    value: float = Field(description="Value of the design.", examples=[0.041])
    relation: Literal[">=", "<="] = Field(description="Side of the limit that is allowed.")
    limit: float = Field(description="The limit.", examples=[0.05])
    excess: float = Field(examples=[0.18])
    """By how much the value is beyond the limit, as a share of it; 0 if kept [1]."""

    def __str__(self) -> str:
        side = "at least" if self.relation == ">=" else "at most"
        value, limit = (f"{number:.4g} {self.unit}" for number in (self.value, self.limit))
        return f"{self.quantity} in {self.case} is {value} instead of {side} {limit}"


class ClosestView(View):
    """The design of least violation, while no design of a job is feasible."""

    iteration: IterationIndex
    particle: Particle
    design: DesignValues
    violation: float = Field(examples=[0.31])
    """Sum of its excesses over all limits [1]."""
    violated: list[LimitView] = Field(description="The limits that it violates, the worst first.")
    explanation: str = Field(
        description="The state in a sentence.",
        examples=["no feasible design yet; closest is 3.4, of violation 0.31: speed in ..."],
    )


def limit_views(spec: JobSpec, results: NDArray[np.float64]) -> list[LimitView]:
    """Return every limit of a job with the value of a design, given its (K, m) raw results."""
    limits = spec.limits()
    beyond = excesses(limits, results[np.newaxis])[:, 0].tolist() if limits else []
    return [
        LimitView(
            constraint=str(spec.constraints[limit.constraint]),
            case=spec.case_names[limit.case],
            quantity=spec.columns[limit.column].name,
            unit=spec.columns[limit.column].unit,
            value=float(results[limit.case, limit.column]),
            relation="<=" if limit.sign > 0.0 else ">=",
            limit=limit.bound,
            excess=excess,
        )
        for limit, excess in zip(limits, beyond, strict=True)
    ]


def closest(spec: Spec, evaluations: Sequence[Evaluation], *, ended: bool) -> ClosestView | None:
    """Return the design of least violation among those of an iteration; None if all failed."""
    if not isinstance(spec, JobSpec) or not spec.constraints or not evaluations:
        return None
    results = np.stack([evaluation.objectives for evaluation in evaluations])
    failed = np.stack([evaluation.statuses != Status.OK for evaluation in evaluations])
    violations = spec.violations(results, failed)
    if violations is None or not np.isfinite(violations).any():
        return None
    best, violation = evaluations[int(violations.argmin())], float(violations.min())
    limits = [limit for limit in limit_views(spec, best.objectives) if limit.excess > 0.0]
    limits.sort(key=lambda limit: -limit.excess)
    reasons = "; ".join(map(str, limits[:_LISTED]))
    if len(limits) > _LISTED:
        reasons += f"; and {len(limits) - _LISTED} further limits"
    if not limits:
        reasons = f"it keeps all limits in {spec.precision} precision only"
    head = "no design met the constraints" if ended else "no feasible design yet"
    return ClosestView(
        iteration=best.iteration,
        particle=best.particle,
        design=spec.design_space().shown(best.design.tolist()),
        violation=violation,
        violated=limits,
        explanation=f"{head}; closest is {best.iteration}.{best.particle}, of violation"
        f" {violation:.3g}: {reasons}",
    )
