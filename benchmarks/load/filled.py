"""A store of a million evaluations: long jobs, and many short ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from benchmarks.large_store import PARTICLES, fill
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.job import Command, JobState
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store.port.base import Store

LONG: Final = 100_000
"""Evaluations of the longest job."""

_FORK: Final = 25_000
"""Evaluations of each other long job."""


def fill_with(
    store: Store, evaluations: int, *, jobs: int, say: Callable[[str], None] = lambda _: None
) -> None:
    """Write a job of a tenth of the evaluations, short jobs, and forks that have the others.

    The long job is committed iteration by iteration, as a runner does. The forks take over its
    first quarter. All that has not ended is paused.

    Args:
        store: An empty one.
        evaluations: In all; those of the short jobs come on top.
        jobs: How many short jobs there are, and the long one.
        say: Told how far it is.
    """
    longest = evaluations * LONG // 1_000_000 // PARTICLES
    parent = fill(store, jobs=jobs, iterations=longest)
    # A runner is to find nothing in the queue but the job that is measured.
    while queued := store.jobs(state=JobState.QUEUED, limit=1000).items:
        for job in queued:
            store.command(job.id, Command.PAUSE)
    say(f"a job of {longest * PARTICLES} evaluations, {jobs - 1} short ones")
    service = JobService(store)
    taken = longest * _FORK // LONG
    for number in range((evaluations - longest * PARTICLES) // (taken * PARTICLES)):
        request = ForkRequest(from_iteration=taken, name=f"fork {number:02d}", accept_changes=True)
        fork, _ = service.fork(parent, request)
        store.command(fork.id, Command.PAUSE)
        say(f"fork {number + 1} of {taken * PARTICLES} evaluations")
