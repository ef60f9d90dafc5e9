"""Jobs in a database that this process opens itself."""

from __future__ import annotations

import shlex
import time
from collections.abc import Iterator, Sequence
from itertools import islice
from types import TracebackType
from typing import Final, Self

from gaitswarm.settings import default_database
from gaitswarm.tables import TableFormat, encoded_table
from gaitswarm.views import (
    BestView,
    HistoryIterationView,
    IterationView,
    JobSummaryView,
    JobView,
    RankingRequest,
    RankingView,
    StateView,
)
from gaitswarm.views.identification import IdentifiabilityView, RecordingView
from services.optimizer.errors import NotFound
from services.optimizer.jobs.job import Command, Job, JobOrder, JobState
from services.optimizer.jobs.spec import Spec
from services.optimizer.service import JobService
from sim.identification.recorded_walk import RecordedWalk

_POLL_SECONDS: Final = 0.5
_PAGE: Final = 100


class LocalJobs:
    """`Jobs` through a JobService. Owns its store."""

    def __init__(self, service: JobService, url: str) -> None:
        self._service = service
        # The default goes without saying.
        self.place = "" if url == str(default_database()) else f" --db {shlex.quote(url)}"

    def submit(self, spec: Spec, *, idempotency_key: str | None = None) -> JobView:
        """See `Jobs.submit`."""
        job, _ = self._service.submit(spec, idempotency_key=idempotency_key)
        return self._in_full(job)

    def jobs(
        self, *, state: JobState | None, search: str, order: JobOrder, limit: int
    ) -> Iterator[JobSummaryView]:
        """See `Jobs.jobs`."""
        found = islice(self._all(state, search, order), limit)
        return (JobSummaryView.from_job(job) for job in found)

    def job(self, job_id: str) -> JobView:
        """See `Jobs.job`."""
        return self._in_full(self._service.job(job_id))

    def command(self, job_id: str, command: Command, *, accept_changes: bool = False) -> JobView:
        """See `Jobs.command`."""
        return self._in_full(self._service.command(job_id, command, accept_changes=accept_changes))

    def extend(self, job_id: str, iterations: int) -> JobView:
        """See `Jobs.extend`."""
        return self._in_full(self._service.extend(job_id, iterations))

    def ranking(self, job_id: str, request: RankingRequest) -> RankingView:
        """See `Jobs.ranking`."""
        job = self._service.job(job_id)
        ranked = self._service.rank(job, request.resolved_preference(), top=request.top)
        return RankingView.from_ranked_job(request, ranked)

    def best(self, job_id: str) -> BestView:
        """See `Jobs.best`."""
        job = self._service.job(job_id)
        best = self._service.best(job_id)
        if best is None:
            raise NotFound(f"job {job_id} has no design yet that walks in every scenario")
        return BestView.from_evaluation(best, job.spec)

    def iterations(self, job_id: str) -> Iterator[IterationView]:
        """See `Jobs.iterations`."""
        yield from self._iterations_after(job_id, None)

    def history(self, job_id: str) -> Iterator[HistoryIterationView]:
        """See `Jobs.history`."""
        spec = self._service.job(job_id).spec
        for iteration, evaluations in self._service.history(job_id):
            yield HistoryIterationView.from_iteration_and_evaluations(iteration, evaluations, spec)

    def follow(self, job_id: str) -> Iterator[IterationView | StateView]:
        """See `Jobs.follow`."""
        told: JobState | None = None
        after: int | None = None
        while True:
            # The job first: whatever it counts as committed is then among the iterations.
            job = self._service.job(job_id)
            for iteration in self._iterations_after(job_id, after):
                after = iteration.index
                yield iteration
            if job.state is not told:
                told = job.state
                yield StateView.from_job(job)
            if job.state.terminal:
                return
            time.sleep(_POLL_SECONDS)

    def record(self, walk: RecordedWalk) -> RecordingView:
        """See `Jobs.record`."""
        return RecordingView.from_walk(self._service.record(walk), walk)

    def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """See `Jobs.parameters`."""
        jobs = [self._service.job(job_id) for job_id in job_ids]
        return IdentifiabilityView.from_identifiability(
            list(job_ids), self._service.identifiability(jobs)
        )

    def export(self, job_id: str, file_format: TableFormat) -> Iterator[bytes]:
        """See `Jobs.export`."""
        job = self._service.job(job_id)
        return encoded_table(file_format, job.spec, self._service.column_pieces(job))

    def close(self) -> None:
        """See `Jobs.close`."""
        self._service.store.close()

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the store."""
        self.close()

    def _all(self, state: JobState | None, search: str, order: JobOrder) -> Iterator[Job]:
        after: str | None = None
        while True:
            page = self._service.jobs(
                state=state, search=search, order=order, after=after, limit=_PAGE
            )
            yield from page.items
            if page.next is None:
                return
            after = page.next

    def _iterations_after(self, job_id: str, after: int | None) -> Iterator[IterationView]:
        while True:
            page = self._service.iterations(job_id, after=after, limit=_PAGE)
            yield from map(IterationView.from_iteration, page.items)
            if page.next is None or not page.items:
                return
            after = page.items[-1].index

    def _in_full(self, job: Job) -> JobView:
        found = job.progress.best_fitness is not None
        return JobView.from_job_and_best(job, self._service.best(job.id) if found else None)
