"""Every error as HTTP: the one place where the error trees become problem+json (RFC 9457).

| raised                                        | status | type                  |
| --------------------------------------------- | ------ | --------------------- |
| RequestValidationError, body is not JSON      | 400    | malformed-json        |
| RequestValidationError, InvalidRequest,       | 422    | invalid-request       |
| SimulationInputError                          |        |                       |
| Unauthorized                                  | 401    | unauthorized          |
| Forbidden                                     | 403    | forbidden             |
| to change something from another's page       | 403    | cross-origin          |
| NotFound; no such route                       | 404    | not-found             |
| Conflict, LeaseLost                           | 409    | conflict              |
| IdempotencyConflict                           | 409    | idempotency-conflict  |
| QuotaExceeded                                 | 409    | quota-exceeded        |
| Unreadable                                    | 409    | unreadable            |
| a request that takes too long to come         | 408    | too-slow              |
| a body over the limit                         | 413    | body-too-large        |
| a name of the server that is not its own      | 421    | unknown-host          |
| a head over the limits                        | 431    | headers-too-large     |
| what is no request of HTTP                    | 400    | malformed-request     |
| TooManyRequests; too many by token or address | 429    | too-many-requests     |
| StoreUnavailable, EvaluatorUnavailable,       | 503    | unavailable           |
| SimulationError, too many simulations         |        |                       |
| /v1/readyz of a server that was told to end   | 503    | draining              |
| anything else                                 | 500    | internal-error        |
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from typing import Any, Final, cast

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.routing import Match

from gaitswarm.services.optimizer.errors import (
    Conflict,
    EvaluatorUnavailable,
    Forbidden,
    GaitswarmError,
    IdempotencyConflict,
    InvalidRequest,
    LeaseLost,
    NotFound,
    QuotaExceeded,
    StoreUnavailable,
    TooManyRequests,
    Unauthorized,
    Unreadable,
)
from gaitswarm.sim.errors import SimulationError, SimulationInputError
from gaitswarm.sim.robot.bounds import shortened
from gaitswarm.views import FieldErrorView, ProblemView, field_errors

_log = logging.getLogger("gaitswarm.api")

MEDIA_TYPE: Final = "application/problem+json"

_RETRY: Final = {"Retry-After": "5"}

_METHODS: Final = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE")

_MOST_ERRORS: Final = 20
"""A body can be wrong in ten thousand places; nobody reads them all."""

_LONGEST_FIELD: Final = 300
_LONGEST_MESSAGE: Final = 1000
_LONGEST_DETAIL: Final = 5000
"""Characters: what is wrong may quote a whole body."""

PROBLEMS: Final[dict[str, tuple[int, str]]] = {
    "malformed-json": (400, "The body is not JSON"),
    "invalid-request": (422, "The request is not valid"),
    "unauthorized": (401, "The server does not know who is asking"),
    "forbidden": (403, "Whoever asks may not do that"),
    "cross-origin": (403, "The request comes from another origin"),
    "not-found": (404, "There is no such thing"),
    "method-not-allowed": (405, "The method is not allowed here"),
    "conflict": (409, "The present state does not allow it"),
    "idempotency-conflict": (409, "The idempotency key was used for another request"),
    "quota-exceeded": (409, "The owner has too much under way"),
    "unreadable": (409, "This version cannot read the job"),
    "malformed-request": (400, "This is no request"),
    "too-slow": (408, "The request took too long to come"),
    "headers-too-large": (431, "The head of the request is too large"),
    "body-too-large": (413, "The body is too large"),
    "unknown-host": (421, "The server does not go by this name"),
    "too-many-requests": (429, "Whoever asks does so too often"),
    "unavailable": (503, "The service cannot do it now"),
    "draining": (503, "The server is ending"),
    "internal-error": (500, "Something went wrong on the server"),
}
"""Status and title of every type of problem, by the last part of its URN."""

_KINDS: Final[tuple[tuple[type[Exception], str], ...]] = (
    (InvalidRequest, "invalid-request"),
    (NotFound, "not-found"),
    (Unauthorized, "unauthorized"),
    (Forbidden, "forbidden"),
    (IdempotencyConflict, "idempotency-conflict"),
    (QuotaExceeded, "quota-exceeded"),
    (Unreadable, "unreadable"),
    (Conflict, "conflict"),
    (LeaseLost, "conflict"),
    (StoreUnavailable, "unavailable"),
    (EvaluatorUnavailable, "unavailable"),
    (SimulationInputError, "invalid-request"),
    (SimulationError, "unavailable"),
)
"""Domain errors, the more special first."""

DOMAIN_ERRORS: Final = (GaitswarmError, SimulationError)
"""What `domain_problem` answers."""

_HTTP: Final = {
    400: ("malformed-json", "the body cannot be read as JSON; send one JSON object, not too deep"),
    404: ("not-found", "no resource has this path; /docs lists those that exist"),
    405: ("method-not-allowed", "use a method that the Allow header names; see /docs"),
    413: ("body-too-large", "send a smaller body; a job spec takes a few kilobytes"),
}
"""What to do about the errors that the framework itself raises."""


def problem(
    request_path: str,
    kind: str,
    detail: str,
    *,
    status: int | None = None,
    errors: Sequence[FieldErrorView] = (),
    headers: Mapping[str, str] | None = None,
) -> Response:
    """Make a problem."""
    known, title = PROBLEMS.get(kind) or (status or 500, HTTPStatus(status or 500).phrase)
    view = ProblemView(
        type=f"urn:gaitswarm:problem:{kind}",
        title=title,
        status=known,
        detail=shortened(detail, _LONGEST_DETAIL),
        instance=request_path,
        errors=list(errors),
    )
    body = view.model_dump_json()
    return Response(body, known, dict(headers or {}), media_type=MEDIA_TYPE)


def unauthorized(request_path: str, detail: str) -> Response:
    """Answer whoever has to say first who they are."""
    headers = {"WWW-Authenticate": "Bearer"}
    return problem(request_path, "unauthorized", detail, headers=headers)


def unavailable(
    request_path: str,
    detail: str,
    kind: str = "unavailable",
    *,
    errors: Sequence[FieldErrorView] = (),
) -> Response:
    """Answer that something is not possible now, and when to ask again."""
    _log.error("%s: %s", request_path, detail)
    return problem(request_path, kind, detail, errors=errors, headers=_RETRY)


def too_many_requests(request_path: str, seconds: float, detail: str | None = None) -> Response:
    """Answer whoever asks too often."""
    wait = max(1, math.ceil(seconds))
    text = (
        detail or f"there are too many requests with this token or from this address; wait {wait} s"
    )
    headers = {"Retry-After": str(wait)}
    return problem(request_path, "too-many-requests", text, headers=headers)


MOST_HEADERS: Final = 100
"""Of a request; browsers and proxies send some twenty."""


def headers_too_large(most_bytes: int) -> Response:
    """Answer a request whose head is too large, of which nothing is quoted."""
    detail = (
        f"the head of the request has more than {MOST_HEADERS} headers or {most_bytes} bytes; send"
        " fewer, and what is long in the body"
    )
    return problem("/", "headers-too-large", detail)


def internal_error(request_path: str, request_id: str) -> Response:
    """Answer a bug: nothing of the inside is shown, but how to report it is."""
    return problem(
        request_path,
        "internal-error",
        f"try again; if it stays, report it with the request id {request_id}, by which the"
        " server's log names the cause",
    )


def add_problem_handlers(app: FastAPI) -> None:
    """Answer every error of the table above with a problem."""
    app.add_exception_handler(RequestValidationError, _on_invalid)
    app.add_exception_handler(HTTPException, _on_http_error)
    for raised in DOMAIN_ERRORS:
        app.add_exception_handler(raised, domain_problem)


def _client_text(error: Exception) -> str:
    """Return an error's text for clients; the text of a database's driver is for the log alone."""
    return error.for_clients if isinstance(error, StoreUnavailable) else str(error)


async def domain_problem(request: Request, error: Exception) -> Response:
    """Answer what the domain refuses."""
    if isinstance(error, TooManyRequests):
        return too_many_requests(request.url.path, error.retry_after, str(error))
    found = next((row for row in _KINDS if isinstance(error, row[0])), None)
    if found is None:
        raise error
    _, name = found
    status, _ = PROBLEMS[name]
    detail = _client_text(error)
    errors = []
    if isinstance(error, InvalidRequest | QuotaExceeded):
        message = detail.removeprefix(f"{error.field}: ")
        errors = [_short(FieldErrorView(field=error.field, message=message))]
    elif isinstance(error, SimulationInputError):
        errors = [_short(FieldErrorView.from_message("", detail))]
    if status == HTTPStatus.SERVICE_UNAVAILABLE:
        _log.error("%s %s: %s", request.method, request.url.path, error)
        return problem(request.url.path, name, detail, headers=_RETRY)
    if status == HTTPStatus.UNAUTHORIZED:
        return unauthorized(request.url.path, detail)
    return problem(request.url.path, name, detail, errors=errors)


async def _on_http_error(request: Request, raised: Exception) -> Response:
    error = cast(HTTPException, raised)
    default = (f"http-{error.status_code}", str(error.detail))
    kind, advice = _HTTP.get(error.status_code, default)
    headers = error.headers
    if error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        # Starlette names the methods of the first route of a path alone.
        headers = {"Allow": ", ".join(_methods(request))}
    return problem(request.url.path, kind, advice, status=error.status_code, headers=headers)


def _methods(request: Request) -> list[str]:
    """Those that some route takes at the path that was asked for."""
    routes = request.app.routes
    scopes = {method: dict(request.scope) | {"method": method} for method in _METHODS}
    return [
        method
        for method, scope in scopes.items()
        if any(route.matches(scope)[0] is Match.FULL for route in routes)
    ]


async def _on_invalid(request: Request, raised: Exception) -> Response:
    error = cast(RequestValidationError, raised)
    found = error.errors()
    if any(entry["type"] == "json_invalid" for entry in found):
        entry = found[0]
        reason = entry.get("ctx", {}).get("error", "it cannot be parsed")
        message = f"{reason} at character {entry['loc'][-1]}; send one JSON object"
        errors = [FieldErrorView(field="body", message=message)]
        return problem(request.url.path, "malformed-json", f"body: {message}", errors=errors)
    errors = _in_the_words_of_the_request(found, error.body)
    shown = [_short(entry) for entry in errors[:_MOST_ERRORS]]
    detail = "; ".join(f"{e.field}: {e.message}" if e.field else e.message for e in shown)
    if len(errors) > _MOST_ERRORS:
        detail += f"; and {len(errors) - _MOST_ERRORS} more"
    return problem(request.url.path, "invalid-request", detail, errors=shown)


def _short(error: FieldErrorView) -> FieldErrorView:
    return FieldErrorView(
        field=shortened(error.field, _LONGEST_FIELD),
        message=shortened(error.message, _LONGEST_MESSAGE),
    )


def _in_the_words_of_the_request(
    found: Sequence[Mapping[str, Any]], body: Any
) -> list[FieldErrorView]:
    """Of a body by its own fields; of parameters by their names."""
    in_body, in_parameters = (
        [{**e, "loc": e["loc"][1:]} for e in found if (e["loc"][0] == "body") is of_body]
        for of_body in (True, False)
    )
    if in_body and not isinstance(body, dict):
        message = "send a JSON object as application/json; /docs has examples"
        return [FieldErrorView(field="body", message=message)]
    return field_errors(in_parameters) + field_errors(in_body)
