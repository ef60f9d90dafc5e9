"""Whether the histories of all jobs of a database are what was committed."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Final

from gaitswarm.services.optimizer.analysis.verification import check_history
from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.store.port.base import Store

_MOST: Final = 20
"""Findings; what comes after them is not looked at."""


def check_histories(store: Store) -> list[str]:
    """Compute the chain of every job again from its rows, by pieces, one job after the other.

    Jobs may run meanwhile: what they commit after they were read is left out.
    """
    return list(islice(_broken(store), _MOST))


def _broken(store: Store) -> Iterator[str]:
    for job_id in _ids(store):
        try:
            job = store.job(job_id)
            problem = _problem(store, job)
            if problem:
                # Rows of a job that is deleted meanwhile go piece by piece.
                store.job(job_id)
                yield f"job {job_id} is not what was committed: {problem}"
        except NotFound:
            continue


def _ids(store: Store) -> Iterator[str]:
    after: str | None = None
    while True:
        page = store.jobs(after=after)
        yield from (job.id for job in page.items)
        if page.next is None:
            return
        after = page.next


def _problem(store: Store, job: Job) -> str:
    found = check_history(store, job)
    where = "" if found.broken_at is None else f"iteration {found.broken_at}: "
    return f"{where}{found.problem}" if found.problem else ""
