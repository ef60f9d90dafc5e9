"""Jobs for programs with an event loop: methods of `Jobs`, called in threads."""

from __future__ import annotations

import threading
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Coroutine, Iterator
from contextlib import aclosing, suppress
from functools import partial, wraps
from types import TracebackType
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, Self, TypeVar, cast

import anyio
from anyio import from_thread, to_thread
from anyio.lowlevel import checkpoint

from gaitswarm.jobs.base import JobEvent, Jobs, Stop
from gaitswarm.views.job import IterationView, JobView

if TYPE_CHECKING:
    from gaitswarm.jobs.database import DatabaseJobs
    from gaitswarm.services.optimizer.run.evaluator import Evaluator
    from gaitswarm.services.runtime import EvaluatorKind

P = ParamSpec("P")
T = TypeVar("T")


def _awaited(
    method: Callable[Concatenate[Jobs, P], T],
) -> Callable[Concatenate[AsyncJobs, P], Coroutine[Any, Any, T]]:
    """Make a coroutine function of a method."""

    @wraps(method)
    async def call(self: AsyncJobs, /, *arguments: P.args, **options: P.kwargs) -> T:
        jobs = await self._jobs()
        work = partial(getattr(jobs, method.__name__), *arguments, **options)
        return cast(T, await to_thread.run_sync(work, abandon_on_cancel=True))

    return call


def _iterated(
    method: Callable[Concatenate[Jobs, P], Iterator[T]],
) -> Callable[Concatenate[AsyncJobs, P], AsyncIterator[T]]:
    """Make an asynchronous generator function of an iterator."""
    begin = _awaited(method)

    @wraps(method)
    async def iterate(
        self: AsyncJobs, /, *arguments: P.args, **options: P.kwargs
    ) -> AsyncIterator[T]:
        async for item in _items(await begin(self, *arguments, **options)):
            yield item

    return iterate


class AsyncJobs:
    """`Jobs` for programs with an event loop (`gaitswarm.open_async`, `gaitswarm.connect_async`).

    Methods have the names, arguments, results and errors of `Jobs`, where they are documented; they
    are awaited, or iterated with `async for`. A cancelled call returns at once: its thread finishes
    alone and its result is dropped, so that a change may still take effect. A cancelled `follow`
    closes its connection; a loop that is left early should close it as well, with
    `contextlib.aclosing`.
    """

    def __init__(self, connect: Callable[[], Jobs], url: str) -> None:
        """connect: opens the jobs; called once, in a thread, on entering or at first use."""
        self._connect = connect
        self._url = url
        self._opened: Jobs | None = None
        self._opening = anyio.Lock()

    @property
    def url(self) -> str:
        """URL of the server, or file or URL of the database."""
        return self._url

    submit = _awaited(Jobs.submit)
    fork = _awaited(Jobs.fork)
    estimate = _awaited(Jobs.estimate)
    jobs = _iterated(Jobs.jobs)
    job = _awaited(Jobs.job)
    pause = _awaited(Jobs.pause)
    resume = _awaited(Jobs.resume)
    cancel = _awaited(Jobs.cancel)
    extend = _awaited(Jobs.extend)
    prioritize = _awaited(Jobs.prioritize)
    label = _awaited(Jobs.label)
    keep = _awaited(Jobs.keep)
    release = _awaited(Jobs.release)
    delete = _awaited(Jobs.delete)
    best = _awaited(Jobs.best)
    iterations = _iterated(Jobs.iterations)
    history = _iterated(Jobs.history)
    evaluations = _awaited(Jobs.evaluations)
    ranking = _awaited(Jobs.ranking)
    scenarios = _awaited(Jobs.scenarios)
    failures = _awaited(Jobs.failures)
    importance = _awaited(Jobs.importance)
    comparison = _awaited(Jobs.comparison)
    preferences = _awaited(Jobs.preferences)
    front = _awaited(Jobs.front)
    preference_for = _awaited(Jobs.preference_for)
    parameters = _awaited(Jobs.parameters)
    targets = _awaited(Jobs.targets)
    certificate = _awaited(Jobs.certificate)
    export = _iterated(Jobs.export)
    evidence = _awaited(Jobs.evidence)
    verify = _awaited(Jobs.verify)
    record = _awaited(Jobs.record)
    recordings = _iterated(Jobs.recordings)
    recording = _awaited(Jobs.recording)

    async def follow(
        self, job_id: str, *, after: int | None = None
    ) -> AsyncGenerator[JobEvent, None]:
        jobs, stop = await self._jobs(), Stop()
        events = jobs._follow(job_id, after, stop)  # noqa: SLF001
        try:
            # A thread of its own: streams that wait must not occupy those of other calls.
            async for event in _items(events, anyio.CapacityLimiter(1)):
                yield event
        finally:
            stop.set()

    async def wait(self, job_id: str) -> JobView:
        job = await self.job(job_id)
        async with aclosing(self.follow(job_id, after=job.last_iteration)) as events:
            async for _ in events:
                pass
        return await self.job(job_id)

    async def close(self) -> None:
        if self._opened is not None:
            await to_thread.run_sync(self._opened.close)

    async def __aenter__(self) -> Self:
        await self._jobs()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        await self.close()

    async def _jobs(self) -> Jobs:
        async with self._opening:
            if self._opened is None:
                self._opened = await to_thread.run_sync(self._connect)
            return self._opened


