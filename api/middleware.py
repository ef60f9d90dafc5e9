"""ASGI middleware of every request: id, metrics and headers, host and origin, body limit."""

from __future__ import annotations

import logging
import re
import socket
import time
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Final
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gaitswarm.api.problems import internal_error, problem
from gaitswarm.services.monitoring.metrics import Metrics
from gaitswarm.services.optimizer.errors import GaitswarmError
from gaitswarm.services.optimizer.log_context import log_context

_log = logging.getLogger("gaitswarm.api")

REQUEST_ID: Final = "X-Request-ID"
_ACCEPTABLE_ID: Final = re.compile(r"^[A-Za-z0-9_.-]{1,128}$")

_METHODS: Final = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
_HOST: Final = re.compile(r"(?:\[([0-9a-f:.]+)\]|([^\[\]:]*))(?::[0-9]*)?")
"""An IPv6 address in brackets or a name, and a port."""

_SAFE_METHODS: Final = frozenset({"GET", "HEAD", "OPTIONS"})

_NO_ROUTE: Final = "none"
"""Route label of requests that match no route; their paths are arbitrary."""

_SAME_SITE: Final = frozenset({"same-origin", "none"})
"""Sec-Fetch-Site values of this server's page and of addresses that the user types."""

_DRAINED: Final = 32
"""Rejected bodies are read up to this multiple of the limit: closing a connection with unread data
resets it, and the client would not see the answer."""


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


@dataclass(eq=False)
class ResponseMiddleware:
    """Finish every response: request id, security headers, metrics, and unexpected exceptions.

    A client's own id is kept if it has 1 to 128 letters, digits, `_`, `.` or `-`.
    """

    app: ASGIApp
    metrics: Metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        sent = Headers(scope=scope)
        given = sent.get(REQUEST_ID, "")
        request_id = given if _ACCEPTABLE_ID.match(given) else uuid.uuid4().hex
        received_at = time.perf_counter()
        started = False

        async def send_finished(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                headers = MutableHeaders(scope=message)
                headers[REQUEST_ID] = request_id
                if "content-length" in sent and "transfer-encoding" in sent:
                    # A proxy may read the rest of the connection differently (RFC 9112, 6.1).
                    headers["Connection"] = "close"
                for name, value in _HEADERS.items():
                    headers.setdefault(name, value)
                self._count(scope, message["status"], time.perf_counter() - received_at)
            await send(message)

        with log_context(request=request_id):
            try:
                await self.app(scope, receive, send_finished)
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
                await response(scope, receive, send_finished)

    def _count(self, scope: Scope, status: int, seconds: float) -> None:
        method = scope["method"] if scope["method"] in _METHODS else "other"
        route = getattr(scope.get("route"), "path", None) or _NO_ROUTE
        self.metrics.http_requests.labels(method, route, str(status)).inc()
        self.metrics.http_seconds.labels(method, route).observe(seconds)


class OriginMiddleware:
    """Reject requests that browsers send on behalf of other sites.

    A page of another site can make its name resolve to this server's address (DNS rebinding), but
    its browser sends that name as Host; addresses cannot be rebound. State-changing requests must
    come from this server's pages, by Origin and Sec-Fetch-Site, which scripts cannot forge. Other
    clients send neither.
    """

    def __init__(self, app: ASGIApp, host: str, allowed: Sequence[str]) -> None:
        self.app = app
        self._allowed = frozenset(map(str.lower, allowed))
        names = ("localhost", host.lower(), socket.gethostname().lower())
        self._names = self._allowed.union(names)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        refusal = self._refusal(scope) if scope["type"] == "http" else None
        await (refusal or self.app)(scope, receive, send)

    def _refusal(self, scope: Scope) -> Response | None:
        headers = Headers(scope=scope)
        host = headers.get("host")
        if host is not None and not self._is_own(host.lower()):
            detail = (
                f"unknown host name {host!r}; to allow it, add it to the server's"
                " GAITSWARM_API_ALLOWED_HOSTS"
            )
            return problem(scope["path"], "unknown-host", detail)
        if scope["method"] not in _SAFE_METHODS and not self._is_same_origin(headers):
            detail = "requests from pages of another origin are not allowed; use this server's page"
            return problem(scope["path"], "cross-origin", detail)
        return None

    def _is_own(self, host: str) -> bool:
        match = _HOST.fullmatch(host)
        name = "" if match is None else match[1] or match[2]
        if not self._names.isdisjoint((host, name)):
            return True
        try:
            ip_address(name)
        except ValueError:
            return False
        return True

    def _is_same_origin(self, headers: Headers) -> bool:
        origin = headers.get("origin")
        if origin is None:
            return headers.get("sec-fetch-site", "none") in _SAME_SITE
        # Behind a TLS proxy the scheme differs from the server's.
        host = urlsplit(origin.lower()).netloc
        return bool(host) and (host == headers.get("host", "").lower() or host in self._allowed)


@dataclass(eq=False)
class BodyLimitMiddleware:
    """Reject bodies over a limit, larger at some paths, with or without a declared length."""

    app: ASGIApp
    max_bytes: int
    larger: Mapping[str, int]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        path = scope["path"].removeprefix(scope.get("root_path", ""))
        limit = max(self.max_bytes, self.larger.get(path, 0))
        declared = Headers(scope=scope).get("content-length", "")
        is_too_large = declared.isdecimal() and int(declared) > limit
        received = 0

        async def receive_limited() -> Message:
            nonlocal received
            message = await receive()
            received += len(message.get("body", b""))
            if received <= limit and not is_too_large:
                return message
            while message.get("more_body", False) and received < _DRAINED * limit:
                message = await receive()
                received += len(message.get("body", b""))
            advice = "a job spec has a few kilobytes"
            if limit > self.max_bytes:
                advice = "leave out cycles, or raise GAITSWARM_API_MAX_LOG_BYTES on the server"
            raise HTTPException(413, f"the body is larger than {limit} bytes; {advice}")

        await self.app(scope, receive_limited, send)
