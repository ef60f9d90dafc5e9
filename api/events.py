"""The stream of a job's committed iterations and changes of state."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from typing import Final

import anyio
from anyio.to_thread import run_sync
from fastapi.sse import ServerSentEvent

from api.context import ApiContext
from gaitswarm.views import IterationView, StateView
from services.optimizer.errors import StoreUnavailable
from services.optimizer.jobs.job import Iteration, Job, JobState
from services.optimizer.service import JobService

_PAGE: Final = 200


async def job_events(
    context: ApiContext, job_id: str, *, after: int | None, follow: bool, limit: int | None
) -> AsyncGenerator[ServerSentEvent, None]:
    """Poll the store: what is committed first, then the state if it is another.

    Nothing is held between polls, neither a connection nor a transaction. Ends after a terminal
    state, after `limit` iterations, with the server, or when caught up unless `follow`.
    """
    told: JobState | None = None
    sent = 0
    while not context.stopping.is_set():
        try:
            job, iterations = await run_sync(_news, context.service, job_id, after)
        except StoreUnavailable:
            # The database is away: what is committed will still be there when it is back.
            await _pause(context)
            continue
        for iteration in iterations:
            after = iteration.index
            view = IterationView.from_iteration(iteration)
            yield ServerSentEvent(event="iteration", id=str(after), data=view)
            sent += 1
            if sent == limit:
                return
        if len(iterations) == _PAGE:
            continue
        if job.state is not told:
            told = job.state
            yield ServerSentEvent(event="state", data=StateView.from_job(job))
        if job.state.terminal or not follow:
            return
        await _pause(context)


def _news(service: JobService, job_id: str, after: int | None) -> tuple[Job, tuple[Iteration, ...]]:
    """The job, and up to a page of its iterations after one.

    The job is read first: whatever it counts as committed is then found among the iterations, so
    nothing is missing when a terminal state ends the stream.
    """
    job = service.job(job_id)
    if job.progress.iterations <= (-1 if after is None else after) + 1:
        return job, ()
    return job, service.iterations(job_id, after=after, limit=_PAGE).items


async def _pause(context: ApiContext) -> None:
    """Until the next poll, or until the server stops."""
    with anyio.move_on_after(context.settings.api_event_poll_seconds):
        await context.stopping.wait()