class AsyncDatabaseJobs(AsyncJobs):
    """Jobs in a database, which this process can also run."""

    async def run(
        self,
        job_id: str,
        *,
        evaluator: EvaluatorKind | Evaluator = "auto",
        cpus: int | None = None,
        ray_address: str | None = None,
        accept_changes: bool = False,
        on_iteration: Callable[[IterationView], None] | None = None,
    ) -> JobView:
        """Run a job in a thread; where this is cancelled, the job is returned to the queue first.

        Arguments, result and errors are those of `DatabaseJobs.run`; `on_iteration` is called in
        the event loop.
        """
        jobs, stop = cast("DatabaseJobs", await self._jobs()), threading.Event()

        def committed(iteration: IterationView) -> None:
            if on_iteration is not None and not stop.is_set():
                from_thread.run_sync(on_iteration, iteration)

        async def stop_with_the_task() -> None:
            try:
                await anyio.sleep_forever()
            finally:
                stop.set()

        work = partial(
            jobs.run,
            job_id,
            evaluator=evaluator,
            cpus=cpus,
            ray_address=ray_address,
            accept_changes=accept_changes,
            on_iteration=committed,
            stop=stop,
        )
        error = ended = None
        async with anyio.create_task_group() as group:
            group.start_soon(stop_with_the_task)
            try:
                # Not abandoned: the thread returns the job to the queue.
                ended = await to_thread.run_sync(work, limiter=anyio.CapacityLimiter(1))
            except Exception as raised:  # noqa: BLE001 - raised again, outside the group
                error = raised
            group.cancel_scope.cancel()
        # Raises the cancellation, if the task was cancelled.
        await checkpoint()
        if error is not None:
            raise error
        return cast(JobView, ended)


async def _items(
    items: Iterator[T], limiter: anyio.CapacityLimiter | None = None
) -> AsyncIterator[T]:
    """Yield the items of an iterator, each computed in a thread."""
    compute = partial(to_thread.run_sync, _next, items, abandon_on_cancel=True, limiter=limiter)
    try:
        while taken := await compute():
            yield taken[0]
    finally:
        # A generator that an abandoned thread executes cannot be closed; it ends with its thread.
        with suppress(AttributeError, ValueError):
            items.close()  # type: ignore[attr-defined]


def _next(items: Iterator[T]) -> tuple[()] | tuple[T]:
    """Return the next item, or nothing: StopIteration cannot leave a thread."""
    for item in items:
        return (item,)
    return ()
