"""Dependencies of routes: the service, computing capacity, and the job of a path."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass
from typing import Annotated, Any, Final, TypeVar, cast

from anyio import CapacityLimiter
from anyio.to_thread import run_sync
from fastapi import Depends, FastAPI, Path, Request

from gaitswarm.api.events import Topics
from gaitswarm.jobs.operation import JobIdText
from gaitswarm.services.monitoring.activity import Activity
from gaitswarm.services.monitoring.metrics import Metrics
from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.settings import Settings

T = TypeVar("T")

_VALIDATIONS: Final = 2
"""Bodies validated at the same time; more threads would starve the event loop of the GIL."""


@dataclass(frozen=True, slots=True)
class Component:
    """A part of the server's process that /v1/readyz reports; a vital one makes it unready."""

    name: str
    trouble: Callable[[], str | None]
    vital: bool = True


@dataclass(frozen=True, slots=True)
class ComputingCapacity:
    """Limit of requests that compute at the same time. Bound to one event loop."""

    limiter: CapacityLimiter
    queue: int

    async def run(self, work: Callable[[], T]) -> T:
        """Compute in a thread when there is capacity."""
        is_busy = self.limiter.available_tokens <= 0
        if is_busy and self.limiter.statistics().tasks_waiting >= self.queue:
            raise EvaluatorUnavailable(
                "too many requests are waiting to compute; try again in a few seconds"
            )
        return await run_sync(work, limiter=self.limiter)


def lifespan(
    settings: Settings,
    components: Sequence[Component],
    metrics: Metrics,
    activity: Activity | None = None,
) -> Callable[[FastAPI], AbstractAsyncContextManager[Mapping[str, Any]]]:
    """Return the lifespan of an application, which yields `request.state` of every request."""

    @asynccontextmanager
    async def run(_app: FastAPI) -> AsyncIterator[Mapping[str, Any]]:
        topics, stopping = Topics(), asyncio.Event()
        ending = asyncio.create_task(topics.end_with(stopping))
        limiter = CapacityLimiter(settings.api_compute_workers)
        yield {
            "settings": settings,
            "computing": ComputingCapacity(limiter, settings.api_compute_queue),
            "validations": CapacityLimiter(_VALIDATIONS),
            "draining": asyncio.Event(),
            "stopping": stopping,
            "topics": topics,
            "components": components,
            "metrics": metrics,
            "activity": activity,
        }
        ending.cancel()

    return run


async def service(request: Request) -> JobService:
    return cast(JobService, request.app.state.service)


def _state(name: str) -> Any:
    """Return a dependency on an entry of `request.state`."""

    async def entry(request: Request) -> Any:
        return getattr(request.state, name)

    return Depends(entry)


Service = Annotated[JobService, Depends(service)]
ServerSettings = Annotated[Settings, _state("settings")]
Computing = Annotated[ComputingCapacity, _state("computing")]
Stopping = Annotated[asyncio.Event, _state("stopping")]
FollowedJobs = Annotated[Topics, _state("topics")]
ServerMetrics = Annotated[Metrics, _state("metrics")]

JobId = Annotated[JobIdText, Path(description="Id of the job, as POST /v1/jobs returned it.")]


def existing_job(job_id: JobId, service: Service) -> Job:
    return service.job(job_id)


ExistingJob = Annotated[Job, Depends(existing_job)]
