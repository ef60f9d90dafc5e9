"""Whether the server lives, and whether it can work."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from fastapi import APIRouter, FastAPI, Request, Response
from pydantic import Field
from starlette.responses import RedirectResponse

from api.dependencies import Service
from api.documentation import problems
from gaitswarm.views import PREFIX, View
from services.optimizer.errors import EvaluatorUnavailable

router = APIRouter(prefix=PREFIX, tags=["health"])


class HealthView(View):
    """Good news; bad news is a problem."""

    status: Literal["ok"] = Field(default="ok", description="Always `ok`.", examples=["ok"])


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
    "/readyz", operation_id="readyz", summary="Can it work?", responses=problems(asks=False)
)
def readyz(service: Service, request: Request) -> HealthView:
    """Answers ok if the database does and has this version's schema, and a runner that was started
    with the server still claims jobs; else 503.
    """
    service.store.ping()
    runs_jobs: Callable[[], bool] | None = request.state.runs_jobs
    if runs_jobs is not None and not runs_jobs():
        raise EvaluatorUnavailable(
            "this server's runner has ended, and runs no more jobs; restart the server"
        )
    return HealthView()


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
