"""The stream of a job's committed iterations and changes of state."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator
from typing import Annotated, Final

import anyio
from fastapi import APIRouter, Depends, Header, Query
from fastapi.responses import StreamingResponse
from fastapi.sse import format_sse_event

from gaitswarm.api.access import UntilRevoked
from gaitswarm.api.dependencies import (
    LARGEST_INDEX,
    AfterIteration,
    ExistingJob,
    FollowedJobs,
    ServerMetrics,
    ServerSettings,
    Service,
    Stopping,
    counted_stream,
)
from gaitswarm.api.documentation import problems
from gaitswarm.api.event_stream import EVENT_SCHEMA, EventStream
from gaitswarm.api.topics import PAGE, Topic
from gaitswarm.services.monitoring.metrics import OpenStream
from gaitswarm.services.optimizer.errors import NotFound, StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.views import PREFIX

router = APIRouter(prefix=f"{PREFIX}/jobs/{{job_id}}", tags=["history"])

_STREAM: Final = """\
event: iteration
data: {"index":24,"designs":25,"best":21.3,"mean":25.2,"median":23.9,"worst":41.7,\
"best_so_far":20.9,"failed":2,"evaluate_seconds":1.23,"committed_at":"2026-01-01T12:00:00Z"}
id: 24

event: state
data: {"id":"k2q7zr5dm9xw","state":"succeeded","error":null,"iterations":25,"evaluations":625,\
"waiting":null}

"""

_RECONNECT: Final = 1000
"""After so long a client is to connect again that has lost its server [ms]."""


@router.get(
    "/events",
    dependencies=[Depends(counted_stream)],
    operation_id="stream_events",
    summary="Follow a job",
    # Not EventStream, whose schema would be a string.
    response_class=StreamingResponse,
    response_description="Server-sent events `iteration`, `state` and `deleted`.",
    responses={
        200: {"content": {"text/event-stream": {"example": _STREAM, "itemSchema": EVENT_SCHEMA}}},
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
            description="Id of the last event received; the stream goes on with the next. Browsers"
            " send it by themselves when they reconnect.",
        ),
    ] = None,
    after: AfterIteration = None,
    follow: Annotated[
        bool, Query(description="False: end the stream when all that is committed has been sent.")
    ] = True,
    limit: Annotated[
        int | None,
        Query(ge=1, le=LARGEST_INDEX, description="End the stream after this many iterations."),
    ] = None,
) -> EventStream:
    """Committed iterations as they come, as server-sent events.

    An event `iteration` is sent once for each committed iteration, in order; its id is the
    iteration's index, its data an IterationView. An event `state`, without an id, is sent on
    connecting and whenever the job's state, or what it waits for, changes; its data is a StateView.
    The stream ends after the event of a final state. A broken stream goes on without gap or repeat
    from `Last-Event-ID` (or `after`). Comments keep idle connections alive. The stream of a job
    that is deleted ends with an event `deleted`, whose data has its `id`. A server that ends says
    so in a comment, and in a field `retry` when to connect again. With a token that is revoked the
    stream ends within seconds.
    """
    start = after if last_event_id is None else last_event_id
    poll_seconds = settings.api_event_poll_seconds

    async def events() -> AsyncGenerator[bytes, None]:
        with (
            topics.follow(service, job.id, poll_seconds=poll_seconds) as topic,
            metrics.open_stream() as stream,
        ):
            found = _events(
                topic,
                job.id,
                stream,
                after=start,
                follow=follow,
                limit=limit,
                stopping=stopping,
                pause_seconds=poll_seconds,
            )
            async for text in found:
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
    """What is committed first, then the state if it is another, then wait for a change.

    All that one look finds is one text. No transaction is held while it waits. Ends after a
    terminal state, after `limit` iterations, with the server, with the job, or when caught up
    unless `follow`.
    """
    told: tuple[JobState, str | None] | None = None
    known: int | None = None
    left = LARGEST_INDEX if limit is None else limit
    while not stopping.is_set():
        try:
            news = await topic.news(after, known=known)
        except StoreUnavailable:
            # The database is away: what is committed will still be there when it is back.
            known = None
            await _pause(stopping, pause_seconds)
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
        if caught_up and (job.state, job.waiting) != told:
            told = (job.state, job.waiting)
            texts.append(news.state)
        if texts:
            yield b"".join(texts)
        if left == 0 or (caught_up and (job.state.terminal or not follow)):
            return
        known = news.version if caught_up else None
    yield format_sse_event(comment="the server is ending", retry=_RECONNECT)


async def _pause(stopping: asyncio.Event, seconds: float) -> None:
    """Until the database is asked again, or until the server stops."""
    with anyio.move_on_after(seconds):
        await stopping.wait()
