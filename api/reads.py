"""What is asked for again and again of jobs, and its answers: the same on whichever way."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Protocol

from gaitswarm.api.answers import Answers, Encoded, page_of
from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.services.optimizer.jobs.job import Job, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import ANY_JOB, JobFilter
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store.port.reading import Page
from gaitswarm.views import (
    BestView,
    JobSummaryView,
    JobView,
    encoded_evaluations,
    encoded_iterations,
)


class JobQuestion(Protocol):
    """What is asked of one job."""

    def known(self, answers: Answers, job: Job) -> Encoded | None:
        """Look for the answer without reading or computing anything."""

    def answer(self, answers: Answers, service: JobService, job: Job) -> Encoded:
        """Read what is asked for, unless it is known."""


@dataclass(frozen=True, slots=True)
class InFull:
    """State, progress, rates, best design."""

    def known(self, answers: Answers, job: Job) -> Encoded | None:
        """Look for it."""
        return answers.find_of_job("in full", job)

    def answer(self, answers: Answers, service: JobService, job: Job) -> Encoded:
        """Read it, unless it is known."""

        def encoded() -> bytes:
            return job_in_full(service, job).model_dump_json(by_alias=True).encode()

        return answers.of_job("in full", job, encoded)


@dataclass(frozen=True, slots=True)
class Best:
    """The design of least fitness."""

    def known(self, answers: Answers, job: Job) -> Encoded | None:
        """Look for it."""
        return answers.find_of_job("best", job)

    def answer(self, answers: Answers, service: JobService, job: Job) -> Encoded:
        """Read it, unless it is known."""

        def encoded() -> bytes:
            best = service.best(job.id)
            if best is None:
                raise NotFound(
                    f"job {job.id} has no design yet that walks in every scenario; ask again after"
                    " its next iteration, or see why designs fail in its evaluations"
                )
            return BestView.from_evaluation(best, job.spec).model_dump_json(by_alias=True).encode()

        return answers.of_job("best", job, encoded)


@dataclass(frozen=True, slots=True)
class Iterations:
    """A page of committed iterations.

    Attributes:
        after: Only iterations with a greater index; None for all.
        limit: Most iterations on the page.
    """

    after: int | None = None
    limit: int = 100

    def known(self, answers: Answers, job: Job) -> Encoded | None:
        """Look for it."""
        return answers.find_of_history(self._key(job)) if self._is_full(job) else None

    def answer(self, answers: Answers, service: JobService, job: Job) -> Encoded:
        """Read it, unless it is known."""

        def encoded() -> bytes:
            page = service.iterations(job.id, after=self.after, limit=self.limit)
            return page_of(encoded_iterations(page.items), page.next)

        if self._is_full(job):
            return answers.of_history(self._key(job), encoded)
        return answers.same(encoded())

    def _is_full(self, job: Job) -> bool:
        """A page that others follow never changes; the last one is as long as the job is by now."""
        end = self.limit if self.after is None else self.after + 1 + self.limit
        return end < job.progress.iterations

    def _key(self, job: Job) -> tuple[object, ...]:
        return ("iterations", job.id, self.after, self.limit)


@dataclass(frozen=True, slots=True)
class Evaluations:
    """All designs of an iteration.

    Attributes:
        iteration: Index of a committed iteration, from 0.
    """

    iteration: int

    def known(self, answers: Answers, job: Job) -> Encoded | None:
        """Look for them."""
        # Nothing is told of a job whose spec can no longer be read, be it remembered or not.
        return answers.find_of_history(self._key(job)) if job.readable else None

    def answer(self, answers: Answers, service: JobService, job: Job) -> Encoded:
        """Read them, unless they are known."""
        spec = job.spec

        def encoded() -> bytes:
            return encoded_evaluations(service.evaluations(job.id, self.iteration), spec)

        return answers.of_history(self._key(job), encoded)

    def _key(self, job: Job) -> tuple[object, ...]:
        return ("evaluations", job.id, self.iteration)


@dataclass(frozen=True, slots=True)
class JobList:
    """A page of the list of jobs; attributes as of `JobService.jobs`."""

    state: JobState | None = None
    kind: str | None = None
    parent: str | None = None
    search: str = ""
    where: JobFilter = ANY_JOB
    order: JobOrder = JobOrder.CREATED
    reverse: bool = False
    after: str | None = None
    limit: int = 50

    def read(self, service: JobService) -> Page[Job]:
        """Read the page."""
        return service.jobs(
            state=self.state,
            kind=self.kind,
            parent=self.parent,
            search=self.search,
            where=self.where,
            order=self.order,
            reverse=self.reverse,
            after=self.after,
            limit=self.limit,
        )

    def encoded(self, answers: Answers, page: Page[Job]) -> Encoded:
        """Encode the page."""
        items = [answers.of_job("summary", job, partial(_summary, job)) for job in page.items]
        return answers.same(page_of((item.plain for item in items), page.next))

    def lasts(self, page: Page[Job]) -> bool:
        """Whether the answer stays the same as long as nothing is committed."""
        # What is left of a job that runs depends on the time, and a plug-in may come that reads a
        # job which could not be read.
        return self.order is not JobOrder.TIME_LEFT and all(
            job.readable and job.state is not JobState.RUNNING for job in page.items
        )


def _summary(job: Job) -> bytes:
    return JobSummaryView.from_job(job).model_dump_json(by_alias=True).encode()


def job_in_full(service: JobService, job: Job) -> JobView:
    """Make the answer of every route that is about one job."""
    found = job.progress.best_fitness is not None
    return JobView.from_job_and_best(job, service.best(job.id) if found else None)
