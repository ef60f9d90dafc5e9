"""Authentication and authorization: tokens of requests, permissions of their scopes, sessions."""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from functools import partial
from http.cookies import CookieError, SimpleCookie
from ipaddress import IPv6Address, ip_address
from typing import TYPE_CHECKING, Annotated, Final, cast

from anyio.to_thread import run_sync
from fastapi import APIRouter, Depends, Request, Response, status
from pydantic import BaseModel, ConfigDict, Field
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from gaitswarm.api.dependencies import ExistingJob, JobId, ServerSettings, Service
from gaitswarm.api.documentation import problems
from gaitswarm.api.events import Revocation
from gaitswarm.api.page import HasManual
from gaitswarm.api.problems import problem, too_many_requests, unauthorized
from gaitswarm.services.optimizer import errors
from gaitswarm.services.optimizer.access import Scope as TokenScope
from gaitswarm.services.optimizer.access import Token
from gaitswarm.services.optimizer.jobs.job import DEFAULT_PRIORITY, Quota
from gaitswarm.services.optimizer.views import View
from gaitswarm.views.base import PREFIX

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store.tokens import Tokens

_log = logging.getLogger("gaitswarm.api")

COOKIE: Final = "gaitswarm-token"
"""Cookie of browsers, which cannot send a header with a link or an event stream."""

METRICS_PATH: Final = "/metrics"

_PROBES: Final = frozenset(f"{PREFIX}/{name}" for name in ("healthz", "readyz"))
"""Probes need no token."""

_SESSION: Final = f"{PREFIX}/session"
"""Answers without a token; the route itself checks tokens."""

CACHE_SECONDS: Final = 5.0
"""Time for which a looked-up token is used without another lookup [s]."""

_CACHE_SIZE: Final = 1024

GUESS_BURST: Final = 100
"""Invalid tokens that one address may send at once."""

GUESSES_PER_SECOND: Final = 10.0
"""Rate at which it may send further ones [1/s]."""

_ADDRESSES: Final = 4096
"""Addresses whose invalid tokens are counted."""

_IPV6_PREFIX: Final = 64
"""Bits of an IPv6 address that identify a subscriber."""

UNKNOWN: Final = (
    "the token is unknown or was revoked; `gaitswarm token create NAME` creates a new one"
)
_METRICS_MISSING: Final = (
    "metrics require a token: let Prometheus send one of scope `read` as `Authorization: Bearer"
    " TOKEN`; create one with `gaitswarm token create NAME --scope read`"
)
_MISSING: Final = (
    "this server requires a token: send `Authorization: Bearer TOKEN`, or set GAITSWARM_TOKEN; an"
    " administrator creates one with `gaitswarm token create NAME`"
)


class TokenCache:
    """Recently looked-up tokens. Bound to one event loop."""

    def __init__(self, tokens: Callable[[], Tokens]) -> None:
        self._tokens = tokens
        # Expiry time and token by secret; expired entries serve `last`.
        self._cached: dict[str, tuple[float, Token]] = {}
        self._watching = asyncio.Lock()

    def last(self, secret: str) -> Token | None:
        """Return the token of a secret as of its last lookup, at any time in the past."""
        return self._cached.get(secret, (0.0, None))[1]

    def fresh(self, secret: str) -> Token | None:
        """Return the same if it was looked up within the last `CACHE_SECONDS`."""
        return self.last(secret) if self._seconds_left(secret) > 0.0 else None

    async def find(self, secret: str) -> Token | None:
        """Return the token of a secret, at most `CACHE_SECONDS` old."""
        cached = self.fresh(secret)
        if cached is not None:
            return cached
        token = await run_sync(self._tokens().find, secret)
        self._cached.pop(secret, None)
        if token is not None:
            if len(self._cached) >= _CACHE_SIZE:
                self._cached.clear()
            self._cached[secret] = (time.monotonic() + CACHE_SECONDS, token)
        return token

    async def until_revoked(self, secret: str) -> None:
        """Return when a token was revoked, at most `CACHE_SECONDS` later."""
        while True:
            async with self._watching:
                try:
                    token = await self.find(secret)
                except errors.StoreUnavailable:
                    token = self.last(secret)
            if token is None:
                return
            left = self._seconds_left(secret)
            await asyncio.sleep(left if left > 0.0 else CACHE_SECONDS)

    def _seconds_left(self, secret: str) -> float:
        expires, _ = self._cached.get(secret, (0.0, None))
        return expires - time.monotonic()


