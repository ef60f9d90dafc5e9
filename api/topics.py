"""Jobs that event streams follow: each is watched and read once for all its streams."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Final

from anyio.to_thread import run_sync
from fastapi.sse import format_sse_event

from gaitswarm.services.optimizer.jobs.iteration import Iteration
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.views import IterationView, StateView

PAGE: Final = 200
"""Maximum number of iterations per read."""

_LONGEST_WAIT: Final = 60.0
"""Time after which a job is read again without a notification [s]."""


@dataclass(frozen=True)
class News:
    """A job and its next iterations, with events that are encoded once.

    Attributes:
        version: Version of the topic when the job was read.
        iterations: In order; at most `PAGE`.
    """

    version: int
    job: Job
    iterations: tuple[Iteration, ...]

    @cached_property
    def events(self) -> tuple[bytes, ...]:
        """Encoded events `iteration`, one for each iteration."""
        views = map(IterationView.from_iteration, self.iterations)
        return tuple(
            format_sse_event(event="iteration", id=str(view.index), data_str=view.model_dump_json())
            for view in views
        )

    @cached_property
    def state(self) -> bytes:
        """The encoded event `state`."""
        text = StateView.from_job(self.job).model_dump_json()
        return format_sse_event(event="state", data_str=text)


_Waiters = dict[asyncio.Future[News | None], None]
"""Streams that wait for the same result; None tells them that the server stops."""

_Question = tuple[int, int | None]
"""A version of the topic, and the index after which iterations are read."""


class Topic:
    """A job that streams follow. Bound to one event loop.

    version: number of changes of the job noticed by this process.
    """

    def __init__(self, service: JobService, job_id: str, poll_seconds: float) -> None:
        self.version = 0
        self.streams = 0
        self._service = service
        self._job_id = job_id
        self._idle: dict[int | None, _Waiters] = {}
        self._reads: dict[_Question, _Waiters] = {}
        self._tasks: set[asyncio.Task[News]] = set()
        self._latest: tuple[_Question, News] | None = None
        self._ended = False
        self._loop = asyncio.get_running_loop()
        self._timer = self._loop.call_later(_LONGEST_WAIT, self.advance)
        self._watch = ExitStack()
        changes = service.store.changes
        self._watch.enter_context(changes.watch(job_id, self._wake, poll_seconds=poll_seconds))

    def close(self) -> None:
        """Stop watching the job."""
        self._timer.cancel()
        self._watch.close()

    def _wake(self) -> None:
        """Thread-safe. The loop may have ended meanwhile."""
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self.advance)

    def advance(self) -> None:
        """Begin the next version, and read the job for waiting streams."""
        self._timer.cancel()
        self._timer = self._loop.call_later(_LONGEST_WAIT, self.advance)
        self.version += 1
        idle, self._idle = self._idle, {}
        for after, waiters in idle.items():
            if waiters:
                self._read(after, waiters)

    def end(self) -> None:
        """Return None to all waiting streams and to later ones."""
        self._ended = True
        for waiters in (*self._idle.values(), *self._reads.values()):
            for waiter in waiters:
                if not waiter.done():
                    waiter.set_result(None)

    async def news(self, after: int | None, *, known: int | None = None) -> News | None:
        """Return the job and its iterations after an index; None when the server stops.

        known: the caller's version; waits until there is a later one. Streams with the same
        question share one read.
        """
        if self._ended:
            return None
        question = (self.version, after)
        if known == self.version:
            waiters = self._idle.setdefault(after, {})
        elif known is not None and self._latest is not None and self._latest[0] == question:
            return self._latest[1]
        elif question in self._reads:
            waiters = self._reads[question]
        else:
            waiters = self._read(after, {})
        waiter: asyncio.Future[News | None] = self._loop.create_future()
        waiters[waiter] = None
        try:
            return await waiter
        finally:
            # Disconnected streams do not wait for the next change.
            waiters.pop(waiter, None)

    def _read(self, after: int | None, waiters: _Waiters) -> _Waiters:
        """Begin to read for these streams, and for those that join until it is done."""
        question = (self.version, after)
        self._reads[question] = waiters
        task = asyncio.ensure_future(run_sync(self._look, self.version, after))
        self._tasks.add(task)
        task.add_done_callback(partial(self._read_is_done, question))
        return waiters

    def _look(self, version: int, after: int | None) -> News:
        job = self._service.job(self._job_id)
        if job.progress.iterations <= (-1 if after is None else after) + 1:
            return News(version, job, ())
        page = self._service.iterations(self._job_id, after=after, limit=PAGE)
        return News(version, job, page.items)

    def _read_is_done(self, question: _Question, task: asyncio.Task[News]) -> None:
        self._tasks.discard(task)
        waiters = self._reads.pop(question)
        if task.cancelled():
            # The loop is ending.
            return
        if task.exception() is None and question[0] == self.version:
            self._latest = question, task.result()
        failed = task.exception()
        for waiter in waiters:
            if waiter.done():
                continue
            if failed is None:
                waiter.set_result(task.result())
            else:
                waiter.set_exception(failed)


class Topics:
    """Topics of a server. Bound to one event loop."""

    def __init__(self) -> None:
        self._topics: dict[tuple[int, str], Topic] = {}

    @contextmanager
    def follow(self, service: JobService, job_id: str, *, poll_seconds: float) -> Iterator[Topic]:
        """Follow a job inside the block."""
        # A topic keeps its service alive, so the id is unique.
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
        """End all streams when the server begins to stop."""
        await stopping.wait()
        for topic in self._topics.values():
            topic.end()
