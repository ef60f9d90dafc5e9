"""Composition of the HTTP application."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

from fastapi import FastAPI
from fastapi_offline import FastAPIOffline
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware

from gaitswarm.api.access import AccessMiddleware
from gaitswarm.api.answers import LEAST_COMPRESSED
from gaitswarm.api.dependencies import Component, lifespan
from gaitswarm.api.direct import DirectAnswers
from gaitswarm.api.documentation import ASSETS, DESCRIPTION, TAGS, add_documentation
from gaitswarm.api.manual import FOLDER as MANUAL
from gaitswarm.api.manual import add_manual
from gaitswarm.api.middleware import (
    BodyLimitMiddleware,
    HeaderLimitMiddleware,
    RequestIdMiddleware,
    SecurityHeadersMiddleware,
)
from gaitswarm.api.monitoring import MetricsMiddleware, add_metrics
from gaitswarm.api.origin import HostMiddleware, SameOriginMiddleware
from gaitswarm.api.page import FOLDER, add_page
from gaitswarm.api.problems import add_problem_handlers
from gaitswarm.api.rates import RequestRate
from gaitswarm.api.routes import (
    activity as activities,
)
from gaitswarm.api.routes import (
    analysis,
    audit,
    calibration,
    catalogue,
    certificate,
    commands,
    comparison,
    events,
    firmware,
    health,
    history,
    identification,
    jobs,
    labels,
    meshes,
    notifications,
    reference,
    robots,
    session,
    simulations,
)
from gaitswarm.services.monitoring.activity import Activity
from gaitswarm.services.monitoring.collectors import QueueCollector
from gaitswarm.services.monitoring.hosts import HostNames
from gaitswarm.services.monitoring.metrics import Metrics
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.settings import Settings

# Event streams must not wait for a full block. Numbers in binary hardly become shorter, and
# downloads are as long as a job's history: compressing either costs more time than it saves.
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
    page_folder: Path = FOLDER,
    manual_folder: Path = MANUAL,
    metrics: Metrics | None = None,
    components: Sequence[Component] = (),
    activity: Activity | None = None,
) -> FastAPI:
    """The application around a service: routes, problems, limits, documentation, page.

    Nothing is opened or started; the service's store stays its owner's to close.
    """
    metrics = metrics or Metrics()
    metrics.registry.register(QueueCollector(lambda: service.store))
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
        lifespan=lifespan(settings, components, metrics, activity),
    )
    app.state.service = service
    # The routes themselves, as their modules have made them: to include a router makes each of
    # them once more at an application's first request, which takes a tenth of a second.
    for module in (
        jobs,
        commands,
        activities,
        labels,
        notifications,
        history,
        events,
        analysis,
        calibration,
        certificate,
        comparison,
        reference,
        firmware,
        identification,
        simulations,
        catalogue,
        robots,
        meshes,
        audit,
        session,
        health,
    ):
        app.router.routes.extend(module.router.routes)
    health.add_short_paths(app)
    add_metrics(app, metrics)
    add_documentation(app)
    add_page(app, page_folder)
    add_manual(app, manual_folder)
    add_problem_handlers(app)
    # The innermost: what it answers has the limits and headers of all other answers.
    app.add_middleware(DirectAnswers)
    app.add_middleware(
        BodyLimitMiddleware,
        max_bytes=settings.api_max_body_bytes,
        larger={identification.MEASURED: settings.api_max_log_bytes},
    )
    app.add_middleware(
        GZipMiddleware,
        minimum_size=LEAST_COMPRESSED,
        compresslevel=6,
        exclude_content_types=_UNCOMPRESSED,
    )
    app.add_middleware(
        AccessMiddleware,
        tokens=lambda: service.store.tokens,
        rate=RequestRate(settings.api_request_rate, settings.api_request_burst),
        required=settings.tokens_required,
    )
    allowed = settings.api_allowed_hosts
    app.add_middleware(SameOriginMiddleware, allowed=allowed)
    app.add_middleware(HostMiddleware, names=HostNames(settings.api_host, allowed))
    app.add_middleware(HeaderLimitMiddleware, max_bytes=settings.api_max_header_bytes)
    app.add_middleware(RequestIdMiddleware)
    app.add_middleware(MetricsMiddleware, metrics=metrics)
    # The outermost: an answer to a bug has the headers too.
    app.add_middleware(SecurityHeadersMiddleware)
    return app


def _version() -> str:
    """Of the installed package; a bare checkout has none."""
    try:
        return version("gaitswarm")
    except PackageNotFoundError:
        return "0+unknown"
