"""Estimates of a job's cost: before submission, and to its end by the pace of its iterations"""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from typing import Final

from pydantic import Field

from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.views import View

_WEIGHT: Final = 0.3
"""Weight of the last iteration in the moving average."""

_LATE: Final = 2.0
"""An iteration is reported as late beyond this multiple of the recent duration."""


class EstimateView(View):
    """Estimated cost of a job."""

    evaluations: int = Field(description="Designs that are judged [1].", examples=[625])
    walks: int = Field(description="Each design in each scenario [1].", examples=[3750])
    simulated_seconds: float = Field(examples=[20250.0])
    """Simulated time in total [s]; less for designs that fall."""
    seconds: float | None = Field(examples=[21.5])
    """Wall time if it has the machine to itself [s]; null if unknown."""
    basis: str = Field(
        description="Basis of the estimate.",
        examples=[
            "a simulation measured on this machine, 471 simulated s/s, on all of its 2 cores"
        ],
    )


@dataclass(frozen=True, slots=True)
class TimeLeft:
    """Rates so far, and the time to the end of the budget at the recent pace."""

    # [s]; 0 for a job that succeeded, None unless it is running, waits for nothing and has
    # committed an iteration
    eta_seconds: float | None
    evaluations_per_second: float | None  # [1/s]; None before the first commit
    # simulations that were not cached [1/s]; None before the first commit or if the spec is
    # unreadable
    simulations_per_second: float | None
    # what `eta_seconds` is derived from, or why it is unknown, for people
    basis: str = field(default="", compare=False)


def recent_pace(before: float | None, latest: float) -> float:
    """Update the moving average of the time per design."""
    return latest if before is None else (1.0 - _WEIGHT) * before + _WEIGHT * latest


def time_left(job: Job, now: datetime) -> TimeLeft:
    """Estimate a job's end from its committed iterations."""
    progress = job.progress
    rated = job.own_evaluations > 0 and progress.compute_seconds > 0.0
    eta: float | None = None
    if job.state is JobState.SUCCEEDED:
        eta, basis = 0.0, "the job has ended"
    elif job.state is not JobState.RUNNING:
        basis = f"unknown: the job is {job.state}"
    elif job.waiting is not None:
        basis = "unknown while the job waits"
    elif not job.readable:
        basis = "unknown: the job's spec cannot be read"
    elif not rated:
        basis = "unknown until the first iteration is committed"
    else:
        eta, basis = _by_pace(job, now)
    if not rated:
        return TimeLeft(eta, None, None, basis)
    walked = progress.evaluations_walked / progress.compute_seconds
    return TimeLeft(
        eta,
        job.own_evaluations / progress.compute_seconds,
        walked * len(job.spec.case_names) if job.readable else None,
        basis,
    )


def _by_pace(job: Job, now: datetime) -> tuple[float, str]:
    progress = job.progress
    average = progress.compute_seconds / job.own_evaluations
    pace = average if progress.recent_seconds is None else progress.recent_seconds
    iterations = progress.iterations - (job.lineage.own_from if job.lineage else 0)
    one_iteration = pace * job.own_evaluations / iterations
    since = max(0.0, (now - job.updated_at).total_seconds())
    remaining = max(0, job.spec.budget - progress.evaluations) * pace
    basis = f"at the pace of the last iterations, {one_iteration:.3g} s each"
    if since > _LATE * one_iteration and remaining > 0.0:
        basis += f"; the current one has taken {since:.3g} s"
    return max(0.0, remaining - min(one_iteration, since)), basis
