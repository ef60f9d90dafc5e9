"""Jobs in a database, for programs with an event loop: the work is done in threads."""

from __future__ import annotations

import os
import threading
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from functools import partial
from typing import Self, TypeVar, Unpack

import anyio
from anyio import from_thread, to_thread
from anyio.lowlevel import checkpoint

from gaitswarm.jobs.async_port import AsyncJobs
from gaitswarm.jobs.database.async_findings import AsyncDatabaseFindings, iterated
from gaitswarm.jobs.database.async_walks import AsyncLocalWalks
from gaitswarm.jobs.database.jobs import DatabaseJobs
from gaitswarm.jobs.port import JobEvent
from gaitswarm.requests.firmware import FirmwareOptions
from gaitswarm.services.optimizer.jobs.job import Command, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import ANY_JOB, JobFilter
from gaitswarm.services.optimizer.run.evaluator import Evaluator
from gaitswarm.services.runtime import EvaluatorKind
from gaitswarm.sim.identification.recorded_walk import RecordedWalk
from gaitswarm.specs import (
    ForkOptions,
    SpecInput,
    SpecOptions,
)
from gaitswarm.views import (
    EstimateView,
    IterationView,
    JobSummaryView,
    JobView,
)
from gaitswarm.views.firmware import FirmwareView
from gaitswarm.views.identification import RecordingEntryView, RecordingView

T = TypeVar("T")


