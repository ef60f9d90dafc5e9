"""Jobs for programs with an event loop: methods of `Jobs`, called in threads."""

from __future__ import annotations

from collections.abc import AsyncGenerator, AsyncIterator, Callable, Coroutine, Iterator
from contextlib import aclosing, suppress
from functools import partial, wraps
from types import TracebackType
from typing import Any, Concatenate, ParamSpec, Self, TypeVar, cast

import anyio
from anyio import to_thread

from gaitswarm.jobs.base import JobEvent, Jobs, Stop
from gaitswarm.views.job import JobView

P = ParamSpec("P")
T = TypeVar("T")


def _awaited(
    method: Callable[Concatenate[Jobs, P], T],
) -> Callable[Concatenate[AsyncJobs, P], Coroutine[Any, Any, T]]:
    """Make a coroutine function of a method."""

    @wraps(method)
    async def call(self: AsyncJobs, /, *arguments: P.args, **options: P.kwargs) -> T:
        work = partial(getattr(self._jobs, method.__name__), *arguments, **options)
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
    """`Jobs` for programs with an event loop: `AsyncJobs(gaitswarm.connect(url))`.

    Methods have the names, arguments, results and errors of `Jobs`, where they are documented; they
    are awaited, or iterated with `async for`. A cancelled call returns at once: its thread finishes
    alone and its result is dropped, so that a change may still take effect. A cancelled `follow`
    closes its connection; a loop that is left early should close it as well, with
    `contextlib.aclosing`. An asynchronous context manager: leaving the block closes the jobs.
    """

    def __init__(self, jobs: Jobs) -> None:
        """Call the methods of jobs in threads."""
        self._jobs = jobs

    @property
    def url(self) -> str:
        """URL of the server, or file or URL of the database."""
        return self._jobs.url

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
    restore = _awaited(Jobs.restore)
    best = _awaited(Jobs.best)
    verdict = _awaited(Jobs.verdict)
    iterations = _iterated(Jobs.iterations)
    history = _iterated(Jobs.history)
    evaluations = _awaited(Jobs.evaluations)
    ranking = _awaited(Jobs.ranking)
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
        stop = Stop()
        events = self._jobs._follow(job_id, after, stop)  # noqa: SLF001
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
        await to_thread.run_sync(self._jobs.close)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        await self.close()


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
