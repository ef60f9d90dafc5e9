"""What routes ask for: the service, room to compute, the job of a path, and its paging."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass
from typing import Annotated, Final, TypedDict, cast

import anyio
from fastapi import Depends, FastAPI, Path, Query, Request
from pydantic import Field
from starlette.types import Scope

from gaitswarm.api.answers import Answers
from gaitswarm.api.rates import OpenStreams
from gaitswarm.api.slots import AskersSlots, ComputingSlots
from gaitswarm.api.topics import Topics
from gaitswarm.services.monitoring.activity import Activity
from gaitswarm.services.monitoring.metrics import Metrics
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.settings import Settings

_VALIDATIONS: Final = 2
"""Bodies that are validated at once: threads of Python take turns, the event loop's among them."""

_READINGS: Final = 2
"""Frequent questions that are read for at once. More threads would take turns as well, and spread
over more connections, each of which has to read anew what another one knows."""

_WAITING: Final = 8
"""The same where a server is asked: as many as connections to it stay open. More threads would take
turns with the event loop's, and open connections for a question each."""


@dataclass(frozen=True, slots=True)
class Component:
    """A part of the server's process that /v1/readyz tells of.

    Attributes:
        name: for people and programs, such as `runner`.
        trouble: says at once what is wrong with it; None if nothing is.
        vital: whether the server is not ready while something is.
    """

    name: str
    trouble: Callable[[], str | None]
    vital: bool = True


class State(TypedDict):
    """`request.state` of every request: what the lifespan of the application yields.

    slots: for walks. analyses: for what reads whole histories. validations: threads that validate
    bodies. readings: threads that read for frequent questions. waiting_readings: those of them
    that wait for a server. draining: set by the server on the
    first signal to end; it still answers then. stopping: set when it begins to stop; event streams
    end then. topics: jobs that these streams follow. streams: that are open, by asker. components:
    parts of the process beside the database. metrics: of this process. activity: what happens to
    the jobs that it runs, if it runs any. answers: that are remembered.
    """

    settings: Settings
    slots: ComputingSlots
    analyses: ComputingSlots
    validations: anyio.CapacityLimiter
    readings: anyio.CapacityLimiter
    waiting_readings: anyio.CapacityLimiter
    draining: asyncio.Event
    streams: OpenStreams
    stopping: asyncio.Event
    topics: Topics
    components: Sequence[Component]
    metrics: Metrics
    activity: Activity | None
    answers: Answers


def lifespan(
    settings: Settings,
    components: Sequence[Component],
    metrics: Metrics,
    activity: Activity | None = None,
) -> Callable[[FastAPI], AbstractAsyncContextManager[State]]:
    """The lifespan of an application."""

    @asynccontextmanager
    async def run(_app: FastAPI) -> AsyncIterator[State]:
        topics, stopping = Topics(), asyncio.Event()
        waking = asyncio.create_task(topics.end_with(stopping))
        workers, queue = settings.api_simulation_workers, settings.api_simulation_queue
        analysts, waiting = settings.api_analysis_workers, settings.api_analysis_queue
        yield State(
            settings=settings,
            slots=ComputingSlots("simulations", workers, queue),
            analyses=ComputingSlots("analyses", analysts, waiting),
            validations=anyio.CapacityLimiter(_VALIDATIONS),
            readings=anyio.CapacityLimiter(_READINGS),
            waiting_readings=anyio.CapacityLimiter(_WAITING),
            draining=asyncio.Event(),
            stopping=stopping,
            topics=topics,
            components=components,
            streams=OpenStreams(settings.api_max_streams),
            metrics=metrics,
            activity=activity,
            answers=Answers(),
        )
        waking.cancel()

    return run


async def service(request: Request) -> JobService:
    """The application's service."""
    return service_of(request.scope)


def service_of(scope: Scope) -> JobService:
    """The same, where routes and their dependencies are not asked for."""
    return cast(JobService, scope["app"].state.service)


async def settings(request: Request) -> Settings:
    """The application's settings."""
    return cast(Settings, request.state.settings)


async def slots(request: Request) -> AskersSlots:
    """The application's room for walks on request, as whoever asks may use it."""
    return AskersSlots(cast(ComputingSlots, request.state.slots), request.state.asker)


async def activity(request: Request) -> Activity | None:
    """What happens to the jobs that this process runs, if it runs any."""
    return cast("Activity | None", request.state.activity)


async def counted_stream(request: Request) -> AsyncIterator[None]:
    """A stream of whoever asks, until its answer has ended."""
    with cast(OpenStreams, request.state.streams).one_of(request.state.asker):
        yield


async def _analysing(request: Request) -> AsyncIterator[None]:
    """A slot for a question about whole histories, until the answer is there."""
    async with cast(ComputingSlots, request.state.analyses).one(request.state.asker):
        yield


Analysing = Depends(_analysing, scope="function")
"""Of routes that read and judge whole histories in Python, whose threads take turns."""


async def stopping(request: Request) -> asyncio.Event:
    """Set when the server begins to stop."""
    return cast(asyncio.Event, request.state.stopping)


async def topics(request: Request) -> Topics:
    """Jobs that event streams follow."""
    return cast(Topics, request.state.topics)


async def metrics(request: Request) -> Metrics:
    """What this process tells monitoring systems."""
    return cast(Metrics, request.state.metrics)


async def answers(request: Request) -> Answers:
    """Answers that are remembered."""
    return cast(Answers, request.state.answers)


Service = Annotated[JobService, Depends(service)]
ServerSettings = Annotated[Settings, Depends(settings)]
Slots = Annotated[AskersSlots, Depends(slots)]
JobActivities = Annotated[Activity | None, Depends(activity)]
Stopping = Annotated[asyncio.Event, Depends(stopping)]
FollowedJobs = Annotated[Topics, Depends(topics)]
ServerMetrics = Annotated[Metrics, Depends(metrics)]
Remembered = Annotated[Answers, Depends(answers)]

LARGEST_INDEX: Final = 2**31 - 1
"""Of an iteration, as the database's integers have it."""

AfterIteration = Annotated[
    int | None,
    Query(ge=0, le=LARGEST_INDEX, description="Only iterations with a greater index."),
]

JobIdText = Annotated[
    str, Field(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_-]+$", examples=["k2q7zr5dm9xw"])
]

JobId = Annotated[
    JobIdText, Path(description="Identifier of the job, as POST /v1/jobs answered it.")
]


def existing_job(job_id: JobId, service: Service) -> Job:
    """The job of the path, read before any answer has begun."""
    return service.job(job_id)


ExistingJob = Annotated[Job, Depends(existing_job)]


def check_length(settings: Settings, seconds: float, *, logged: bool, field: str) -> None:
    """Refuse walks that last too long together."""
    limit = settings.api_max_logged_seconds if logged else settings.api_max_simulated_seconds
    if seconds > limit:
        raise InvalidRequest(
            f"the walks last {seconds:g} s together, more than the {limit:g} s allowed"
            f"{' with logs' if logged else ''}; choose fewer scenarios or cycles",
            field=field,
        )


def check_sampled_length(settings: Settings, seconds: float) -> None:
    """Refuse a sample of designs whose walks last too long together."""
    limit = settings.api_max_sampled_seconds
    if seconds > limit:
        raise InvalidRequest(
            f"the walks of all designs last {seconds:g} s together, more than the {limit:g} s"
            " allowed; choose fewer samples or scenarios",
            field="samples",
        )
