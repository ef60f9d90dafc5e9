"""Composition of the HTTP application."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

from fastapi import FastAPI, Request, Response
from fastapi_offline import FastAPIOffline
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware
from starlette.responses import RedirectResponse

from api.context import ApiContext
from api.documentation import ASSETS, add_documentation
from api.middleware import BodyLimitMiddleware, RequestIdMiddleware
from api.openapi import DESCRIPTION, TAGS, document_headers, document_problems
from api.page import add_page
from api.page_folder import FOLDER
from api.problems import add_problem_handlers
from api.routes import (
    analysis,
    catalogue,
    estimates,
    health,
    history,
    jobs,
    recordings,
    simulations,
    walks,
)
from api.security import SameSiteMiddleware, SecurityHeadersMiddleware
from gaitswarm.settings import Settings
from gaitswarm.views import PREFIX, ParticlesHeaderView
from gaitswarm.views.replay import ReplayHeaderView
from services.optimizer.service import JobService

_REDIRECTIONS: Final = {
    "/healthz": f"{PREFIX}/healthz",
    "/readyz": f"{PREFIX}/readyz",
}

# Event streams must not wait for a full block. Numbers in binary hardly become shorter, and
# downloads are as long as a job's history: compressing either costs more time than it saves.
_UNCOMPRESSED: Final = (
    *DEFAULT_EXCLUDED_CONTENT_TYPES,
    "application/octet-stream",
    "application/vnd.apache.parquet",
    "text/csv",
)


def create_app(service: JobService, *, settings: Settings, page_folder: Path = FOLDER) -> FastAPI:
    """The application around a service: routes, problems, limits, documentation, page.

    page_folder: of the built page; there need be none.
    Nothing is opened or started; the service's store stays its owner's to close.
    """
    # The documentation's scripts come with the package: /docs works without the internet.
    app = FastAPIOffline(
        docs_url=None,
        redoc_url=None,
        static_url=ASSETS,
        title="gaitswarm",
        version=_version(),
        summary="Robust drive controllers for walking robots",
        description=DESCRIPTION,
        openapi_tags=TAGS,
        separate_input_output_schemas=False,
    )
    app.state.context = ApiContext(service, settings)
    for module in (
        jobs,
        history,
        analysis,
        estimates,
        recordings,
        simulations,
        walks,
        catalogue,
        health,
    ):
        app.include_router(module.router)
    for path, target in _REDIRECTIONS.items():
        app.add_route(path, _redirection(target), include_in_schema=False)
    add_documentation(app)
    add_page(app, page_folder)
    add_problem_handlers(app)
    document_problems(app)
    document_headers(app, ReplayHeaderView, ParticlesHeaderView)
    app.add_middleware(BodyLimitMiddleware, max_bytes=settings.api_max_body_bytes)
    app.add_middleware(
        GZipMiddleware, minimum_size=1024, compresslevel=6, exclude_content_types=_UNCOMPRESSED
    )
    app.add_middleware(SameSiteMiddleware)
    app.add_middleware(RequestIdMiddleware)
    # The outermost: an answer to a bug has the headers too.
    app.add_middleware(SecurityHeadersMiddleware)
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
