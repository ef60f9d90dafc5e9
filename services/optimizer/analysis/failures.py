"""Failures of designs: statuses by case, with a design of each to replay"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import Field

from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.views import (
    IterationIndex,
    Particle,
    StatusName,
    View,
)
from gaitswarm.sim.outcome import Status


class StatusFailuresView(View):
    """Designs that end with one status in a case."""

    status: StatusName = Field(description="Status of their simulations.", examples=["fell"])
    reason: str = Field(description="The status in words, with a remedy.")
    designs: int = Field(description="Number of these designs.", examples=[12])
    iteration: IterationIndex
    particle: Particle


class CaseFailuresView(View):
    """Designs that fail in one case."""

    case: str = Field(description="Name of the scenario, world or walk.", examples=["loaded-fast"])
    failed: int = Field(description="Designs that fail in this case.", examples=[14])
    alone: int = Field(description="Designs that fail in this case alone.")
    statuses: list[StatusFailuresView]
    """Most frequent first, each with its latest design."""


class FailuresView(View):
    """Failures of a job's designs, by case."""

    designs: int = Field(description="Evaluated designs.", examples=[625])
    failed: int = Field(description="Designs that fail in at least one case.")
    recent: float | None
    """Share of failed designs in the latest quarter of the designs [1]; null without designs."""
    cases: list[CaseFailuresView] = Field(description="Cases with failures, most failures first.")


def failures(columns: EvaluationColumns, case_names: Sequence[str]) -> FailuresView:
    """Count the failures of designs by case and status."""
    failed = columns.failed
    of_designs = np.asarray(failed.any(axis=1))
    cases = []
    for case in np.argsort(-failed.sum(axis=0), kind="stable").tolist():
        statuses = columns.statuses[:, case]
        values, counts = np.unique(statuses[failed[:, case]], return_counts=True)
        if not len(values):
            break
        latest = {int(value): int(np.flatnonzero(statuses == value)[-1]) for value in values}
        cases.append(
            CaseFailuresView(
                case=case_names[case],
                failed=int(counts.sum()),
                alone=int((failed[:, case] & (failed.sum(axis=1) == 1)).sum()),
                statuses=[
                    StatusFailuresView(
                        status=Status(value).label,
                        reason=Status(value).phrase,
                        designs=count,
                        iteration=int(columns.iteration[latest[value]]),
                        particle=int(columns.particle[latest[value]]),
                    )
                    for count, value in sorted(
                        zip(counts.tolist(), values.tolist(), strict=True), reverse=True
                    )
                ],
            )
        )
    latest_quarter = of_designs[-max(1, len(columns) // 4) :]
    return FailuresView(
        designs=len(columns),
        failed=int(of_designs.sum()),
        recent=float(latest_quarter.mean()) if len(columns) else None,
        cases=cases,
    )