class TokenGuesses:
    """Throttle of invalid tokens by address. Thread-safe."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        # Time at which each address has its full burst again.
        self._recovered: OrderedDict[str, float] = OrderedDict()
        self._lock = threading.Lock()

    def seconds_to_wait(self, address: str) -> float:
        """Return the time after which an address may send another unverified token [s]."""
        now = self._clock()
        with self._lock:
            debt = self._recovered.get(address, now) - now
        return max(0.0, debt - (GUESS_BURST - 1) / GUESSES_PER_SECOND)

    def count(self, address: str) -> None:
        now = self._clock()
        with self._lock:
            recovered = max(now, self._recovered.pop(address, now))
            self._recovered[address] = recovered + 1.0 / GUESSES_PER_SECOND
            if len(self._recovered) > _ADDRESSES:
                self._recovered.popitem(last=False)


class AccessMiddleware:
    """Authenticate requests under /v1 and for metrics.

    `request.state.token` is the token, None where none is required and none was sent. An invalid
    token is rejected even where none is required. A revoked token is accepted for up to
    `CACHE_SECONDS`; `request.state.until_revoked` returns after that, for long responses. While the
    database is unavailable, metrics accept tokens that were valid at their last lookup.
    """

    def __init__(
        self,
        app: ASGIApp,
        tokens: Callable[[], Tokens],
        guesses: TokenGuesses,
        *,
        required: bool,
    ) -> None:
        self.app = app
        self.required = required
        self._tokens = TokenCache(tokens)
        self._guesses = guesses

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        path = scope.get("path", "").removeprefix(scope.get("root_path", ""))
        is_guarded = path.startswith(f"{PREFIX}/") or path == METRICS_PATH
        if scope["type"] != "http" or not is_guarded or path in _PROBES:
            await self.app(scope, receive, send)
            return
        try:
            response = await self._refusal(scope, path)
        except errors.StoreUnavailable as error:
            _log.error("%r: %s", scope["path"], error)
            response = problem(scope["path"], "unavailable", error.for_clients)
        await (response or self.app)(scope, receive, send)

    async def _refusal(self, scope: Scope, path: str) -> Response | None:
        """Return the response to a rejected request; else store the token in its state."""
        secret = secret_of(Headers(scope=scope))
        token = None if secret is None else self._tokens.fresh(secret)
        if path != _SESSION and token is None:
            if secret is not None:
                last, address = self._tokens.last(secret), address_of(scope)
                # A token that was valid is exempt: others at its address may be guessing.
                wait = self._guesses.seconds_to_wait(address) if last is None else 0.0
                if wait > 0.0:
                    return too_many_requests(scope["path"], wait)
                token = await self._find(secret, last if path == METRICS_PATH else None)
                if token is None:
                    self._guesses.count(address)
                    return unauthorized(scope["path"], UNKNOWN)
            elif self.required:
                missing = _METRICS_MISSING if path == METRICS_PATH else _MISSING
                return unauthorized(scope["path"], missing)
        until_revoked = _never if secret is None else partial(self._tokens.until_revoked, secret)
        scope.setdefault("state", {}).update(token=token, until_revoked=until_revoked)
        return None

    async def _find(self, secret: str, fallback: Token | None) -> Token | None:
        """fallback: used while the database is unavailable."""
        try:
            return await self._tokens.find(secret)
        except errors.StoreUnavailable:
            if fallback is None:
                raise
            return fallback


async def _never() -> None:
    await asyncio.Event().wait()


def secret_of(headers: Headers) -> str | None:
    scheme, _, credentials = headers.get("authorization", "").partition(" ")
    if scheme.lower() == "bearer":
        return credentials.strip()
    try:
        cookie = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return None
    return None if cookie is None else cookie.value or None


def address_of(scope: Scope) -> str:
    """Return the address of a client; for IPv6 its /64 network."""
    client = scope.get("client")
    host = str(client[0]) if client else ""
    try:
        address = ip_address(host)
    except ValueError:
        return host
    if not isinstance(address, IPv6Address) or address.is_loopback:
        return str(address)
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    host_bits = address.max_prefixlen - _IPV6_PREFIX
    return f"{IPv6Address(int(address) >> host_bits << host_bits)}/{_IPV6_PREFIX}"


def find_token(request: Request, tokens: Tokens, secret: str) -> Token | None:
    """Look up a token outside the middleware, throttled in the same way."""
    guesses, address = cast(TokenGuesses, request.app.state.guesses), address_of(request.scope)
    wait = guesses.seconds_to_wait(address)
    if wait > 0.0:
        raise errors.TooManyRequests("too many invalid tokens from this address", retry_after=wait)
    token = tokens.find(secret)
    if token is None:
        guesses.count(address)
    return token


async def request_token(request: Request) -> Token | None:
    """Return the token of a request; None where none is required and none was sent."""
    return getattr(request.state, "token", None)


RequestToken = Annotated[Token | None, Depends(request_token)]


async def revocation(request: Request) -> Revocation:
    """Return a coroutine function that returns when the token of a request was revoked."""
    return cast(Revocation, request.state.until_revoked)


UntilRevoked = Annotated[Revocation, Depends(revocation)]


async def may_submit(token: RequestToken) -> str | None:
    """Require scope `submit` or `admin`, and return the token's name."""
    if token is None:
        return None
    if not token.scope.allows(TokenScope.SUBMIT):
        raise errors.Forbidden(
            f"the token {token.name!r} has scope `read`; use one of scope `submit` or `admin`"
        )
    return token.name


