"""State of a server: what routes depend on, its liveness and its readiness."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal, TypeVar, cast

from anyio import CapacityLimiter
from anyio.to_thread import run_sync
from fastapi import APIRouter, Depends, FastAPI, Path, Request, Response
from pydantic import Field
from starlette.responses import RedirectResponse

from gaitswarm.api.documentation import problems
from gaitswarm.api.events import Topics
from gaitswarm.api.problems import unavailable
from gaitswarm.jobs.operation import JobIdText
from gaitswarm.services.monitoring.activity import Activity
from gaitswarm.services.monitoring.metrics import Metrics
from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.views import View
from gaitswarm.settings import Settings
from gaitswarm.views.base import PREFIX, FieldErrorView

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


_log = logging.getLogger("gaitswarm.api")

router = APIRouter(prefix=PREFIX, tags=["operations"])


Status = Literal["ok", "degraded", "failed"]


class HealthView(View):
    """The server is alive."""

    status: Literal["ok"] = Field(default="ok", description="Always `ok`.", examples=["ok"])


class ComponentView(View):
    """Status of a component."""

    name: str = Field(examples=["runner"])
    """`database`; `events` notifies event streams; `runner` claims queued jobs; `workers` run their
    simulations."""
    status: Status = Field(examples=["ok"])
    """`degraded`: a problem that the server tolerates for a while."""
    detail: str = Field(default="", description="The problem and its remedy.")


class ReadinessView(HealthView):
    """The server is ready."""

    components: list[ComponentView] = Field(description="Components, none of which has failed.")


@router.get(
    "/healthz",
    operation_id="healthz",
    summary="Check liveness",
    responses=problems(guarded=False),
)
async def healthz() -> HealthView:
    """Return ok as long as the process runs; no other component is checked."""
    return HealthView()


@router.get(
    "/readyz",
    operation_id="readyz",
    summary="Check readiness",
    response_model=ReadinessView,
    responses=problems(guarded=False),
)
def readyz(service: Service, request: Request) -> ReadinessView | Response:
    """Return the status of every component, or 503 whose `errors` name those that have failed.

    The database fails if it does not answer, has a schema of another version, or is a file that was
    removed or replaced while it was open; the runner and the events fail if their thread has ended
    or is stuck. While the server shuts down and jobs commit their current iterations, the response
    is a 503 of the type `draining`.
    """
    path = request.url.path
    if request.state.draining.is_set():
        return unavailable(
            path, "the server is shutting down and returns its jobs to the queue", "draining"
        )
    components = list(_components(service, request))
    failed = [component for component in components if component.status == "failed"]
    if failed:
        errors = [FieldErrorView(field=part.name, message=part.detail) for part in failed]
        detail = "; ".join(f"{error.field}: {error.message}" for error in errors)
        return unavailable(path, detail, errors=errors)
    return ReadinessView(components=components)


def _components(service: JobService, request: Request) -> Iterator[ComponentView]:
    try:
        service.store.ping()
    except StoreUnavailable as error:
        _log.error("%r: %s", request.url.path, error)
        yield ComponentView(name="database", status="failed", detail=error.for_clients)
    else:
        yield ComponentView(name="database", status="ok")
    for component in request.state.components:
        trouble = component.trouble()
        status: Status = "ok" if trouble is None else "failed" if component.vital else "degraded"
        yield ComponentView(name=component.name, status=status, detail=trouble or "")


def add_short_paths(app: FastAPI) -> None:
    """Redirect the usual paths of probes, /healthz and /readyz."""

    def redirect(request: Request) -> Response:
        root = request.scope.get("root_path", "")
        return RedirectResponse(f"{root}{PREFIX}{request.url.path.removeprefix(root)}")

    for path in ("/healthz", "/readyz"):
        app.add_route(path, redirect, include_in_schema=False)
