"""How fast a job goes, and when it will end."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from services.optimizer.job import Job, JobState


@dataclass(frozen=True, slots=True)
class Estimate:
    """Rates so far, and the rest of the budget at that rate.

    eta_seconds: [s]; 0 for a job that succeeded, None unless it runs and has committed something.
    evaluations_per_second: designs judged [1/s]; simulations_per_second: walks, one per design and
        scenario [1/s]; None before the first commit.
    """

    eta_seconds: float | None
    evaluations_per_second: float | None
    simulations_per_second: float | None


def estimate(job: Job, now: datetime) -> Estimate:
    """now: aware; the iteration under way counts as done in part, by the time since the last one.

    Rates are over the time spent evaluating, so pauses and the time in the queue do not count.
    """
    progress = job.progress
    if progress.iterations == 0 or progress.compute_seconds <= 0.0:
        return Estimate(0.0 if job.state is JobState.SUCCEEDED else None, None, None)
    rate = progress.evaluations / progress.compute_seconds
    eta: float | None = None
    if job.state is JobState.SUCCEEDED:
        eta = 0.0
    elif job.state is JobState.RUNNING:
        one = progress.compute_seconds / progress.iterations
        remaining = max(0, job.spec.iterations - progress.iterations) * one
        under_way = min(one, max(0.0, (now - job.updated_at).total_seconds()))
        eta = max(0.0, remaining - under_way)
    return Estimate(eta, rate, rate * len(job.spec.trial_names))
