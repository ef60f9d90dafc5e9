"""Quota on one owner's unfinished jobs"""

from __future__ import annotations

from dataclasses import dataclass

from gaitswarm.services.optimizer.errors import QuotaExceeded


@dataclass(frozen=True, slots=True)
class Quota:
    """Limits on the unfinished jobs of one owner; jobs without an owner count together.

    A job is unfinished until it has succeeded, failed or been cancelled; its whole budget counts,
    whatever part of it has been spent.
    """

    jobs: int
    seconds: float  # simulated time of all their simulations [s]

    def check(self, jobs: int, seconds: float, *, new_jobs: int, new_seconds: float) -> None:
        """Raise QuotaExceeded if new jobs or simulated time exceed the limits."""
        if new_jobs and jobs + new_jobs > self.jobs:
            raise QuotaExceeded(
                f"{jobs} unfinished jobs of this owner reach the limit of {self.jobs};"
                " wait until one ends, cancel one, or ask an admin"
            )
        if new_seconds > 0.0 and seconds + new_seconds > self.seconds:
            raise QuotaExceeded(
                f"the unfinished jobs of this owner take {seconds:.3g} simulated s, with this one"
                f" {seconds + new_seconds:.3g} s; the limit is {self.seconds:.3g} s. Use fewer"
                " iterations, wait until a job ends, cancel one, or ask an admin",
                field="iterations",
            )
