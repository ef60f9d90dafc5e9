"""Sessions of browsers: a token in a cookie, for links and event streams."""

from __future__ import annotations

from typing import Annotated, Final

from fastapi import APIRouter, Request, Response, status
from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.api.access import COOKIE, UNKNOWN, find_token, secret_of
from gaitswarm.api.dependencies import ServerSettings, Service
from gaitswarm.api.documentation import problems
from gaitswarm.api.page import HasManual
from gaitswarm.services.optimizer.access import Scope, Token
from gaitswarm.services.optimizer.errors import Unauthorized
from gaitswarm.services.optimizer.views import View
from gaitswarm.views.base import PREFIX

router = APIRouter(prefix=PREFIX, tags=["operations"])

_FOR_PAGE: Final = {"x-used-by": "page"}

_MAX_AGE_SECONDS = 30 * 24 * 3600


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
    name: str | None = Field(
        description="Name of the request's token; null without a valid one.",
        examples=["ci"],
    )
    scope: Scope | None = Field(description="Scope of that token; null without one.")
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
        raise Unauthorized(UNKNOWN)
    response.set_cookie(
        COOKIE,
        body.token,
        max_age=_MAX_AGE_SECONDS,
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
