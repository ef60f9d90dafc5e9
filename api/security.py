"""What a browser may do with the answers, and whose pages may ask for more than to read."""

from __future__ import annotations

from typing import Final

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.problems import problem

_READING: Final = frozenset({"GET", "HEAD", "OPTIONS"})


def policy(*, script_src: str = "'self'", style_src: str = "'self'") -> str:
    """A content security policy: this server's own files and data, no frame around them."""
    return (
        f"default-src 'none'; script-src {script_src}; style-src {style_src};"
        " img-src 'self' data: blob:; connect-src 'self'; font-src 'self'; base-uri 'none';"
        " form-action 'none'; frame-ancestors 'none'"
    )


_HEADERS: Final = {
    "Content-Security-Policy": policy(),
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


class SameSiteMiddleware:
    """Refuses what a page of another site would change: nobody is asked who they are, so a page
    that its user merely looks at must not submit or cancel jobs.

    By the header Sec-Fetch-Site, which browsers send and scripts cannot forge; other programs send
    none.
    """

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One ASGI exchange."""
        asking = Headers(scope=scope) if scope["type"] == "http" else Headers()
        if asking.get("sec-fetch-site") == "cross-site" and scope["method"] not in _READING:
            detail = "a page of another site may not do this; use the page of this server"
            response = problem(scope["path"], 403, "cross-site", detail)
            await response(scope, receive, send)
            return
        await self.app(scope, receive, send)
