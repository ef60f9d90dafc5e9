"""Event streams of jobs: each followed job is watched and read once for all its streams."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator, Awaitable, Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import anyio
from anyio.to_thread import run_sync
from fastapi.responses import StreamingResponse
from fastapi.sse import KEEPALIVE_COMMENT, format_sse_event
from pydantic import BaseModel, Field
from starlette.types import Receive, Scope, Send

from gaitswarm.jobs.operation import LARGEST_INDEX, AfterIteration
from gaitswarm.services.monitoring.metrics import Metrics
from gaitswarm.services.optimizer.errors import NotFound, StoreUnavailable
from gaitswarm.services.optimizer.jobs.iteration import Iteration
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.views.job import IterationView, StateView

Revocation = Callable[[], Awaitable[None]]
"""Returns when the token of a request was revoked."""

PAGE: Final = 200
"""Maximum number of iterations per read."""

KEEP_ALIVE_SECONDS: Final = 15.0
"""Silence after which a comment is sent, for proxies that close idle connections [s]."""

_RECONNECT: Final = 1000
"""Time after which a client reconnects to a stopped server [ms]."""

_REVOKED: Final = format_sse_event(comment="the token was revoked")

_EXAMPLE: Final = """\
event: iteration
data: {"index":24,"designs":25,"best":21.3,"mean":25.2,"median":23.9,"worst":41.7,\
"best_so_far":20.9,"failed":2,"evaluate_seconds":1.23,"committed_at":"2026-01-01T12:00:00Z"}
id: 24

event: state
data: {"id":"k2q7zr5dm9xw","state":"succeeded","error":null,"iterations":25,"evaluations":625,\
"waiting":null}

"""

_SCHEMA: Final = {
    "type": "object",
    "properties": {
        "data": {"type": "string"},
        "event": {"type": "string"},
        "id": {"type": "string"},
        "retry": {"type": "integer", "minimum": 0},
    },
}
"""Schema of one event (OpenAPI 3.2)."""

EVENTS: Final[dict[int | str, Any]] = {
    200: {"content": {"text/event-stream": {"example": _EXAMPLE, "itemSchema": _SCHEMA}}}
}
"""Documentation of a stream."""

_HEADERS: Final = {"Cache-Control": "no-cache", "X-Accel-Buffering": "no"}

_LONGEST_WAIT: Final = 60.0
"""Time after which a job is read again without a notification [s]."""


class EventsQuery(BaseModel):
    """Where a stream of events begins and ends."""

    after: AfterIteration = None
    follow: bool = Field(
        default=True, description="False: end the stream after the committed iterations."
    )
    limit: int | None = Field(
        default=None,
        ge=1,
        le=LARGEST_INDEX,
        description="End the stream after this many iterations.",
    )


@dataclass(frozen=True)
class News:
    """A job and its next iterations as read at a topic's version, with events encoded once."""

    version: int
    job: Job
    iterations: tuple[Iteration, ...]

    @cached_property
    def events(self) -> tuple[bytes, ...]:
        views = map(IterationView.model_validate, self.iterations)
        return tuple(
            format_sse_event(event="iteration", id=str(view.index), data_str=view.model_dump_json())
            for view in views
        )

    @cached_property
    def state(self) -> bytes:
        text = StateView.from_job(self.job).model_dump_json()
        return format_sse_event(event="state", data_str=text)


