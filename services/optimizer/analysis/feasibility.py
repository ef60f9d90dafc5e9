"""Constraints of a job, judged for single designs: values, limits, and what stands in the way"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.jobs.constraints import excesses
from gaitswarm.services.optimizer.jobs.iteration import Evaluation
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.views import DesignValues, IterationIndex, Particle, View
from gaitswarm.sim.outcome import Status

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
    excess: float = Field(
        description="By how much the value is beyond the limit, as a share of it; 0 if kept [1].",
        examples=[0.18],
    )

    def __str__(self) -> str:
        side = "at least" if self.relation == ">=" else "at most"
        return (
            f"{self.quantity} in {self.case} is {self.value:.4g} {self.unit} instead of {side}"
            f" {self.limit:.4g} {self.unit}"
        )


class ClosestView(View):
    """The design of least violation, while no design of a job is feasible."""

    iteration: IterationIndex
    particle: Particle
    design: DesignValues
    violation: float = Field(
        description="Sum of its excesses over all limits [1].", examples=[0.31]
    )
    violated: list[LimitView] = Field(description="The limits that it violates, the worst first.")
    explanation: str = Field(
        description="The state in a sentence.",
        examples=["no feasible design yet; closest is 3.4, of violation 0.31: speed in ..."],
    )


def limit_views(spec: JobSpec, results: NDArray[np.float64]) -> list[LimitView]:
    """Return every limit of a job with the value of a design, given its (K, m) raw results."""
    limits = spec.limits()
    if not limits:
        return []
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
        for limit, excess in zip(
            limits, excesses(limits, results[np.newaxis])[:, 0].tolist(), strict=True
        )
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
    best = evaluations[int(violations.argmin())]
    limits = [limit for limit in limit_views(spec, best.objectives) if limit.excess > 0.0]
    limits.sort(key=lambda limit: -limit.excess)
    violation = float(violations.min())
    place = f"{best.iteration}.{best.particle}"
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
        explanation=f"{head}; closest is {place}, of violation {violation:.3g}: {reasons}",
    )
