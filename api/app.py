"""The HTTP application: routes, problems, limits, documentation and the page around a service."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from fastapi import FastAPI, Request, Response
from fastapi_offline import FastAPIOffline
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware
from starlette.routing import Route

from gaitswarm.api import access, health, routes
from gaitswarm.api.access import METRICS_PATH, AccessMiddleware, TokenGuesses
from gaitswarm.api.dependencies import Component, lifespan
from gaitswarm.api.documentation import ASSETS, DESCRIPTION, TAGS, add_documentation
from gaitswarm.api.middleware import BodyLimitMiddleware, OriginMiddleware, ResponseMiddleware
from gaitswarm.api.page import MANUAL_FOLDER, PAGE_FOLDER, add_manual, add_page
from gaitswarm.api.problems import add_problem_handlers
from gaitswarm.services.monitoring.activity import Activity
from gaitswarm.services.monitoring.metrics import Metrics, QueueCollector
from gaitswarm.services.optimizer.jobs.provenance import installed_version
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.settings import Settings
from gaitswarm.views.base import PREFIX

# Event streams must not wait for a full block; binary numbers and long downloads gain little.
_UNCOMPRESSED: Final = (
    *DEFAULT_EXCLUDED_CONTENT_TYPES,
    "application/octet-stream",
    "application/vnd.apache.parquet",
    "text/csv",
)


def create_app(
    service: JobService,
    *,
    settings: Settings,
    page_folder: Path = PAGE_FOLDER,
    manual_folder: Path = MANUAL_FOLDER,
    metrics: Metrics | None = None,
    components: Sequence[Component] = (),
    activity: Activity | None = None,
) -> FastAPI:
    """Create the application. The caller keeps ownership of the service's store."""
    metrics = metrics or Metrics()
    metrics.registry.register(QueueCollector(lambda: app.state.service.store))
    # The scripts of /docs are part of the package, so that it works offline.
    app = FastAPIOffline(
        docs_url=None,
        redoc_url=None,
        static_url=ASSETS,
        title="gaitswarm",
        version=installed_version(),
        summary="Robust drive controllers for walking robots",
        description=DESCRIPTION,
        openapi_tags=TAGS,
        separate_input_output_schemas=False,
        lifespan=lifespan(settings, components, metrics, activity),
    )
    app.state.service = service
    app.state.guesses = guesses = TokenGuesses()
    # Routes are added directly: `include_router` would build each of them twice.
    for router in (routes.router, access.router, health.router):
        app.router.routes.extend(router.routes)
    health.add_short_paths(app)
    app.router.routes.append(metrics_route(metrics))
    add_documentation(app)
    add_page(app, page_folder)
    add_manual(app, manual_folder)
    add_problem_handlers(app)
    # From the innermost to the outermost.
    app.add_middleware(
        BodyLimitMiddleware,
        max_bytes=settings.api_max_body_bytes,
        larger={f"{PREFIX}/measured-walks": settings.api_max_log_bytes},
    )
    app.add_middleware(
        GZipMiddleware,
        minimum_size=1024,
        # Level 6 takes three times as long and saves a tenth.
        compresslevel=1,
        exclude_content_types=_UNCOMPRESSED,
    )
    app.add_middleware(
        AccessMiddleware,
        tokens=lambda: app.state.service.store.tokens,
        guesses=guesses,
        required=settings.tokens_required,
    )
    app.add_middleware(OriginMiddleware, host=settings.api_host, allowed=settings.api_allowed_hosts)
    app.add_middleware(ResponseMiddleware, metrics=metrics)
    return app


def metrics_route(metrics: Metrics) -> Route:
    def answer(request: Request) -> Response:
        text, media_type = metrics.exposition(request.headers.get("accept", ""))
        return Response(text, headers={"Content-Type": media_type, "Cache-Control": "no-store"})

    return Route(METRICS_PATH, answer, include_in_schema=False)
