"""Who is asking: the token of every request, and what it allows."""

from __future__ import annotations

import time
from collections.abc import Callable
from http.cookies import CookieError, SimpleCookie
from typing import Annotated, Final

from anyio.to_thread import run_sync
from fastapi import Depends, Request
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from api.dependencies import ExistingJob
from api.problems import problem, unauthorized
from gaitswarm.views import PREFIX
from services.optimizer.access import Scope as TokenScope
from services.optimizer.access import Token, Tokens
from services.optimizer.errors import Forbidden, StoreUnavailable
from services.optimizer.jobs.audit import LOCAL

COOKIE: Final = "gaitswarm-token"
"""Of browsers, which cannot send a header with a link or an event stream."""

_OPEN: Final = frozenset(f"{PREFIX}/{name}" for name in ("healthz", "readyz", "session"))
"""For load balancers, and for whoever has yet to say who they are."""

REMEMBERED_SECONDS: Final = 5.0
_MOST_REMEMBERED: Final = 1024


class AccessMiddleware:
    """Finds the token of every request under /v1, and refuses those without one.

    `request.state.token` is what it found: None where none is required and none was given. A token
    that is not valid is refused, whether one is required or not. Tokens are remembered for a few
    seconds, so that one that was revoked is refused after these.
    """

    def __init__(self, app: ASGIApp, tokens: Callable[[], Tokens], *, required: bool) -> None:
        """Take on the memory of tokens.

        Args:
            app: answers what is not refused.
            tokens: gives the memory; called only for a request with a token.
            required: whether requests without a token are refused.
        """
        self.app = app
        self.required = required
        self._tokens = tokens
        self._remembered: dict[str, tuple[float, Token]] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One ASGI exchange."""
        path = scope.get("path", "").removeprefix(scope.get("root_path", ""))
        if scope["type"] != "http" or not path.startswith(f"{PREFIX}/") or path in _OPEN:
            await self.app(scope, receive, send)
            return
        secret = secret_of(Headers(scope=scope))
        token = None
        if secret is not None:
            try:
                token = await self._find(secret)
            except StoreUnavailable as error:
                response = problem(scope["path"], 503, "unavailable", str(error))
                await response(scope, receive, send)
                return
        if token is None and (secret is not None or self.required):
            detail = (
                "the token is unknown or was revoked; `gaitswarm token create NAME` makes a new one"
                if secret is not None
                else "this server asks for a token: send `Authorization: Bearer TOKEN`, or set"
                " GAITSWARM_TOKEN; its owner makes one with `gaitswarm token create NAME`"
            )
            response = unauthorized(scope["path"], detail)
            await response(scope, receive, send)
            return
        scope.setdefault("state", {})["token"] = token
        await self.app(scope, receive, send)

    async def _find(self, secret: str) -> Token | None:
        now = time.monotonic()
        until, remembered = self._remembered.get(secret, (now, None))
        if until > now:
            return remembered
        token = await run_sync(self._tokens().find, secret)
        self._remembered.pop(secret, None)
        if token is not None:
            if len(self._remembered) >= _MOST_REMEMBERED:
                self._remembered.clear()
            self._remembered[secret] = (now + REMEMBERED_SECONDS, token)
        return token


def secret_of(headers: Headers) -> str | None:
    """The secret that a request came with.

    Args:
        headers: of the request. `Authorization` goes before the cookie.

    Returns:
        The secret, whatever it is; None where there is none.
    """
    scheme, _, credentials = headers.get("authorization", "").partition(" ")
    if scheme.lower() == "bearer":
        return credentials.strip()
    try:
        cookie = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return None
    return None if cookie is None else cookie.value or None


async def asking(request: Request) -> Token | None:
    """The token that a request came with; None where none is required and none was given.

    Args:
        request: under way.
    """
    return getattr(request.state, "token", None)


Asking = Annotated[Token | None, Depends(asking)]


async def may_submit(token: Asking) -> str | None:
    """Refuse whoever may only read.

    Args:
        token: of the request.

    Returns:
        The owner of what is submitted: the token's name, or None without one.

    Raises:
        Forbidden: the token is of another scope.
    """
    if token is None:
        return None
    if not token.scope.allows(TokenScope.SUBMIT):
        raise Forbidden(
            f"the token {token.name!r} may only read; this needs one of scope `submit` or `admin`"
        )
    return token.name


async def actor(token: Asking) -> str:
    """Whom the audit log names for what the request changes.

    Args:
        token: of the request.

    Returns:
        The token's name; `LOCAL` without one.
    """
    return LOCAL if token is None else token.name


Actor = Annotated[str, Depends(actor)]


async def may_administer(token: Asking) -> None:
    """Refuse whoever may not see what others do.

    Args:
        token: of the request.

    Raises:
        Forbidden: the token is of another scope than `admin`.
    """
    if token is not None and not token.scope.allows(TokenScope.ADMIN):
        raise Forbidden(
            f"the token {token.name!r} is of scope `{token.scope}`; this needs one of scope `admin`"
        )


Owner = Annotated[str | None, Depends(may_submit)]


def may_command(job: ExistingJob, token: Asking) -> None:
    """Refuse whoever may not command the job of the path.

    Args:
        job: of the path.
        token: of the request.

    Raises:
        Forbidden: it is somebody else's job, or the token may only read.
    """
    if token is not None and not token.may_command(job.owner):
        whose = "nobody's" if job.owner is None else f"{job.owner!r}'s"
        raise Forbidden(
            f"the token {token.name!r} of scope `{token.scope}` may not command this job, which is"
            f" {whose}; use the token that it was submitted with, or one of scope `admin`"
        )
