"""Whose requests are answered: those to a name of this server, and changes from its own page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from gaitswarm.api.problems import problem
from gaitswarm.services.monitoring.hosts import HostNames

_READING: Final = frozenset({"GET", "HEAD", "OPTIONS"})

_OWN_PAGES: Final = frozenset({"same-origin", "none"})
"""Values of Sec-Fetch-Site of this server's page, and of what its user types."""


class HostMiddleware:
    """Refuses requests that call the server by a name that is not its own (DNS rebinding)."""

    def __init__(self, app: ASGIApp, names: HostNames) -> None:
        self.app = app
        self.names = names

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One ASGI exchange."""
        host = Headers(scope=scope).get("host") if scope["type"] == "http" else None
        refusal = self.names.refusal(host)
        if refusal is not None:
            response = problem(scope["path"], "unknown-host", refusal)
            await response(scope, receive, send)
            return
        await self.app(scope, receive, send)


class SameOriginMiddleware:
    """Refuses what a page of another origin would change.

    A page that its user merely looks at must not submit or cancel jobs, be it of another site or of
    another port of this machine. By the headers Origin and Sec-Fetch-Site, which browsers send and
    scripts cannot forge; other programs send neither.
    """

    def __init__(self, app: ASGIApp, allowed: Sequence[str]) -> None:
        """Take on the origins that are as good as the server's own."""
        self.app = app
        self.allowed = frozenset(name.lower() for name in allowed)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One ASGI exchange."""
        if scope["type"] == "http" and scope["method"] not in _READING:
            headers = Headers(scope=scope)
            if not self._is_own(headers):
                detail = "a page of another origin may not do this; use the page of this server"
                response = problem(scope["path"], "cross-origin", detail)
                await response(scope, receive, send)
                return
        await self.app(scope, receive, send)

    def _is_own(self, headers: Headers) -> bool:
        origin = headers.get("origin")
        if origin is None:
            return headers.get("sec-fetch-site", "none") in _OWN_PAGES
        # A proxy with TLS may stand before the server: its scheme is not the server's.
        asking = urlsplit(origin.lower()).netloc
        return bool(asking) and (
            asking == headers.get("host", "").lower() or asking in self.allowed
        )
