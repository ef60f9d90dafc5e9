"""Liveness and readiness of the server."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from typing import Literal

from fastapi import APIRouter, FastAPI, Request, Response
from pydantic import Field
from starlette.responses import RedirectResponse

from gaitswarm.api.dependencies import Service
from gaitswarm.api.documentation import problems
from gaitswarm.api.problems import unavailable
from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.views import View
from gaitswarm.views.base import PREFIX, FieldErrorView

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
