"""Priorities of jobs

They decide the order in which jobs are claimed and the share of slots that their simulations get.
Results do not depend on them, so they are not part of specs, provenance or the chain.
"""

from __future__ import annotations

from typing import Final

from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest
from gaitswarm.services.optimizer.jobs.job import JobState

DEFAULT: Final = 0

LOWEST: Final = -10
HIGHEST: Final = 10


def check_priority(priority: int) -> None:
    """Check that a priority is within bounds."""
    if not LOWEST <= priority <= HIGHEST:
        raise InvalidRequest(
            f"must be from {LOWEST} (last) to {HIGHEST} (first), it is {priority}",
            field="priority",
        )


def check_can_be_prioritized(state: JobState) -> None:
    """Check that a job has not ended."""
    if state.terminal:
        raise Conflict(f"cannot prioritize a job that is {state}; it has ended")


def weight(priority: int) -> float:
    """Return the weight by which running jobs share slots; it doubles with each step."""
    return 2.0**priority
