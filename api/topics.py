"""Jobs that event streams follow: each is watched once, and read once for all its streams."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property

import anyio
from anyio.to_thread import run_sync
from fastapi.sse import format_sse_event

from gaitswarm.views import IterationView, StateView
from services.optimizer.jobs.iteration import Iteration
from services.optimizer.jobs.job import Job
from services.optimizer.service import JobService


@dataclass(frozen=True)
class News:
    """A job, and what it has committed since; the events that tell of it are encoded once.

    Attributes:
        job: As it was read.
        iterations: In order.
    """

    job: Job
    iterations: tuple[Iteration, ...]

    @cached_property
    def events(self) -> tuple[bytes, ...]:
        """An event `iteration` for each iteration, as it is sent."""
        views = map(IterationView.from_iteration, self.iterations)
        return tuple(
            format_sse_event(event="iteration", id=str(view.index), data_str=view.model_dump_json())
            for view in views
        )

    @cached_property
    def state(self) -> bytes:
        """The event `state`, as it is sent."""
        text = StateView.from_job(self.job).model_dump_json()
        return format_sse_event(event="state", data_str=text)


class Topic:
    """A job that streams follow. Of one event loop.

    version: how often the job has changed, as far as this process knows.
    """

    def __init__(self, service: JobService, job_id: str, poll_seconds: float) -> None:
        """Begin to watch the job, at version 0.

        Args:
            service: where the job is.
            job_id: of the job.
            poll_seconds: how late a change may be known, where the database tells of none [s].
        """
        self.version = 0
        self.streams = 0
        self._service = service
        self._job_id = job_id
        self._changed = asyncio.Event()
        self._reads: dict[tuple[int, int | None], asyncio.Task[News]] = {}
        self._loop = asyncio.get_running_loop()
        self._watch = ExitStack()
        changes = service.store.changes
        self._watch.enter_context(changes.watch(job_id, self._wake, poll_seconds=poll_seconds))

    def close(self) -> None:
        """Watch the job no more."""
        self._watch.close()

    def _wake(self) -> None:
        """For any thread. The server may have ended meanwhile."""
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self.advance)

    def advance(self) -> None:
        """Go on to the next version, and wake those who wait for it."""
        self.version += 1
        self._changed.set()
        self._changed = asyncio.Event()

    async def changed(self, version: int, *, seconds: float) -> None:
        """Wait until the topic has another version.

        Args:
            version: that which is known already.
            seconds: after so long the wait is over in any case [s].
        """
        with anyio.move_on_after(seconds):
            if self.version == version:
                await self._changed.wait()

    async def news(self, after: int | None, *, limit: int) -> News:
        """Read the job, and then what it has committed.

        Streams that ask for the same at the same version share the answer while it is under way.

        Args:
            after: only iterations with a greater index; None for all.
            limit: most iterations; the same for all streams.

        Returns:
            The job, and the iterations in order: whatever the job counts as committed is among
            them, or on the next pages.

        Raises:
            NotFound: the job is gone.
            StoreUnavailable: the database does not answer.
        """
        key = (self.version, after)
        task = self._reads.get(key)
        if task is None:
            task = asyncio.ensure_future(run_sync(self._read, after, limit))
            self._reads[key] = task
            task.add_done_callback(lambda done: self._forget(key, done))
        # Who has gone must not take the answer from the others.
        return await asyncio.shield(task)

    def _read(self, after: int | None, limit: int) -> News:
        job = self._service.job(self._job_id)
        if job.progress.iterations <= (-1 if after is None else after) + 1:
            return News(job, ())
        found = self._service.iterations(self._job_id, after=after, limit=limit)
        return News(job, found.items)

    def _forget(self, key: tuple[int, int | None], task: asyncio.Task[News]) -> None:
        del self._reads[key]
        if not task.cancelled():
            # Else it would be complained of where all who asked have gone.
            task.exception()


class Topics:
    """All topics of a server. Of one event loop."""

    def __init__(self) -> None:
        self._topics: dict[tuple[int, str], Topic] = {}

    @contextmanager
    def follow(self, service: JobService, job_id: str, *, poll_seconds: float) -> Iterator[Topic]:
        """Follow a job inside the block.

        Args:
            service: where the job is.
            job_id: of the job.
            poll_seconds: how late a change may be known, where the database tells of none [s].

        Yields:
            The job's topic, the same for all who follow the job.
        """
        # A topic keeps its service alive, so that no other one has that id.
        key = (id(service), job_id)
        topic = self._topics.get(key)
        if topic is None:
            topic = self._topics[key] = Topic(service, job_id, poll_seconds)
        topic.streams += 1
        try:
            yield topic
        finally:
            topic.streams -= 1
            if topic.streams == 0:
                del self._topics[key]
                topic.close()

    async def end_with(self, stopping: asyncio.Event) -> None:
        """Wake all streams when the server begins to stop.

        Args:
            stopping: set then.
        """
        await stopping.wait()
        for topic in self._topics.values():
            topic.advance()
