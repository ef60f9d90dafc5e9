"""How urgent a job is: which one waits for a runner the shortest, and whose walks get more slots.

Priorities decide when walks run, never what comes of them. They are no part of specs, of provenance
or of the chain, so that a job has the same bits under any.
"""

from __future__ import annotations

from typing import Final

from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest
from gaitswarm.services.optimizer.jobs.job import JobState

DEFAULT: Final = 0
"""Of a job for which nobody has said more."""

LOWEST: Final = -10
HIGHEST: Final = 10


def check_priority(priority: int) -> None:
    """Refuse what is no priority."""
    if not LOWEST <= priority <= HIGHEST:
        raise InvalidRequest(
            f"must be from {LOWEST} (last) to {HIGHEST} (first), it is {priority}",
            field="priority",
        )


def check_can_be_prioritized(state: JobState) -> None:
    """Refuse another priority for a job that neither waits nor runs."""
    if state.terminal:
        raise Conflict(f"cannot prioritize a job that is {state}; it has ended")


def weight(priority: int) -> float:
    """The weight with which running jobs share slots: each step up doubles it."""
    return 2.0**priority
