"""Rates of a job, and how long it will take yet."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from typing import Final

from gaitswarm.services.optimizer.jobs.job import Job, JobState

_WEIGHT: Final = 0.3
"""Of the last iteration, against all before."""

_LATE: Final = 2.0
"""How many times as long as the last iterations one takes that is said to be late."""


@dataclass(frozen=True, slots=True)
class TimeLeft:
    """Rates so far, and the rest of the budget at the pace of the last iterations.

    Attributes:
        eta_seconds: time to the end of the budget [s]; 0 for a job that succeeded, None unless it
            runs, waits for nothing and has committed something.
        evaluations_per_second: designs judged [1/s]; None before the first commit.
        simulations_per_second: walks, one per case and design that was not known [1/s]; None before
            the first commit, and where the spec cannot be read.
        basis: what `eta_seconds` is derived from, or why it is not known, for people.
    """

    eta_seconds: float | None
    evaluations_per_second: float | None
    simulations_per_second: float | None
    basis: str = field(default="", compare=False)


def recent_pace(before: float | None, latest: float) -> float:
    """The pace of a job when another iteration has ended."""
    return latest if before is None else (1.0 - _WEIGHT) * before + _WEIGHT * latest


def time_left(job: Job, now: datetime) -> TimeLeft:
    """Estimate when a job ends, from its own committed iterations.

    Rates are over the time spent evaluating, so pauses and the time in the queue do not count.
    """
    progress = job.progress
    nothing_known = job.own_evaluations == 0 or progress.compute_seconds <= 0.0
    eta, basis = _without_pace(job, nothing_known=nothing_known)
    if nothing_known:
        return TimeLeft(eta, None, None, basis)
    if not basis:
        eta, basis = _by_pace(job, now)
    walked = progress.evaluations_walked / progress.compute_seconds
    return TimeLeft(
        eta,
        job.own_evaluations / progress.compute_seconds,
        walked * len(job.spec.case_names) if job.readable else None,
        basis,
    )


def _without_pace(job: Job, *, nothing_known: bool) -> tuple[float | None, str]:
    """What is known without any pace, and why; no reason if a pace is all that it takes."""
    if job.state is JobState.SUCCEEDED:
        return 0.0, "it has ended"
    if job.state is not JobState.RUNNING:
        return None, f"not known of a job that is {job.state}"
    if job.waiting is not None:
        return None, "not known while it waits"
    if not job.readable:
        return None, "not known, as its spec cannot be read"
    if nothing_known:
        return None, "not known before its first iteration is committed"
    return None, ""


def _by_pace(job: Job, now: datetime) -> tuple[float, str]:
    progress = job.progress
    average = progress.compute_seconds / job.own_evaluations
    pace = average if progress.recent_seconds is None else progress.recent_seconds
    own = progress.iterations - (job.lineage.own_from if job.lineage else 0)
    one = pace * job.own_evaluations / own
    since = max(0.0, (now - job.updated_at).total_seconds())
    remaining = max(0, job.spec.budget - progress.evaluations) * pace
    basis = f"at the pace of its last iterations, {one:.3g} s each"
    if since > _LATE * one and remaining > 0.0:
        basis += f"; the one under way has taken {since:.3g} s"
    return max(0.0, remaining - min(one, since)), basis
