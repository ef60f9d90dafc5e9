"""Jobs in a database that this process opens itself."""

from __future__ import annotations

import os
import shlex
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from itertools import islice
from typing import Final, TypeVar, Unpack

from gaitswarm.errors import simulation_errors
from gaitswarm.jobs.database.embedded import Workers, earlier_job, run_here
from gaitswarm.jobs.database.findings import DatabaseFindings
from gaitswarm.jobs.database.news import PAGE, JobNews
from gaitswarm.jobs.database.walks import LocalWalks
from gaitswarm.jobs.port import JobEvent, Jobs
from gaitswarm.requests import arguments, design_arguments
from gaitswarm.requests.firmware import FirmwareOptions
from gaitswarm.services.optimizer.jobs.job import Claim, Command, Job, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import ANY_JOB, JobFilter
from gaitswarm.services.optimizer.jobs.listing import Page
from gaitswarm.services.optimizer.masking import masked_url
from gaitswarm.services.optimizer.run.evaluator import Evaluator
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.runtime import EvaluatorKind
from gaitswarm.settings import default_database
from gaitswarm.sim.identification.recorded_walk import RecordedWalk
from gaitswarm.specs import ForkOptions, SpecInput, SpecOptions, chosen_spec
from gaitswarm.views import (
    EstimateView,
    IterationView,
    JobSummaryView,
    JobView,
)
from gaitswarm.views.firmware import FirmwareView
from gaitswarm.views.identification import RecordingEntryView, RecordingView

T = TypeVar("T")

POLL_SECONDS: Final = 0.5
"""How often a job that is followed is looked at [s]."""


