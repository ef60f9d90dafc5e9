"""Jobs in a database, for programs with an event loop: the work is done in threads."""

from __future__ import annotations

import os
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Self, TypeVar, Unpack

import anyio
from anyio import from_thread, to_thread
from anyio.lowlevel import checkpoint

from gaitswarm.jobs.async_local_walks import AsyncLocalWalks
from gaitswarm.jobs.async_port import AsyncJobs
from gaitswarm.jobs.database import DatabaseJobs
from gaitswarm.jobs.port import JobEvent
from gaitswarm.requests.firmware import FirmwareOptions
from gaitswarm.specs import (
    ForkOptions,
    PreferenceInput,
    SpecInput,
    SpecOptions,
)
from gaitswarm.tables import EvaluationTable, TableFormat
from gaitswarm.views import (
    BestView,
    EstimateView,
    HistoryIterationView,
    IterationView,
    JobSummaryView,
    JobView,
    RankingView,
)
from gaitswarm.views.calibration import TargetsView
from gaitswarm.views.certificate import CertificateView
from gaitswarm.views.families import ScenarioFamiliesView
from gaitswarm.views.firmware import FirmwareView
from gaitswarm.views.identification import IdentifiabilityView, RecordingView
from gaitswarm.views.preferences import RobustPreferencesView
from gaitswarm.views.tournament import ProblemRunsView, TournamentStandingsView, TournamentView
from gaitswarm.views.trade_offs import FrontView, PreferenceForView
from services.optimizer.analysis.fits.targets import LeaveOut
from services.optimizer.jobs.job import Command, JobOrder, JobState
from services.optimizer.run.evaluator import Evaluator
from services.runtime import EvaluatorKind
from sim.identification.recorded_walk import RecordedWalk
from sim.kernel.walk import Precision

T = TypeVar("T")


