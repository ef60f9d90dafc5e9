"""Metrics for Prometheus: requests are counted, and GET /metrics answers."""

from __future__ import annotations

import time
from typing import Final

from fastapi import FastAPI, Request, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gaitswarm.services.monitoring.metrics import Metrics

METRICS_PATH: Final = "/metrics"

_METHODS: Final = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})

_NO_ROUTE: Final = "none"
"""Of requests that no route took; their paths may be anything."""


class MetricsMiddleware:
    """Counts every request by method, template of its route and status, and times its answer."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self.app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One ASGI exchange."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        begun = time.perf_counter()

        async def send_counted(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._count(scope, message["status"], time.perf_counter() - begun)
            await send(message)

        await self.app(scope, receive, send_counted)

    def _count(self, scope: Scope, status: int, seconds: float) -> None:
        method = scope["method"] if scope["method"] in _METHODS else "other"
        route = getattr(scope.get("route"), "path", None) or _NO_ROUTE
        self._metrics.http_requests.labels(method, route, str(status)).inc()
        self._metrics.http_seconds.labels(method, route).observe(seconds)


def add_metrics(app: FastAPI, metrics: Metrics) -> None:
    """Answer GET /metrics to whomever `AccessMiddleware` lets through."""

    def answer(request: Request) -> Response:
        text, media_type = metrics.exposition(request.headers.get("accept", ""))
        return Response(text, headers={"Content-Type": media_type, "Cache-Control": "no-store"})

    app.add_route(METRICS_PATH, answer, include_in_schema=False)