class Topic:
    """A job that streams follow, and a version of it for each change. Bound to one event loop."""

    def __init__(self, service: JobService, job_id: str, poll_seconds: float) -> None:
        self.version = 0
        self.streams = 0
        self._service = service
        self._job_id = job_id
        self._loop = asyncio.get_running_loop()
        self._ended = self._loop.create_future()
        # Of this version: its end, and reads by the index after which iterations are read.
        self._changed = asyncio.Event()
        self._reads: dict[int | None, asyncio.Task[News]] = {}
        self._timer = self._loop.call_later(_LONGEST_WAIT, self.advance)
        self._watch = ExitStack()
        changes = service.store.changes
        self._watch.enter_context(changes.watch(job_id, self._wake, poll_seconds=poll_seconds))

    def close(self) -> None:
        self._timer.cancel()
        self._watch.close()

    def _wake(self) -> None:
        """Thread-safe. The loop may have ended meanwhile."""
        with suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self.advance)

    def advance(self) -> None:
        """Begin the next version, and wake the streams that wait for it."""
        self._timer.cancel()
        self._timer = self._loop.call_later(_LONGEST_WAIT, self.advance)
        self.version += 1
        self._reads = {}
        self._changed.set()
        self._changed = asyncio.Event()

    def end(self) -> None:
        """Return None to all waiting streams and to later ones."""
        if not self._ended.done():
            self._ended.set_result(None)
        self._changed.set()

    async def news(self, after: int | None, *, known: int | None = None) -> News | None:
        """Return the job and its iterations after an index; None when the server stops."""
        if known == self.version and not self._ended.done():
            await self._changed.wait()
        read = self._reads.get(after)
        # A read that has ended is news for streams that knew an earlier version, unless it failed.
        if read is None or (read.done() and (known is None or read.exception() is not None)):
            read = asyncio.create_task(run_sync(self._look, self.version, after))
            # Streams may be gone before it fails.
            read.add_done_callback(lambda task: task.cancelled() or task.exception())
            self._reads[after] = read
        await asyncio.wait([read, self._ended], return_when=asyncio.FIRST_COMPLETED)
        return None if self._ended.done() else read.result()

    def _look(self, version: int, after: int | None) -> News:
        job = self._service.job(self._job_id)
        if job.progress.iterations <= (-1 if after is None else after) + 1:
            return News(version, job, ())
        page = self._service.store.iterations(self._job_id, after=after, limit=PAGE)
        return News(version, job, page.items)


class Topics:
    """Topics of a server. Bound to one event loop."""

    def __init__(self) -> None:
        self._topics: dict[tuple[int, str], Topic] = {}

    @contextmanager
    def follow(self, service: JobService, job_id: str, *, poll_seconds: float) -> Iterator[Topic]:
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


class EventStream(StreamingResponse):
    """A stream of encoded events that ends with its events, its client, or its token."""

    media_type = "text/event-stream"

    def __init__(self, events: AsyncGenerator[bytes, None], until_revoked: Revocation) -> None:
        self._texts = _kept_alive(events, until_revoked)
        super().__init__(self._texts, headers=_HEADERS)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            await self._texts.aclose()


async def _kept_alive(
    events: AsyncGenerator[bytes, None], until_revoked: Revocation
) -> AsyncGenerator[bytes, None]:
    """Yield events, and comments during long silences, until the token is revoked."""
    following: asyncio.Task[bytes | None] | None = None
    revoked = asyncio.ensure_future(until_revoked())
    try:
        while True:
            following = following or asyncio.ensure_future(anext(events, None))
            await asyncio.wait(
                [following, revoked],
                timeout=KEEP_ALIVE_SECONDS,
                return_when=asyncio.FIRST_COMPLETED,
            )
            if revoked.done():
                revoked.result()
                yield _REVOKED
                return
            if not following.done():
                yield KEEPALIVE_COMMENT
                continue
            text, following = following.result(), None
            if text is None:
                return
            yield text
    finally:
        waiting = [revoked] if following is None else [revoked, following]
        for task in waiting:
            task.cancel()
        await asyncio.wait(waiting)
        await events.aclose()


async def job_events(
    followed: AbstractContextManager[Topic],
    job_id: str,
    query: EventsQuery,
    metrics: Metrics,
    stopping: asyncio.Event,
    *,
    pause_seconds: float,
) -> AsyncGenerator[bytes, None]:
    """Yield committed iterations, then changes of the state, then wait for the next change."""
    after = query.after
    sent_state: tuple[JobState, str | None] | None = None
    version: int | None = None
    left = LARGEST_INDEX if query.limit is None else query.limit
    with followed as topic, metrics.open_stream() as observe_commit:
        while not stopping.is_set():
            try:
                news = await topic.news(after, known=version)
            except StoreUnavailable:
                # Committed iterations will still be there when the database is back.
                version = None
                with anyio.move_on_after(pause_seconds):
                    await stopping.wait()
                continue
            except NotFound:
                yield format_sse_event(event="deleted", data_str=json.dumps({"id": job_id}))
                return
            if news is None:
                break
            sent = news.iterations[:left]
            texts = list(news.events[:left])
            left -= len(sent)
            for iteration in sent:
                after = iteration.index
                observe_commit(iteration.committed_at)
            caught_up = left > 0 and len(news.iterations) < PAGE
            job = news.job
            if caught_up and (job.state, job.waiting) != sent_state:
                sent_state = (job.state, job.waiting)
                texts.append(news.state)
            if texts:
                yield b"".join(texts)
            if left == 0 or (caught_up and (job.state.terminal or not query.follow)):
                return
            version = news.version if caught_up else None
        yield format_sse_event(comment="the server is stopping", retry=_RECONNECT)
