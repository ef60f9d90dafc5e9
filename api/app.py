"""Composition of the HTTP application."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from typing import Final

from fastapi import FastAPI, Request, Response
from fastapi_offline import FastAPIOffline
from starlette.responses import RedirectResponse

from api.context import ApiContext
from api.middleware import BodyLimitMiddleware, RequestIdMiddleware
from api.openapi import DESCRIPTION, TAGS, document_problems
from api.problems import add_problem_handlers
from api.routes import catalogue, health, history, jobs, simulations
from api.settings import ApiSettings
from api.views import PREFIX
from services.optimizer.service import JobService

_REDIRECTIONS: Final = {
    "/": "/docs",
    "/healthz": f"{PREFIX}/healthz",
    "/readyz": f"{PREFIX}/readyz",
}


def create_app(service: JobService, *, settings: ApiSettings) -> FastAPI:
    """The application around a service: routes, problems, limits, documentation.

    Nothing is opened or started; the service's store stays its owner's to close.
    """
    # The documentation's scripts come with the package: /docs works without the internet.
    app = FastAPIOffline(
        docs_url="/docs",
        redoc_url=None,
        static_url="/docs-assets",
        title="gaitswarm",
        version=_version(),
        summary="Robust drive controllers for walking robots",
        description=DESCRIPTION,
        openapi_tags=TAGS,
        separate_input_output_schemas=False,
    )
    app.state.context = ApiContext(service, settings)
    for module in (jobs, history, simulations, catalogue, health):
        app.include_router(module.router)
    for path, target in _REDIRECTIONS.items():
        app.add_route(path, _redirection(target), include_in_schema=False)
    add_problem_handlers(app)
    document_problems(app)
    app.add_middleware(BodyLimitMiddleware, max_bytes=settings.max_body_bytes)
    app.add_middleware(RequestIdMiddleware)
    return app


def _redirection(target: str) -> Callable[[Request], Response]:
    """An endpoint that sends a client on to another path."""

    def redirect(request: Request) -> Response:
        return RedirectResponse(request.scope.get("root_path", "") + target)

    return redirect


def _version() -> str:
    """Of the installed package; a bare checkout has none."""
    try:
        return version("gaitswarm")
    except PackageNotFoundError:
        return "0+unknown"
