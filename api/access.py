"""Who is asking: the token of every request, and what it allows."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from functools import partial
from http.cookies import CookieError, SimpleCookie
from typing import Annotated, Final, cast

from fastapi import Depends, Header, Request, Response
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from gaitswarm.api.dependencies import ExistingJob, ServerSettings
from gaitswarm.api.known_tokens import KnownTokens
from gaitswarm.api.monitoring import METRICS_PATH
from gaitswarm.api.problems import problem, too_many_requests, unauthorized
from gaitswarm.api.rates import RequestRate, address_of, is_local
from gaitswarm.services.monitoring.exposition import REFUSAL
from gaitswarm.services.optimizer.access import Scope as TokenScope
from gaitswarm.services.optimizer.access import Token, Tokens
from gaitswarm.services.optimizer.errors import Forbidden, StoreUnavailable
from gaitswarm.services.optimizer.jobs.audit import LOCAL
from gaitswarm.services.optimizer.jobs.priority import DEFAULT, HIGHEST, LOWEST
from gaitswarm.services.optimizer.jobs.quota import Quota
from gaitswarm.views import PREFIX

_log = logging.getLogger("gaitswarm.api")

COOKIE: Final = "gaitswarm-token"
"""Of browsers, which cannot send a header with a link or an event stream."""

_PROBES: Final = frozenset(f"{PREFIX}/{name}" for name in ("healthz", "readyz"))
"""For load balancers, which must not wait behind a flood of others' requests."""

_SESSION: Final = f"{PREFIX}/session"
"""For whoever has yet to say who they are."""

Revocation = Callable[[], Awaitable[None]]

_UNKNOWN: Final = (
    "the token is unknown or was revoked; `gaitswarm token create NAME` makes a new one"
)
_NONE: Final = (
    "this server asks for a token: send `Authorization: Bearer TOKEN`, or set GAITSWARM_TOKEN; its"
    " owner makes one with `gaitswarm token create NAME`"
)


