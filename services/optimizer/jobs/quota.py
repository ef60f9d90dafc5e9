"""How much of the service one owner may have waiting or running at a time."""

from __future__ import annotations

from dataclasses import dataclass

from gaitswarm.services.optimizer.errors import QuotaExceeded


@dataclass(frozen=True, slots=True)
class Quota:
    """What the unfinished jobs of one owner may come to; those without an owner count together.

    A job is unfinished until it has succeeded, failed or been cancelled; it counts with the whole
    of its budget, however much of that it has walked.

    Attributes:
        jobs: how many there may be.
        seconds: simulated time of all their walks [s].
    """

    jobs: int
    seconds: float

    def check(self, jobs: int, seconds: float, *, new_jobs: int, new_seconds: float) -> None:
        """Refuse what would be too much."""
        if new_jobs and jobs + new_jobs > self.jobs:
            raise QuotaExceeded(
                f"there are {jobs} unfinished jobs of this owner, and there may be {self.jobs};"
                " wait until one ends, cancel one, or ask an admin"
            )
        if new_seconds > 0.0 and seconds + new_seconds > self.seconds:
            raise QuotaExceeded(
                f"the unfinished jobs of this owner walk {seconds:.3g} simulated s together, with"
                f" this one {seconds + new_seconds:.3g} s, and may walk {self.seconds:.3g} s; give"
                " it fewer iterations, wait until a job ends, cancel one, or ask an admin",
                field="iterations",
            )
