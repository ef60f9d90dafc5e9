"""What is new of a job in a database, told once."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from gaitswarm.jobs.port import JobEvent
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.views import IterationView, StateView

PAGE: Final = 100
"""Items that are read at once."""


class JobNews:
    """What has been told of a job, and what is new.

    Attributes:
        ended: Whether the job has ended, so that nothing more is to come.
    """

    def __init__(self, service: JobService, job_id: str, after: int | None) -> None:
        self.ended = False
        self._service = service
        self._job_id = job_id
        self._after = after
        self._told: tuple[JobState, str | None] | None = None

    def poll(self) -> Iterator[JobEvent]:
        """Iterations that were committed since the last time, then the state if there is news."""
        # The job first: whatever it counts as committed is then among the iterations.
        job = self._service.job(self._job_id)
        more = True
        while more:
            page = self._service.iterations(self._job_id, after=self._after, limit=PAGE)
            for iteration in page.items:
                self._after = iteration.index
                yield IterationView.from_iteration(iteration)
            more = page.next is not None
        if (job.state, job.waiting) != self._told:
            self._told = (job.state, job.waiting)
            yield StateView.from_job(job)
        if job.state.terminal:
            self._service.store.verify()
            self.ended = True