class AsyncDatabaseJobs(AsyncDatabaseFindings, AsyncLocalWalks, AsyncJobs):
    """Jobs in a database, which is opened with the context, or when it is first used."""

    def __init__(self, url: str, connect: Callable[[], DatabaseJobs]) -> None:
        """Name the database.

        Args:
            url: Of the database.
            connect: Opens it; called once, in a thread.
        """
        self._url = url
        self._connect = connect
        self._opened: DatabaseJobs | None = None
        self._opening = anyio.Lock()

    @property
    def url(self) -> str:
        """The database's file name or URL."""
        return self._url

    async def submit(
        self,
        spec: SpecInput | None = None,
        *,
        idempotency_key: str | None = None,
        priority: int = 0,
        notify_url: str | None = None,
        **options: Unpack[SpecOptions],
    ) -> JobView:
        """Queue a job in the database, for `run` or a runner of another process."""
        jobs = await self._jobs()
        call = partial(
            jobs.submit,
            spec,
            idempotency_key=idempotency_key,
            priority=priority,
            notify_url=notify_url,
            **options,
        )
        return await to_thread.run_sync(call)

    async def fork(
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
        jobs = await self._jobs()
        call = partial(
            jobs.fork,
            job_id,
            from_iteration,
            idempotency_key=idempotency_key,
            priority=priority,
            notify_url=notify_url,
            **options,
        )
        return await to_thread.run_sync(call)

    async def estimate(
        self, spec: SpecInput | None = None, **options: Unpack[SpecOptions]
    ) -> EstimateView:
        """Say what a job would cost on this machine."""
        jobs = await self._jobs()
        return await to_thread.run_sync(partial(jobs.estimate, spec, **options))

    async def run(
        self,
        job_id: str,
        *,
        evaluator: EvaluatorKind | Evaluator = "in-process",
        cpus: int | None = None,
        ray_address: str | None = None,
        accept_changes: bool = False,
        on_iteration: Callable[[IterationView], None] | None = None,
    ) -> JobView:
        """Run a job here and now; where this is cancelled, the job is given back to the queue.

        Args:
            job_id: Identifier of the job.
            evaluator: As for `DatabaseJobs.run`.
            cpus: Walks to compute at once on this machine; default all processors.
            ray_address: A Ray cluster that runs already, for all walks.
            accept_changes: Whether the job goes on although what its numbers depend on (code,
                robot, compiler) has changed, which is then recorded with it.
            on_iteration: Called in the event loop after each iteration is committed.

        Returns:
            The job as it is then: ended or paused.

        Raises:
            Conflict: The job was cancelled.
            ProvenanceChanged: What its numbers depend on has changed, and that is not accepted.
            EvaluatorUnavailable: The cluster cannot be reached.
        """
        jobs = await self._jobs()
        stop = threading.Event()

        def told(iteration: IterationView) -> None:
            if on_iteration is not None and not stop.is_set():
                from_thread.run_sync(on_iteration, iteration)

        work = partial(
            jobs.run,
            job_id,
            evaluator=evaluator,
            cpus=cpus,
            ray_address=ray_address,
            accept_changes=accept_changes,
            on_iteration=told,
            stop=stop,
        )

        async def stop_with_the_task() -> None:
            try:
                await anyio.sleep_forever()
            finally:
                stop.set()

        ended: JobView | Exception
        async with anyio.create_task_group() as group:
            group.start_soon(stop_with_the_task)
            try:
                # The thread is waited for even where the task is cancelled.
                ended = await to_thread.run_sync(work)
            except Exception as error:  # noqa: BLE001 - raised again, outside the group
                ended = error
            group.cancel_scope.cancel()
        # Where the task was cancelled meanwhile, it ends here.
        await checkpoint()
        if isinstance(ended, Exception):
            raise ended
        return ended

    async def jobs(
        self,
        *,
        state: JobState | str | None = None,
        parent: str | None = None,
        search: str = "",
        where: JobFilter = ANY_JOB,
        order: JobOrder | str = JobOrder.CREATED,
        reverse: bool = False,
        limit: int | None = None,
    ) -> AsyncIterator[JobSummaryView]:
        """List the database's jobs, read by pages."""
        jobs = await self._jobs()
        found = partial(
            jobs.jobs,
            state=state,
            parent=parent,
            search=search,
            where=where,
            order=order,
            reverse=reverse,
            limit=limit,
        )
        async for job in iterated(found):
            yield job

    async def job(self, job_id: str) -> JobView:
        """Read one job."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.job, job_id)

    async def command(
        self, job_id: str, command: Command | str, *, accept_changes: bool = False
    ) -> JobView:
        """Change a job's state; a process that runs it sees that."""
        jobs = await self._jobs()
        call = partial(jobs.command, job_id, command, accept_changes=accept_changes)
        return await to_thread.run_sync(call)

    async def extend(self, job_id: str, iterations: int) -> JobView:
        """Write another budget for a job."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.extend, job_id, iterations)

    async def prioritize(self, job_id: str, priority: int) -> JobView:
        """Write another priority for a job; a process that runs it sees that."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.prioritize, job_id, priority)

    async def label(
        self,
        job_id: str,
        *,
        name: str | None = None,
        note: str | None = None,
        tags: Iterable[str] | None = None,
        archived: bool | None = None,
    ) -> JobView:
        """Write on a job of the database, in a thread."""
        jobs = await self._jobs()
        call = partial(jobs.label, job_id, name=name, note=note, tags=tags, archived=archived)
        return await to_thread.run_sync(call)

    async def keep(self, job_id: str, *, kept: bool = True) -> JobView:
        """Write that a job is kept, or is not."""
        jobs = await self._jobs()
        return await to_thread.run_sync(partial(jobs.keep, job_id, kept=kept))

    async def delete(self, job_id: str) -> None:
        """Delete a job, and remove all of its rows."""
        jobs = await self._jobs()
        await to_thread.run_sync(jobs.delete, job_id)

    async def follow(self, job_id: str, *, after: int | None = None) -> AsyncIterator[JobEvent]:
        """Look at the job from time to time, and tell what is new."""
        jobs = await self._jobs()
        news = jobs.news(job_id, after=after)
        while True:
            async for event in iterated(news.poll):
                yield event
            if news.ended:
                return
            await anyio.sleep(jobs.poll_seconds)

    async def write_firmware(
        self,
        design: Mapping[str, float | str] | str,
        output: str | os.PathLike[str],
        **options: Unpack[FirmwareOptions],
    ) -> FirmwareView:
        """Make firmware in a thread of this process."""
        jobs = await self._jobs()
        return await to_thread.run_sync(partial(jobs.write_firmware, design, output, **options))

    async def record(self, walk: RecordedWalk) -> RecordingView:
        """Write a recorded walk into the database."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.record, walk)

    async def recordings(
        self, *, search: str = "", limit: int | None = None
    ) -> AsyncIterator[RecordingEntryView]:
        """List the database's recorded walks, read by pages."""
        jobs = await self._jobs()
        async for entry in iterated(partial(jobs.recordings, search=search, limit=limit)):
            yield entry

    async def recording(self, recording_id: str) -> RecordedWalk:
        """Read a recorded walk."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.recording, recording_id)

    async def close(self) -> None:
        """Close the database, if it was opened."""
        if self._opened is not None:
            await to_thread.run_sync(self._opened.close)

    async def __aenter__(self) -> Self:
        await self._jobs()
        return self

    async def _jobs(self) -> DatabaseJobs:
        async with self._opening:
            if self._opened is None:
                self._opened = await to_thread.run_sync(self._connect)
            return self._opened
