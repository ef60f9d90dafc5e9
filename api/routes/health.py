"""Whether the server lives, and whether it can work."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from typing import Literal

from fastapi import APIRouter, FastAPI, Request, Response
from pydantic import Field
from starlette.responses import RedirectResponse

from gaitswarm.api.dependencies import Service
from gaitswarm.api.documentation import problems
from gaitswarm.api.problems import unavailable
from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.views import PREFIX, FieldErrorView, View

_log = logging.getLogger("gaitswarm.api")

router = APIRouter(prefix=PREFIX, tags=["health"])


class HealthView(View):
    """Good news; bad news is a problem."""

    status: Literal["ok"] = Field(default="ok", description="Always `ok`.", examples=["ok"])


class ComponentView(View):
    """How a part of the server is."""

    name: str = Field(
        description="`database`; `events` tells streams of commits; `runner` claims queued jobs;"
        " `workers` run their walks.",
        examples=["runner"],
    )
    status: Literal["ok", "degraded", "failed"] = Field(
        description="`degraded`: something is wrong, but the server can do without for a while.",
        examples=["ok"],
    )
    detail: str = Field(default="", description="What is wrong, and what to do about it.")


class ReadinessView(View):
    """The server can work."""

    status: Literal["ok"] = Field(default="ok", description="Always `ok`.", examples=["ok"])
    components: list[ComponentView] = Field(description="Its parts, none of which has failed.")


@router.get(
    "/healthz",
    operation_id="healthz",
    summary="Is the server alive?",
    responses=problems(asks=False),
)
async def healthz() -> HealthView:
    """Answers as long as the process does; asks nothing else."""
    return HealthView()


@router.get(
    "/readyz",
    operation_id="readyz",
    summary="Can it work?",
    response_model=ReadinessView,
    responses=problems(asks=False),
)
def readyz(service: Service, request: Request) -> ReadinessView | Response:
    """Answers ok, component by component, if none has failed; else 503, whose `errors` name those
    that have.

    The database fails if it does not answer, has another schema than this version's, or is a file
    that was removed or replaced while it was open; the runner and the news for event streams fail
    if their thread has ended or is stuck. Once the server was told
    to end, while jobs commit their iterations under way, the answer is a 503 of the type
    `draining`.
    """
    path = request.url.path
    if request.state.draining.is_set():
        return unavailable(
            path, "this server was told to end, and gives its jobs back to the queue", "draining"
        )
    components = list(_components(service, request))
    failed = [component for component in components if component.status == "failed"]
    if failed:
        errors = [FieldErrorView(field=found.name, message=found.detail) for found in failed]
        detail = "; ".join(f"{error.field}: {error.message}" for error in errors)
        return unavailable(path, detail, errors=errors)
    return ReadinessView(components=components)


def _components(service: JobService, request: Request) -> Iterator[ComponentView]:
    try:
        service.store.ping()
    except StoreUnavailable as error:
        _log.error("%s: %s", request.url.path, error)
        yield ComponentView(name="database", status="failed", detail=error.for_clients)
    else:
        yield ComponentView(name="database", status="ok")
    for component in request.state.components:
        trouble = component.trouble()
        if trouble is None:
            yield ComponentView(name=component.name, status="ok")
        else:
            status: Literal["failed", "degraded"] = "failed" if component.vital else "degraded"
            yield ComponentView(name=component.name, status=status, detail=trouble)


def add_short_paths(app: FastAPI) -> None:
    """Send those on who ask for /healthz and /readyz, as probes are used to.

    Args:
        app: takes on the redirections.
    """
    for path in ("/healthz", "/readyz"):
        app.add_route(path, _redirection(f"{PREFIX}{path}"), include_in_schema=False)


def _redirection(target: str) -> Callable[[Request], Response]:
    def redirect(request: Request) -> Response:
        return RedirectResponse(request.scope.get("root_path", "") + target)

    return redirect
