"""Whole histories of jobs, piece by piece as they are consumed, each piece a short transaction."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from operator import attrgetter
from typing import Final

from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, Iteration
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.store.port.base import Store

PIECE: Final = 2000
"""Evaluations read in one transaction."""

_PIECE_ITERATIONS: Final = 16


def read_history(
    store: Store, job_id: str, *, after: int | None
) -> Iterator[tuple[Iteration, tuple[Evaluation, ...]]]:
    """Read committed iterations with their particles, piece by piece as they are consumed."""
    while True:
        page = store.iterations(job_id, after=after, limit=_PIECE_ITERATIONS)
        if page.items:
            first, last = page.items[0].index, page.items[-1].index
            found = store.evaluations_between(job_id, first, last + 1)
            by_iteration = {k: tuple(g) for k, g in groupby(found, key=attrgetter("iteration"))}
            for iteration in page.items:
                yield iteration, by_iteration.get(iteration.index, ())
            after = last
        if page.next is None:
            return


def read_columns(store: Store, job: Job, *, rows: int) -> Iterator[EvaluationColumns]:
    """Read a job's evaluations as columns, piece by piece as they are consumed."""
    step = iterations_of(rows, job)
    for first in range(0, job.progress.iterations, step):
        piece = store.evaluation_columns(job.id, first, min(first + step, job.progress.iterations))
        if piece is not None:
            yield piece


def iterations_of(rows: int, job: Job) -> int:
    """Say how many iterations of a job have so many evaluations on average."""
    progress = job.progress
    return max(1, rows * progress.iterations // max(1, progress.evaluations))
