"""The session of a browser: a token as a cookie, which its links and event streams carry."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Request, Response, status
from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.api.access import COOKIE, secret_of
from gaitswarm.api.dependencies import ServerSettings, Service
from gaitswarm.api.documentation import problems
from gaitswarm.api.manual import HasManual
from gaitswarm.services.optimizer.access import Scope, Token
from gaitswarm.services.optimizer.errors import Unauthorized
from gaitswarm.views import PREFIX, View

router = APIRouter(prefix=PREFIX, tags=["session"])

_SECONDS = 30 * 24 * 3600


class SessionRequest(BaseModel):
    """With which token a browser asks from now on."""

    model_config = ConfigDict(extra="forbid")

    token: Annotated[str, Field(min_length=1, max_length=200)] = Field(
        description="The secret of a token, as `gaitswarm token create` showed it.",
        examples=["gaitswarm_3q2-7wAAAA"],
    )


class SessionView(View):
    """Who is asking, and what the server has for readers."""

    required: bool = Field(description="Whether this server asks for a token.")
    name: str | None = Field(
        description="Name of the token that this request came with; null without a valid one.",
        examples=["ci"],
    )
    scope: Scope | None = Field(description="What that token allows; null without one.")
    manual: bool = Field(description="Whether this server has the manual at /manual.")


@router.get(
    "/session",
    operation_id="get_session",
    summary="See who is asking",
    responses=problems(429, asks=False),
)
def get_session(
    request: Request, service: Service, settings: ServerSettings, manual: HasManual
) -> SessionView:
    """Answers with or without a token, so that a page can tell whether it has to ask for one."""
    secret = secret_of(request.headers)
    token = None if secret is None else service.store.tokens.find(secret)
    return _view(token, required=settings.tokens_required, manual=manual)


@router.post(
    "/session",
    operation_id="begin_session",
    summary="Ask with a token from now on",
    response_description="The answer sets a cookie that scripts cannot read.",
    responses=problems(400, 401, 413, 422, 429, asks=False),
)
def begin_session(
    request: Request,
    asked: SessionRequest,
    service: Service,
    settings: ServerSettings,
    manual: HasManual,
    response: Response,
) -> SessionView:
    """For browsers, which cannot send a header with a link; programs send `Authorization`."""
    token = service.store.tokens.find(asked.token)
    if token is None:
        raise Unauthorized(
            "the token is unknown or was revoked; `gaitswarm token create NAME` makes a new one"
        )
    response.set_cookie(
        COOKIE,
        asked.token,
        max_age=_SECONDS,
        path="/",
        httponly=True,
        samesite="strict",
        # By HTTPS, which a proxy may bring: then the cookie is not to go without it either.
        secure=request.url.scheme == "https",
    )
    return _view(token, required=settings.tokens_required, manual=manual)


@router.delete(
    "/session",
    operation_id="end_session",
    summary="Forget the token",
    status_code=status.HTTP_204_NO_CONTENT,
    responses=problems(429, asks=False),
)
def end_session(response: Response) -> None:
    """The browser forgets the cookie; the token stays valid."""
    response.delete_cookie(COOKIE, path="/", httponly=True, samesite="strict")


def _view(token: Token | None, *, required: bool, manual: bool) -> SessionView:
    return SessionView(
        required=required,
        name=None if token is None else token.name,
        scope=None if token is None else token.scope,
        manual=manual,
    )
