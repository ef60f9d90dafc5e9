"""ASGI middleware of every request: id, metrics, host and origin checks, body limit, headers."""

from __future__ import annotations

import logging
import re
import time
import uuid
from collections.abc import Mapping, Sequence
from typing import Final
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gaitswarm.api.problems import internal_error, problem
from gaitswarm.services.monitoring.hosts import HostNames
from gaitswarm.services.monitoring.metrics import Metrics
from gaitswarm.services.optimizer.errors import GaitswarmError
from gaitswarm.services.optimizer.log_context import log_context

_log = logging.getLogger("gaitswarm.api")

REQUEST_ID: Final = "X-Request-ID"
_ACCEPTABLE_ID: Final = re.compile(r"^[A-Za-z0-9_.-]{1,128}$")

_METHODS: Final = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
_SAFE_METHODS: Final = frozenset({"GET", "HEAD", "OPTIONS"})

_NO_ROUTE: Final = "none"
"""Route label of requests that match no route; their paths are arbitrary."""

_SAME_SITE: Final = frozenset({"same-origin", "none"})
"""Sec-Fetch-Site values of this server's page and of addresses that the user types."""

_DRAINED: Final = 32
"""Rejected bodies are read up to this multiple of the limit: closing a connection with unread data
resets it, and the client would not see the answer."""


class RequestIdMiddleware:
    """Set X-Request-ID on every response and answer unexpected exceptions.

    A client's own id is kept if it has 1 to 128 letters, digits, `_`, `.` or `-`.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one ASGI exchange."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        given = Headers(scope=scope).get(REQUEST_ID, "")
        request_id = given if _ACCEPTABLE_ID.match(given) else uuid.uuid4().hex
        started = False

        async def send_with_id(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                MutableHeaders(scope=message)[REQUEST_ID] = request_id
            await send(message)

        with log_context(request=request_id):
            try:
                await self.app(scope, receive, send_with_id)
            except Exception as error:
                what = f"{scope['method']} {scope['path']!r} (request {request_id})"
                # Starlette wraps errors that are raised after the response has started.
                cause = error if isinstance(error, GaitswarmError) else error.__cause__
                if started and isinstance(cause, GaitswarmError):
                    _log.error("%s: response aborted: %s", what, cause)
                    return
                _log.exception(what)
                if started:
                    raise
                response = internal_error(scope["path"], request_id)
                await response(scope, receive, send_with_id)


class MetricsMiddleware:
    """Count and time requests by method, route template and status."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self.app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one ASGI exchange."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        started = time.perf_counter()

        async def send_counted(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._count(scope, message["status"], time.perf_counter() - started)
            await send(message)

        await self.app(scope, receive, send_counted)

    def _count(self, scope: Scope, status: int, seconds: float) -> None:
        method = scope["method"] if scope["method"] in _METHODS else "other"
        route = getattr(scope.get("route"), "path", None) or _NO_ROUTE
        self._metrics.http_requests.labels(method, route, str(status)).inc()
        self._metrics.http_seconds.labels(method, route).observe(seconds)


class HostMiddleware:
    """Reject requests whose Host is not a name of this server (DNS rebinding)."""

    def __init__(self, app: ASGIApp, names: HostNames) -> None:
        self.app = app
        self.names = names

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one ASGI exchange."""
        host = Headers(scope=scope).get("host") if scope["type"] == "http" else None
        refusal = self.names.refusal(host)
        if refusal is not None:
            response = problem(scope["path"], "unknown-host", refusal)
            await response(scope, receive, send)
            return
        await self.app(scope, receive, send)


class SameOriginMiddleware:
    """Reject state-changing requests from pages of other origins.

    Decided by Origin and Sec-Fetch-Site, which browsers send and scripts cannot forge; other
    clients send neither.
    """

    def __init__(self, app: ASGIApp, allowed: Sequence[str]) -> None:
        self.app = app
        self.allowed = frozenset(name.lower() for name in allowed)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one ASGI exchange."""
        if scope["type"] == "http" and scope["method"] not in _SAFE_METHODS:
            headers = Headers(scope=scope)
            if not self._is_same_origin(headers):
                detail = "requests from pages of another origin are not allowed; use this"
                response = problem(scope["path"], "cross-origin", f"{detail} server's page")
                await response(scope, receive, send)
                return
        await self.app(scope, receive, send)

    def _is_same_origin(self, headers: Headers) -> bool:
        origin = headers.get("origin")
        if origin is None:
            return headers.get("sec-fetch-site", "none") in _SAME_SITE
        # Behind a TLS proxy the scheme differs from the server's.
        host = urlsplit(origin.lower()).netloc
        return bool(host) and (host == headers.get("host", "").lower() or host in self.allowed)


class BodyLimitMiddleware:
    """Reject bodies over a limit, whether or not their length was declared.

    larger: limits of single paths [B].
    """

    def __init__(
        self, app: ASGIApp, max_bytes: int, larger: Mapping[str, int] | None = None
    ) -> None:
        self.app = app
        self.max_bytes = max_bytes
        self.larger = larger or {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one ASGI exchange."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        path = scope["path"].removeprefix(scope.get("root_path", ""))
        limit = max(self.max_bytes, self.larger.get(path, 0))
        length = Headers(scope=scope).get("content-length", "")
        if length.isdecimal() and int(length) > limit:
            await self._drain(receive, 0, limit)
            advice = "a job spec has a few kilobytes"
            if limit > self.max_bytes:
                advice = "leave out cycles, or raise GAITSWARM_API_MAX_LOG_BYTES on the server"
            detail = f"the body is larger than {limit} bytes; {advice}"
            response = problem(scope["path"], "body-too-large", detail)
            await response(scope, receive, send)
            return
        received = 0

        async def receive_limited() -> Message:
            nonlocal received
            message = await receive()
            received += len(message.get("body", b""))
            if received > limit:
                await self._drain(receive, received, limit)
                raise HTTPException(413)
            return message

        await self.app(scope, receive_limited, send)

    async def _drain(self, receive: Receive, received: int, limit: int) -> None:
        more = True
        while more and received < _DRAINED * limit:
            message = await receive()
            received += len(message.get("body", b""))
            more = message.get("more_body", False)


def security_policy(*, script_src: str = "'self'", style_src: str = "'self'") -> str:
    """Return a content security policy: this server's files and data only, no frames."""
    return (
        f"default-src 'none'; script-src {script_src}; style-src {style_src};"
        " img-src 'self' data: blob:; connect-src 'self'; font-src 'self'; base-uri 'none';"
        " form-action 'none'; frame-ancestors 'none'"
    )


_HEADERS: Final = {
    "Content-Security-Policy": security_policy(),
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class SecurityHeadersMiddleware:
    """Set security headers on every response that does not set them itself."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one ASGI exchange."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self.app(scope, receive, send_with_headers)
