"""Whose requests are answered: those to a name of this server, and changes from its own page."""

from __future__ import annotations

import socket
from collections.abc import Sequence
from ipaddress import ip_address
from typing import Final
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from api.problems import problem

_READING: Final = frozenset({"GET", "HEAD", "OPTIONS"})

_OWN_PAGES: Final = frozenset({"same-origin", "none"})
"""Values of Sec-Fetch-Site of this server's page, and of what its user types."""


def names_of_server(host: str, allowed: Sequence[str]) -> frozenset[str]:
    """The names that requests may call the server by, beside addresses.

    Args:
        host: that it listens on.
        allowed: further ones, as its owner gives them: `name` or `name:port`.

    Returns:
        `allowed`, this machine's own name, `host` and localhost, in lower case.
    """
    return frozenset(name.lower() for name in ("localhost", host, socket.gethostname(), *allowed))


class HostMiddleware:
    """Refuses requests that call the server by a name that is not its own.

    A page of another site can have its name resolve to this server's address (DNS rebinding), and
    is then of the same origin to a browser; but it cannot help naming itself in the header Host. An
    address is nobody's name, and programs that send no Host are no browsers.
    """

    def __init__(self, app: ASGIApp, names: frozenset[str]) -> None:
        self.app = app
        self.names = names

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One ASGI exchange."""
        host = Headers(scope=scope).get("host") if scope["type"] == "http" else None
        if host is not None and not self._is_known(host.lower()):
            detail = (
                f"this server does not go by the name {host!r}; if it should, add the name to"
                " GAITSWARM_API_ALLOWED_HOSTS where it is started"
            )
            response = problem(scope["path"], "unknown-host", detail)
            await response(scope, receive, send)
            return
        await self.app(scope, receive, send)

    def _is_known(self, host: str) -> bool:
        name = _name(host)
        return not self.names.isdisjoint((host, name)) or _is_address(name)


class SameOriginMiddleware:
    """Refuses what a page of another origin would change.

    A page that its user merely looks at must not submit or cancel jobs, be it of another site or of
    another port of this machine. By the headers Origin and Sec-Fetch-Site, which browsers send and
    scripts cannot forge; other programs send neither.
    """

    def __init__(self, app: ASGIApp, allowed: Sequence[str]) -> None:
        """Take on the origins that are as good as the server's own.

        Args:
            app: answers what is not refused.
            allowed: `name` or `name:port` of proxies that do not hand the header Host on.
        """
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


def _name(host: str) -> str:
    """Of `name:port`, `[address]:port`, or one of both without port."""
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0]


def _is_address(name: str) -> bool:
    try:
        ip_address(name)
    except ValueError:
        return False
    return True
