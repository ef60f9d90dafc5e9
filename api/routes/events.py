"""The event stream of a job: committed iterations and changes of state."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator
from typing import Annotated, Final

import anyio
from fastapi import APIRouter, Header, Query
from fastapi.responses import StreamingResponse
from fastapi.sse import KEEPALIVE_COMMENT, format_sse_event
from starlette.types import Receive, Scope, Send

from gaitswarm.api.access import Revocation, UntilRevoked
from gaitswarm.api.dependencies import (
    LARGEST_INDEX,
    AfterIteration,
    ExistingJob,
    FollowedJobs,
    ServerMetrics,
    ServerSettings,
    Service,
    Stopping,
)
from gaitswarm.api.documentation import problems
from gaitswarm.api.topics import PAGE, Topic
from gaitswarm.services.monitoring.metrics import OpenStream
from gaitswarm.services.optimizer.errors import NotFound, StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.views import PREFIX

router = APIRouter(prefix=f"{PREFIX}/jobs/{{job_id}}", tags=["history"])

KEEP_ALIVE_SECONDS: Final = 15.0
"""Silence after which a comment is sent, for proxies that close idle connections [s]."""

_RECONNECT: Final = 1000
"""Time after which a client reconnects to a stopped server [ms]."""

_REVOKED: Final = format_sse_event(comment="the token was revoked")

_STREAM: Final = """\
event: iteration
data: {"index":24,"designs":25,"best":21.3,"mean":25.2,"median":23.9,"worst":41.7,\
"best_so_far":20.9,"failed":2,"evaluate_seconds":1.23,"committed_at":"2026-01-01T12:00:00Z"}
id: 24

event: state
data: {"id":"k2q7zr5dm9xw","state":"succeeded","error":null,"iterations":25,"evaluations":625,\
"waiting":null}

"""

_EVENT_SCHEMA: Final = {
    "type": "object",
    "properties": {
        "data": {"type": "string"},
        "event": {"type": "string"},
        "id": {"type": "string"},
        "retry": {"type": "integer", "minimum": 0},
    },
}
"""Schema of one event (OpenAPI 3.2)."""

_HEADERS: Final = {"Cache-Control": "no-cache", "X-Accel-Buffering": "no"}


class EventStream(StreamingResponse):
    """A stream of encoded events that ends with its events, its client, or its token."""

    media_type = "text/event-stream"

    def __init__(self, events: AsyncGenerator[bytes, None], until_revoked: Revocation) -> None:
        self._texts = _kept_alive(events, until_revoked)
        super().__init__(self._texts, headers=_HEADERS)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one ASGI exchange."""
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


@router.get(
    "/events",
    operation_id="stream_events",
    summary="Follow a job",
    # The schema of EventStream would be a string.
    response_class=StreamingResponse,
    response_description="Server-sent events `iteration`, `state` and `deleted`.",
    responses={
        200: {"content": {"text/event-stream": {"example": _STREAM, "itemSchema": _EVENT_SCHEMA}}},
        **problems(404, 422),
    },
)
async def stream_events(
    job: ExistingJob,
    service: Service,
    settings: ServerSettings,
    topics: FollowedJobs,
    stopping: Stopping,
    metrics: ServerMetrics,
    until_revoked: UntilRevoked,
    last_event_id: Annotated[
        int | None,
        Header(
            alias="Last-Event-ID",
            ge=0,
            le=LARGEST_INDEX,
            description="Id of the last event received; the stream continues with the next."
            " Browsers send it when they reconnect.",
        ),
    ] = None,
    after: AfterIteration = None,
    follow: Annotated[
        bool, Query(description="False: end the stream after the committed iterations.")
    ] = True,
    limit: Annotated[
        int | None,
        Query(ge=1, le=LARGEST_INDEX, description="End the stream after this many iterations."),
    ] = None,
) -> EventStream:
    """Stream committed iterations as server-sent events.

    An event `iteration` is sent once for each committed iteration, in order; its id is the
    iteration's index, its data an IterationView. An event `state`, without an id, is sent on
    connecting and whenever the job's state or its reason to wait changes; its data is a StateView.
    The stream ends after the event of a final state. A broken stream continues without gap or
    repetition from `Last-Event-ID` (or `after`). Comments keep idle connections alive. The stream
    of a deleted job ends with an event `deleted`, whose data has its `id`. A stopping server sends
    a comment and the field `retry`. With a revoked token the stream ends within seconds.
    """
    start = after if last_event_id is None else last_event_id
    poll_seconds = settings.api_event_poll_seconds

    async def events() -> AsyncGenerator[bytes, None]:
        with (
            topics.follow(service, job.id, poll_seconds=poll_seconds) as topic,
            metrics.open_stream() as stream,
        ):
            texts = _events(
                topic,
                job.id,
                stream,
                after=start,
                follow=follow,
                limit=limit,
                stopping=stopping,
                pause_seconds=poll_seconds,
            )
            async for text in texts:
                yield text

    return EventStream(events(), until_revoked)


async def _events(
    topic: Topic,
    job_id: str,
    stream: OpenStream,
    *,
    after: int | None,
    follow: bool,
    limit: int | None,
    stopping: asyncio.Event,
    pause_seconds: float,
) -> AsyncGenerator[bytes, None]:
    """Yield committed iterations, then changes of the state, then wait for the next change.

    The events of one read are one text. No transaction is open while waiting. Ends after a terminal
    state, after `limit` iterations, when the server stops, when the job is deleted, or after the
    committed iterations unless `follow`.
    """
    sent_state: tuple[JobState, str | None] | None = None
    version: int | None = None
    left = LARGEST_INDEX if limit is None else limit
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
            stream.sent(iteration.committed_at)
        caught_up = left > 0 and len(news.iterations) < PAGE
        job = news.job
        if caught_up and (job.state, job.waiting) != sent_state:
            sent_state = (job.state, job.waiting)
            texts.append(news.state)
        if texts:
            yield b"".join(texts)
        if left == 0 or (caught_up and (job.state.terminal or not follow)):
            return
        version = news.version if caught_up else None
    yield format_sse_event(comment="the server is stopping", retry=_RECONNECT)
