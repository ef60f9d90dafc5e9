"""Jobs for programs with an event loop: methods of `Jobs`, called in threads.

scripts/async_stub.py writes the types of this module.
"""

from __future__ import annotations

import inspect
import threading
from contextlib import aclosing, suppress
from functools import partial, wraps

import anyio
from anyio import from_thread, to_thread
from anyio.lowlevel import checkpoint

from gaitswarm.jobs.base import Jobs, Stop


class AsyncJobs:
    """`Jobs` for programs with an event loop (`gaitswarm.open_async`, `gaitswarm.connect_async`).

    Methods have the names, arguments, results and errors of `Jobs`, where they are documented; they
    are awaited, or iterated with `async for`. A cancelled call returns at once: its thread finishes
    alone and its result is dropped, so that a change may still take effect. A cancelled `follow`
    closes its connection; a loop that is left early should close it as well, with
    `contextlib.aclosing`.
    """

    def __init__(self, connect, url):
        """connect: opens the jobs; called once, in a thread, on entering or at first use."""
        self._connect = connect
        self._url = url
        self._opened = None
        self._opening = anyio.Lock()

    @property
    def url(self):
        """URL of the server, or file or URL of the database."""
        return self._url

    @wraps(Jobs.follow)
    async def follow(self, job_id, *, after=None):
        jobs, stop = await self._jobs(), Stop()
        events = jobs._follow(job_id, after, stop)  # noqa: SLF001
        try:
            # A thread of its own: streams that wait must not occupy those of other calls.
            async for event in _iterated(events, anyio.CapacityLimiter(1)):
                yield event
        finally:
            stop.set()

    @wraps(Jobs.wait)
    async def wait(self, job_id):
        job = await self.job(job_id)
        async with aclosing(self.follow(job_id, after=job.last_iteration)) as events:
            async for _ in events:
                pass
        return await self.job(job_id)

    @wraps(Jobs.close)
    async def close(self):
        if self._opened is not None:
            await to_thread.run_sync(self._opened.close)

    async def __aenter__(self):
        await self._jobs()
        return self

    async def __aexit__(self, kind, error, traceback):
        await self.close()

    async def _jobs(self):
        async with self._opening:
            if self._opened is None:
                self._opened = await to_thread.run_sync(self._connect)
            return self._opened


def _adapted(name, method):
    """Make a coroutine function of a method, or an asynchronous generator of an iterator."""

    @wraps(method)
    async def call(self, *arguments, **options):
        jobs = await self._jobs()
        work = partial(getattr(jobs, name), *arguments, **options)
        return await to_thread.run_sync(work, abandon_on_cancel=True)

    @wraps(method)
    async def iterate(self, *arguments, **options):
        async for item in _iterated(await call(self, *arguments, **options)):
            yield item

    return iterate if method.__annotations__["return"].startswith("Iterator[") else call


for _name, _method in inspect.getmembers(Jobs, inspect.isfunction):
    if not _name.startswith("_") and _name not in vars(AsyncJobs):
        setattr(AsyncJobs, _name, _adapted(_name, _method))


class AsyncDatabaseJobs(AsyncJobs):
    """Jobs in a database, which this process can also run."""

    async def run(
        self,
        job_id,
        *,
        evaluator="auto",
        cpus=None,
        ray_address=None,
        accept_changes=False,
        on_iteration=None,
    ):
        """Run a job in a thread; where this is cancelled, the job is returned to the queue first.

        Args:
            job_id: Identifier of the job.
            evaluator: As for `DatabaseJobs.run`.
            cpus: Simulations to run at once on this machine; default all processors.
            ray_address: A running Ray cluster, for all simulations.
            accept_changes: Whether the job continues although its provenance (code, robot,
                compiler) has changed; the change is recorded with it.
            on_iteration: Called in the event loop after each iteration is committed.

        Returns:
            The job as it is then: ended or paused.

        Raises:
            Conflict: The job was cancelled.
            ProvenanceChanged: The provenance has changed, which is not accepted.
            EvaluatorUnavailable: The cluster cannot be reached.
        """
        jobs, stop = await self._jobs(), threading.Event()

        def committed(iteration):
            if on_iteration is not None and not stop.is_set():
                from_thread.run_sync(on_iteration, iteration)

        async def stop_with_the_task():
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
        return ended


async def _iterated(items, limiter=None):
    """Yield the items of an iterator, each computed in a thread."""
    compute = partial(to_thread.run_sync, _next, items, abandon_on_cancel=True, limiter=limiter)
    try:
        while taken := await compute():
            yield taken[0]
    finally:
        # A generator that an abandoned thread executes cannot be closed; it ends with its thread.
        with suppress(AttributeError, ValueError):
            items.close()


def _next(items):
    """Return the next item, or nothing: StopIteration cannot leave a thread."""
    for item in items:
        return (item,)
    return ()