class AccessMiddleware:
    """Finds the token of every request under /v1, and refuses those without one, and too many.

    And of those for metrics, for which every token will do. While the database is away, one that
    was valid when it was last looked up still is there: metrics are needed most then.

    `request.state.token` is what it found: None where none is required and none was given. A token
    that is not valid is refused, whether one is required or not. Tokens are remembered for a few
    seconds, so that one that was revoked is refused after these. `request.state.until_revoked`
    returns then, for answers that last longer.

    Requests are counted by their token; those whose token is not remembered by their address,
    before anything is looked up. Where no token is required, those of this machine are not counted.
    """

    def __init__(
        self, app: ASGIApp, tokens: Callable[[], Tokens], rate: RequestRate, *, required: bool
    ) -> None:
        """Take on the memory of tokens."""
        self.app = app
        self.required = required
        self._tokens = KnownTokens(tokens)
        self._rate = rate

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One ASGI exchange."""
        path = scope.get("path", "").removeprefix(scope.get("root_path", ""))
        is_asked = path.startswith(f"{PREFIX}/") or path == METRICS_PATH
        if scope["type"] != "http" or not is_asked or path in _PROBES:
            await self.app(scope, receive, send)
            return
        try:
            response = await self._refusal(scope, path)
        except StoreUnavailable as error:
            _log.error("%s: %s", scope["path"], error)
            response = problem(scope["path"], "unavailable", error.for_clients)
        await (response or self.app)(scope, receive, send)

    async def _refusal(self, scope: Scope, path: str) -> Response | None:
        """The answer to a request that is not let through; the others know who asks then."""
        secret, address = secret_of(Headers(scope=scope)), address_of(scope)
        known = None if secret is None else self._tokens.last(secret)
        # Others at the same address may be guessing: whoever had a token is not counted with them.
        asker = address if known is None else f"token {known.name}"
        if self.required or secret is not None or not is_local(address):
            seconds = self._rate.seconds_to_wait(asker)
            if seconds > 0.0:
                return too_many_requests(scope["path"], seconds)
        token = None if secret is None else self._tokens.lately(secret)
        if path != _SESSION:
            if token is None and secret is not None:
                token = await self._find(secret, known if path == METRICS_PATH else None)
            if token is None and (secret is not None or self.required):
                missing = REFUSAL if path == METRICS_PATH else _NONE
                return unauthorized(scope["path"], missing if secret is None else _UNKNOWN)
        asker = address if token is None else f"token {token.name}"
        until_revoked = _never if secret is None else partial(self._tokens.until_revoked, secret)
        scope.setdefault("state", {}).update(token=token, asker=asker, until_revoked=until_revoked)
        return None

    async def _find(self, secret: str, otherwise: Token | None) -> Token | None:
        """otherwise: what is taken for the token while the database is away, if anything."""
        try:
            return await self._tokens.find(secret)
        except StoreUnavailable:
            if otherwise is None:
                raise
            return otherwise


async def _never() -> None:
    """Where there is no token, none is revoked."""
    await asyncio.Event().wait()


def secret_of(headers: Headers) -> str | None:
    """The secret that a request came with."""
    scheme, _, credentials = headers.get("authorization", "").partition(" ")
    if scheme.lower() == "bearer":
        return credentials.strip()
    try:
        cookie = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return None
    return None if cookie is None else cookie.value or None


async def asking(request: Request) -> Token | None:
    """The token that a request came with; None where none is required and none was given."""
    return getattr(request.state, "token", None)


Asking = Annotated[Token | None, Depends(asking)]


async def revocation(request: Request) -> Revocation:
    """What returns when the token of a request was revoked."""
    return cast(Revocation, request.state.until_revoked)


UntilRevoked = Annotated[Revocation, Depends(revocation)]


async def may_submit(token: Asking) -> str | None:
    """Refuse whoever may only read."""
    if token is None:
        return None
    if not token.scope.allows(TokenScope.SUBMIT):
        raise Forbidden(
            f"the token {token.name!r} may only read; this needs one of scope `submit` or `admin`"
        )
    return token.name


async def actor(token: Asking) -> str:
    """Whom the audit log names for what the request changes."""
    return LOCAL if token is None else token.name


Actor = Annotated[str, Depends(actor)]


async def may_administer(token: Asking) -> None:
    """Refuse whoever may not see what others do."""
    if token is not None and not token.scope.allows(TokenScope.ADMIN):
        raise Forbidden(
            f"the token {token.name!r} is of scope `{token.scope}`; this needs one of scope `admin`"
        )


Owner = Annotated[str | None, Depends(may_submit)]


async def quota_of(token: Asking, settings: ServerSettings) -> Quota | None:
    """What the unfinished jobs of an owner may come to."""
    if token is not None and token.scope is TokenScope.ADMIN:
        return None
    return Quota(settings.api_max_unfinished_jobs, settings.api_max_unfinished_seconds)


def check_may_prioritize(token: Token | None, priority: int) -> None:
    """Refuse whoever may not put a job before those of others."""
    if priority > DEFAULT and token is not None and not token.scope.allows(TokenScope.ADMIN):
        raise Forbidden(
            f"the token {token.name!r} of scope `{token.scope}` may not give a priority above"
            f" {DEFAULT}, which puts a job before those of others; use one of scope `admin`"
        )


async def job_priority(
    token: Asking,
    priority: Annotated[
        int,
        Header(
            alias="Job-Priority",
            ge=LOWEST,
            le=HIGHEST,
            description="How urgent it is: of waiting jobs the one of highest priority is run"
            " first, and of running jobs one that is a step higher has twice the share of the"
            " workers. Above 0 it needs a token of scope `admin`, where tokens are required.",
            examples=[0],
        ),
    ] = DEFAULT,
) -> int:
    """The priority that a new job is to have."""
    check_may_prioritize(token, priority)
    return priority


NewPriority = Annotated[int, Depends(job_priority)]

OwnersQuota = Annotated[Quota | None, Depends(quota_of)]


def may_command(job: ExistingJob, token: Asking) -> None:
    """Refuse whoever may not command the job of the path."""
    if token is not None and not token.may_command(job.owner):
        whose = "nobody's" if job.owner is None else f"{job.owner!r}'s"
        raise Forbidden(
            f"the token {token.name!r} of scope `{token.scope}` may not command this job, which is"
            f" {whose}; use the token that it was submitted with, or one of scope `admin`"
        )
