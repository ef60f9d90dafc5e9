"""What happens to every request: an id, a limit on its body, an answer even to a bug.

And what a browser may do with the answers.
"""

from __future__ import annotations

import logging
import re
import uuid
from collections.abc import Mapping
from typing import Final

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gaitswarm.api.problems import MOST_HEADERS, headers_too_large, internal_error, problem
from gaitswarm.services.optimizer.errors import GaitswarmError
from gaitswarm.services.optimizer.log_context import log_context

_log = logging.getLogger("gaitswarm.api")

REQUEST_ID: Final = "X-Request-ID"
_ACCEPTABLE_ID: Final = re.compile(r"^[A-Za-z0-9_.-]{1,128}$")

_DRAINED: Final = 32
"""Refused bodies are read up to this many times the limit, so that the client sees the answer:
closing a connection with unread data resets it."""


class RequestIdMiddleware:
    """Names every request in the header X-Request-ID and answers exceptions that nobody expected.

    A client's own id is kept if it is one of up to 128 letters, digits, `_`, `.` and `-`.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One ASGI exchange."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        given = Headers(scope=scope).get(REQUEST_ID, "")
        request_id = given if _ACCEPTABLE_ID.match(given) else uuid.uuid4().hex
        started = False

        async def send_named(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                MutableHeaders(scope=message)[REQUEST_ID] = request_id
            await send(message)

        with log_context(request=request_id):
            try:
                await self.app(scope, receive, send_named)
            except Exception as error:
                what = f"{scope['method']} {scope['path']} (request {request_id})"
                # Too late for a problem: breaking the connection is the only honest answer.
                if started and (expected := _expected(error)) is not None:
                    _log.error("%s: broken off: %s", what, expected)
                    return
                _log.exception(what)
                if started:
                    raise
                response = internal_error(scope["path"], request_id)
                await response(scope, receive, send_named)


def _expected(error: Exception) -> GaitswarmError | None:
    """What was raised on purpose; Starlette wraps what it can no longer answer."""
    found = error if isinstance(error, GaitswarmError) else error.__cause__
    return found if isinstance(found, GaitswarmError) else None


class HeaderLimitMiddleware:
    """Refuses requests with very many or very long headers, or a very long path, with a problem.

    Heads that do not come in one piece are refused before, by `gaitswarm.api.connections`.
    """

    def __init__(self, app: ASGIApp, max_bytes: int) -> None:
        self.app = app
        self.max_bytes = max_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One ASGI exchange."""
        answer = self.app
        if scope["type"] == "http":
            headers = scope["headers"]
            size = len(scope.get("raw_path") or b"") + len(scope["query_string"])
            size += sum(len(name) + len(value) for name, value in headers)
            if len(headers) > MOST_HEADERS or size > self.max_bytes:
                answer = headers_too_large(self.max_bytes)
        await answer(scope, receive, send)


class BodyLimitMiddleware:
    """Refuses bodies over a limit with a problem, whether their length was declared or not."""

    def __init__(
        self, app: ASGIApp, max_bytes: int, larger: Mapping[str, int] | None = None
    ) -> None:
        self.app = app
        self.max_bytes = max_bytes
        self.larger = larger or {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One ASGI exchange."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        path = scope["path"].removeprefix(scope.get("root_path", ""))
        most = max(self.max_bytes, self.larger.get(path, 0))
        length = Headers(scope=scope).get("content-length", "")
        if length.isdecimal() and int(length) > most:
            await self._drain(receive, 0, most)
            advice = "a job spec takes a few kilobytes"
            if most > self.max_bytes:
                advice = "leave out cycles, or raise GAITSWARM_API_MAX_LOG_BYTES on the server"
            detail = f"the body is larger than {most} bytes; {advice}"
            refusal = problem(scope["path"], "body-too-large", detail)
            await refusal(scope, receive, send)
            return
        received = 0

        async def receive_limited() -> Message:
            nonlocal received
            message = await receive()
            received += len(message.get("body", b""))
            if received > most:
                await self._drain(receive, received, most)
                raise HTTPException(413)
            return message

        await self.app(scope, receive_limited, send)

    async def _drain(self, receive: Receive, received: int, most: int) -> None:
        more = True
        while more and received < _DRAINED * most:
            message = await receive()
            received += len(message.get("body", b""))
            more = message.get("more_body", False)


def security_policy(*, script_src: str = "'self'", style_src: str = "'self'") -> str:
    """A content security policy: this server's own files and data, no frame around them."""
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
    """Sets the headers on every answer; one that an answer has already is kept."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One ASGI exchange."""

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self.app(scope, receive, send_guarded)