class DatabaseJobs(DatabaseFindings, LocalWalks, Jobs):
    """Jobs in a database, which this process can run as well. Owns its store."""

    def __init__(
        self, service: JobService, url: str, *, poll_seconds: float = POLL_SECONDS
    ) -> None:
        """Take over a service.

        Args:
            service: Of the database; closed with this.
            url: Of the database, as it was opened.
            poll_seconds: How often a job that is followed is looked at [s].
        """
        self._service = service
        self._url = url
        self.poll_seconds = poll_seconds

    @property
    def url(self) -> str:
        """The database's file name or URL."""
        return self._url

    @property
    def place(self) -> str:
        """Options by which a command finds the same jobs; the default goes without saying.

        A password is masked.
        """
        if self._url == str(default_database()):
            return ""
        return f" --db {shlex.quote(masked_url(self._url))}"

    def submit(
        self,
        spec: SpecInput | None = None,
        *,
        idempotency_key: str | None = None,
        priority: int = 0,
        notify_url: str | None = None,
        **options: Unpack[SpecOptions],
    ) -> JobView:
        """Queue a job in the database, for `run` or a runner of another process."""
        wanted = chosen_spec(spec, options)
        with simulation_errors("spec"):
            job, _ = self._service.submit(
                wanted,
                idempotency_key=idempotency_key,
                priority=arguments.priority(priority),
                notify_url=None if notify_url is None else arguments.notify_url(notify_url),
            )
        return self._in_full(job)

    def fork(
        self,
        job_id: str,
        from_iteration: int,
        *,
        idempotency_key: str | None = None,
        priority: int = 0,
        notify_url: str | None = None,
        **options: Unpack[ForkOptions],
    ) -> JobView:
        """Queue a fork in the database, for `run` or a runner of another process."""
        wanted = arguments.fork(from_iteration, options)
        with simulation_errors("fork"):
            job, _ = self._service.fork(
                job_id,
                wanted,
                idempotency_key=idempotency_key,
                priority=arguments.priority(priority),
                notify_url=None if notify_url is None else arguments.notify_url(notify_url),
            )
        return self._in_full(job)

    def estimate(
        self, spec: SpecInput | None = None, **options: Unpack[SpecOptions]
    ) -> EstimateView:
        """Say what a job would cost on this machine."""
        wanted = chosen_spec(spec, options)
        with simulation_errors("spec"):
            return EstimateView.from_estimate(self._service.estimate(wanted))

    def submit_embedded(self, spec: SpecInput | None) -> Claim:
        """Store a job that this process alone is to run: no runner can take it in between.

        Args:
            spec: As for `submit`.

        Returns:
            A claim on the job, to be given to `run` at once: it lasts some seconds.

        Raises:
            InvalidRequest: The job makes no sense or cannot be simulated; names the field.
        """
        wanted = chosen_spec(spec, {})
        with simulation_errors("spec"):
            return self._service.submit_embedded(wanted)

    def earlier(self, spec: SpecInput) -> str | None:
        """Find a job of the same name and specification that is still valid.

        Args:
            spec: As for `submit`.

        Returns:
            Identifier of a job that was not cancelled and whose numbers depend on the same code,
            robot and libraries as a new one's; None if there is none.
        """
        job = earlier_job(self._service, chosen_spec(spec, {}))
        return None if job is None else job.id

    def run(
        self,
        job: str | Claim,
        *,
        evaluator: EvaluatorKind | Evaluator = "in-process",
        cpus: int | None = None,
        ray_address: str | None = None,
        accept_changes: bool = False,
        on_iteration: Callable[[IterationView], None] | None = None,
        stop: threading.Event | None = None,
    ) -> JobView:
        """Run a job here and now, from its last committed iteration to its end.

        A paused or failed job is resumed. One that another process runs is followed, and goes on
        here when that process gives it back or is not heard of any more. Ctrl-C gives the job back
        to the queue, as does an exception of `on_iteration`, which is passed on.

        Args:
            job: Identifier of the job; or what `submit_embedded` answered.
            evaluator: "in-process": threads of this process; "ray": the same, and Ray in long
                jobs or at `ray_address`; or an evaluator that is open already and stays so.
            cpus: Walks to compute at once on this machine; default all processors.
            ray_address: A Ray cluster that runs already, for all walks.
            accept_changes: Whether the job goes on although what its numbers depend on (code,
                robot, compiler) has changed, which is then recorded with it.
            on_iteration: Called after each iteration is committed.
            stop: When it is set, by another thread, the job is given back to the queue and the
                method returns.

        Returns:
            The job as it is then: ended, paused, or queued if it was stopped.

        Raises:
            Interrupted: Ctrl-C; says how to go on.
            Conflict: The job was cancelled.
            ProvenanceChanged: What its numbers depend on has changed, and that is not accepted.
            EvaluatorUnavailable: The cluster cannot be reached.
        """
        workers = Workers(evaluator, cpus=cpus, ray_address=ray_address)
        job_id = job if isinstance(job, str) else job.job.id

        def committed(index: int) -> None:
            if on_iteration is not None:
                after = index - 1 if index else None
                on_iteration(next(self.iterations(job_id, after=after)))

        ended = run_here(
            self._service,
            self._url,
            job,
            workers=workers,
            on_iteration=committed,
            stop=stop,
            accept_changes=accept_changes,
        )
        return self._in_full(ended)

    def jobs(
        self,
        *,
        state: JobState | str | None = None,
        parent: str | None = None,
        search: str = "",
        where: JobFilter = ANY_JOB,
        order: JobOrder | str = JobOrder.CREATED,
        reverse: bool = False,
        limit: int | None = None,
    ) -> Iterator[JobSummaryView]:
        """List the database's jobs, read by pages."""
        pages = partial(
            self._service.jobs,
            state=arguments.state(state),
            parent=parent,
            search=search,
            where=where,
            order=arguments.order(order),
            reverse=reverse,
            limit=PAGE,
        )
        return map(JobSummaryView.from_job, islice(_items(pages), limit))

    def job(self, job_id: str) -> JobView:
        """Read one job."""
        return self._in_full(self._service.job(job_id))

    def command(
        self, job_id: str, command: Command | str, *, accept_changes: bool = False
    ) -> JobView:
        """Change a job's state; a process that runs it sees that."""
        asked = arguments.command(command)
        return self._in_full(self._service.command(job_id, asked, accept_changes=accept_changes))

    def extend(self, job_id: str, iterations: int) -> JobView:
        """Write another budget for a job."""
        return self._in_full(self._service.extend(job_id, iterations))

    def prioritize(self, job_id: str, priority: int) -> JobView:
        """Write another priority for a job; a process that runs it sees that."""
        return self._in_full(self._service.prioritize(job_id, arguments.priority(priority)))

    def label(
        self,
        job_id: str,
        *,
        name: str | None = None,
        note: str | None = None,
        tags: Iterable[str] | None = None,
        archived: bool | None = None,
    ) -> JobView:
        """Write on a job of the database."""
        change = arguments.labels(name, note, tags, archived)
        return self._in_full(self._service.label(job_id, change))

    def keep(self, job_id: str, *, kept: bool = True) -> JobView:
        """Write that a job is kept, or is not."""
        return self._in_full(self._service.keep(job_id, kept))

    def delete(self, job_id: str) -> None:
        """Delete a job, and remove all of its rows."""
        self._service.delete(job_id)
        self._service.store.purge_deleted()

    def follow(self, job_id: str, *, after: int | None = None) -> Iterator[JobEvent]:
        """Look at the job from time to time, and tell what is new."""
        news = self.news(job_id, after=after)
        while True:
            yield from news.poll()
            if news.ended:
                return
            time.sleep(self.poll_seconds)

    def news(self, job_id: str, *, after: int | None = None) -> JobNews:
        """What is new of a job, for those who do the waiting.

        Args:
            job_id: Identifier of the job.
            after: Leave out iterations up to this index.

        Returns:
            An object that is to be asked from time to time.
        """
        return JobNews(self._service, job_id, after)

    def write_firmware(
        self,
        design: Mapping[str, float | str] | str,
        output: str | os.PathLike[str],
        **options: Unpack[FirmwareOptions],
    ) -> FirmwareView:
        """Make firmware in this process."""
        from gaitswarm.firmware import written_firmware

        if isinstance(design, str):
            best = self.best(design)
            request = design_arguments.firmware_of_best(
                design, self.job(design).spec, best, options
            )
        else:
            request = design_arguments.firmware(design, options)
        return written_firmware(request, output)

    def record(self, walk: RecordedWalk) -> RecordingView:
        """Write a recorded walk into the database."""
        return RecordingView.from_walk(self._service.record(walk), walk)

    def recordings(
        self, *, search: str = "", limit: int | None = None
    ) -> Iterator[RecordingEntryView]:
        """List the database's recorded walks, read by pages."""
        pages = partial(self._service.recordings, search=search, limit=PAGE)
        return map(RecordingEntryView.from_entry, islice(_items(pages), limit))

    def recording(self, recording_id: str) -> RecordedWalk:
        """Read a recorded walk."""
        return self._service.recording(recording_id)

    def close(self) -> None:
        """Close the store."""
        self._service.store.close()

    def _in_full(self, job: Job) -> JobView:
        found = job.progress.best_fitness is not None
        return JobView.from_job_and_best(job, self._service.best(job.id) if found else None)


def _items(page: Callable[..., Page[T]]) -> Iterator[T]:
    """All items of a list that is read by pages."""
    after: str | None = None
    while True:
        found = page(after=after)
        yield from found.items
        if found.next is None:
            return
        after = found.next