Owner = Annotated[str | None, Depends(may_submit)]


async def may_administer(token: RequestToken) -> None:
    if token is not None and not token.scope.allows(TokenScope.ADMIN):
        raise errors.Forbidden(
            f"the token {token.name!r} has scope `{token.scope}`; use one of scope `admin`"
        )


def may_restore(job_id: JobId, service: Service, token: RequestToken) -> None:
    """Require the permission to command the deleted job of the path."""
    may_command(service.store.deleted_job(job_id), token)


def may_command(job: ExistingJob, token: RequestToken) -> None:
    if token is not None and not token.may_command(job.owner):
        owner = "no owner" if job.owner is None else f"owner {job.owner!r}"
        raise errors.Forbidden(
            f"the token {token.name!r} of scope `{token.scope}` may not command this job, which has"
            f" {owner}; use the token that submitted it, or one of scope `admin`"
        )


async def quota_of(token: RequestToken, settings: ServerSettings) -> Quota | None:
    """Return the quota of the token's unfinished jobs; None for scope `admin`."""
    if token is not None and token.scope is TokenScope.ADMIN:
        return None
    return Quota(settings.api_max_unfinished_jobs, settings.api_max_unfinished_seconds)


OwnersQuota = Annotated[Quota | None, Depends(quota_of)]


def check_may_prioritize(token: Token | None, priority: int) -> None:
    """Require scope `admin` for priorities above the default."""
    if (
        priority > DEFAULT_PRIORITY
        and token is not None
        and not token.scope.allows(TokenScope.ADMIN)
    ):
        raise errors.Forbidden(
            f"the token {token.name!r} of scope `{token.scope}` may not set a priority above"
            f" {DEFAULT_PRIORITY}; use one of scope `admin`"
        )


router = APIRouter(prefix=PREFIX, tags=["operations"])

_FOR_PAGE: Final = {"x-used-by": "page"}

_COOKIE_SECONDS: Final = 30 * 24 * 3600


class SessionRequest(BaseModel):
    """Token of a new session."""

    model_config = ConfigDict(extra="forbid")

    token: Annotated[str, Field(min_length=1, max_length=200)] = Field(
        description="Secret of a token, as printed by `gaitswarm token create`.",
        examples=["gaitswarm_3q2-7wAAAA"],
    )


class SessionView(View):
    """Token of the session, and features of the server."""

    required: bool = Field(description="Whether this server requires a token.")
    name: str | None = Field(examples=["ci"])
    """Name of the request's token; null without a valid one."""
    scope: TokenScope | None = Field(description="Scope of that token; null without one.")
    manual: bool = Field(description="Whether this server has a manual at /manual.")


@router.get(
    "/session",
    operation_id="get_session",
    openapi_extra=_FOR_PAGE,
    summary="Get the session",
    responses=problems(429, guarded=False),
)
def get_session(
    request: Request, service: Service, settings: ServerSettings, manual: HasManual
) -> SessionView:
    """Return the session, with or without a token, so that a page knows whether to ask for one.

    For the web page; it may change with the page.
    """
    secret = secret_of(request.headers)
    token = None if secret is None else find_token(request, service.store.tokens, secret)
    return _view(token, required=settings.tokens_required, manual=manual)


@router.post(
    "/session",
    operation_id="begin_session",
    openapi_extra=_FOR_PAGE,
    summary="Begin a session",
    response_description="The response sets a cookie that scripts cannot read.",
    responses=problems(400, 401, 413, 422, 429, guarded=False),
)
def begin_session(
    request: Request,
    body: SessionRequest,
    service: Service,
    settings: ServerSettings,
    manual: HasManual,
    response: Response,
) -> SessionView:
    """Store a token in a cookie, for browsers; programs send `Authorization`.

    For the web page; it may change with the page.
    """
    token = find_token(request, service.store.tokens, body.token)
    if token is None:
        raise errors.Unauthorized(UNKNOWN)
    response.set_cookie(
        COOKIE,
        body.token,
        max_age=_COOKIE_SECONDS,
        path="/",
        httponly=True,
        samesite="strict",
        # Also behind a TLS proxy, which sets X-Forwarded-Proto.
        secure=request.url.scheme == "https",
    )
    return _view(token, required=settings.tokens_required, manual=manual)


@router.delete(
    "/session",
    operation_id="end_session",
    openapi_extra=_FOR_PAGE,
    summary="End the session",
    status_code=status.HTTP_204_NO_CONTENT,
    responses=problems(429, guarded=False),
)
def end_session(response: Response) -> None:
    """Delete the cookie; the token stays valid.

    For the web page; it may change with the page.
    """
    response.delete_cookie(COOKIE, path="/", httponly=True, samesite="strict")


def _view(token: Token | None, *, required: bool, manual: bool) -> SessionView:
    return SessionView(
        required=required,
        name=None if token is None else token.name,
        scope=None if token is None else token.scope,
        manual=manual,
    )