class AsyncDatabaseJobs(AsyncLocalWalks, AsyncJobs):
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
        **options: Unpack[SpecOptions],
    ) -> JobView:
        """Queue a job in the database, for `run` or a runner of another process."""
        jobs = await self._jobs()
        call = partial(jobs.submit, spec, idempotency_key=idempotency_key, **options)
        return await to_thread.run_sync(call)

    async def fork(
        self,
        job_id: str,
        from_iteration: int,
        *,
        idempotency_key: str | None = None,
        **options: Unpack[ForkOptions],
    ) -> JobView:
        """Queue a fork in the database, for `run` or a runner of another process."""
        jobs = await self._jobs()
        call = partial(
            jobs.fork, job_id, from_iteration, idempotency_key=idempotency_key, **options
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
        order: JobOrder | str = JobOrder.CREATED,
        limit: int | None = None,
    ) -> AsyncIterator[JobSummaryView]:
        """List the database's jobs, read by pages."""
        jobs = await self._jobs()
        found = partial(
            jobs.jobs, state=state, parent=parent, search=search, order=order, limit=limit
        )
        async for job in _iterated(found):
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

    async def best(self, job_id: str) -> BestView:
        """Read the best design of a job."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.best, job_id)

    async def iterations(
        self, job_id: str, *, after: int | None = None
    ) -> AsyncIterator[IterationView]:
        """Read committed iterations by pages."""
        jobs = await self._jobs()
        async for iteration in _iterated(partial(jobs.iterations, job_id, after=after)):
            yield iteration

    async def history(self, job_id: str) -> AsyncIterator[HistoryIterationView]:
        """Read committed iterations with their designs, by pieces."""
        jobs = await self._jobs()
        async for iteration in _iterated(partial(jobs.history, job_id)):
            yield iteration

    async def evaluations(self, job_id: str) -> EvaluationTable:
        """Read every evaluation."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.evaluations, job_id)

    async def follow(self, job_id: str, *, after: int | None = None) -> AsyncIterator[JobEvent]:
        """Look at the job from time to time, and tell what is new."""
        jobs = await self._jobs()
        news = jobs.news(job_id, after=after)
        while True:
            async for event in _iterated(news.poll):
                yield event
            if news.ended:
                return
            await anyio.sleep(jobs.poll_seconds)

    async def ranking(
        self, job_id: str, preference: PreferenceInput, *, top: int = 20
    ) -> RankingView:
        """Rank a job's designs from what is stored."""
        jobs = await self._jobs()
        return await to_thread.run_sync(partial(jobs.ranking, job_id, preference, top=top))

    async def scenarios(self, job_id: str, *, tolerance: float = 0.01) -> ScenarioFamiliesView:
        """Judge a job's designs by fewer scenarios, from what is stored."""
        jobs = await self._jobs()
        return await to_thread.run_sync(partial(jobs.scenarios, job_id, tolerance=tolerance))

    async def preferences(
        self,
        job_id: str,
        *,
        drawn: int = 512,
        candidates: int = 8,
        samples: int = 0,
        radius: float = 0.02,
        seed: int = 1,
        precision: Precision = "double",
    ) -> RobustPreferencesView:
        """Rank a job's designs under many preferences, in a thread."""
        jobs = await self._jobs()
        asked = partial(
            jobs.preferences,
            job_id,
            drawn=drawn,
            candidates=candidates,
            samples=samples,
            radius=radius,
            seed=seed,
            precision=precision,
        )
        return await to_thread.run_sync(asked)

    async def front(self, job_id: str, *, most: int = 1000) -> FrontView:
        """Find a job's front from what is stored."""
        jobs = await self._jobs()
        return await to_thread.run_sync(partial(jobs.front, job_id, most=most))

    async def preference_for(self, job_id: str, iteration: int, particle: int) -> PreferenceForView:
        """Find a design's preference from what is stored."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.preference_for, job_id, iteration, particle)

    async def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """Compare runs from what is stored."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.parameters, job_ids)

    async def targets(
        self, job_ids: Sequence[str], *, leave_out: LeaveOut | None = None
    ) -> TargetsView:
        """Compare runs with their targets, from what is stored."""
        jobs = await self._jobs()
        asked = partial(jobs.targets, job_ids, leave_out=leave_out)
        return await to_thread.run_sync(asked)

    async def tournaments(self) -> list[TournamentView]:
        """Read which tournaments there are."""
        return await to_thread.run_sync((await self._jobs()).tournaments)

    async def standings(
        self, job_id: str, *, compare_with: str | None = None
    ) -> TournamentStandingsView:
        """Judge a tournament from what is stored."""
        jobs = await self._jobs()
        return await to_thread.run_sync(partial(jobs.standings, job_id, compare_with=compare_with))

    async def problem_runs(self, job_id: str, problem: str) -> ProblemRunsView:
        """Read the runs on a problem."""
        return await to_thread.run_sync((await self._jobs()).problem_runs, job_id, problem)

    async def certificate(
        self, job_id: str, *, worlds: int | None = None, most: int = 5
    ) -> CertificateView:
        """Say what a certificate comes to, from what is stored."""
        jobs = await self._jobs()
        asked = partial(jobs.certificate, job_id, worlds=worlds, most=most)
        return await to_thread.run_sync(asked)

    async def export(
        self, job_id: str, file_format: TableFormat = "parquet"
    ) -> AsyncIterator[bytes]:
        """Write every evaluation as a file, in parts as they are read."""
        jobs = await self._jobs()
        async for part in _iterated(partial(jobs.export, job_id, file_format)):
            yield part

    async def evidence(self, job_id: str) -> bytes:
        """Write evidence from what is stored."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.evidence, job_id)

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


async def _iterated(items: Callable[[], Iterator[T]]) -> AsyncIterator[T]:
    """Items of an iterator, each taken in a thread."""
    iterator = await to_thread.run_sync(items)
    while True:
        taken = await to_thread.run_sync(_next, iterator)
        if not taken:
            return
        yield taken[0]


def _next(iterator: Iterator[T]) -> tuple[T, ...]:
    """The next item, or none: StopIteration cannot leave a thread."""
    for item in iterator:
        return (item,)
    return ()
