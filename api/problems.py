"""Errors as problem+json (RFC 9457): the mapping of exceptions to responses."""

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

from gaitswarm.services.optimizer import errors as domain
from gaitswarm.sim.errors import SimulationError, SimulationInputError
from gaitswarm.sim.robot.bounds import shortened
from gaitswarm.views.base import FieldErrorView, ProblemView, field_errors

_log = logging.getLogger("gaitswarm.api")

MEDIA_TYPE: Final = "application/problem+json"

_RETRY: Final = {"Retry-After": "5"}

_METHODS: Final = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE")

_MOST_ERRORS: Final = 20
"""A body can be invalid in ten thousand places."""

_LONGEST_FIELD: Final = 300
_LONGEST_MESSAGE: Final = 1000
_LONGEST_DETAIL: Final = 5000
"""Lengths in characters: messages may quote a whole body."""

PROBLEMS: Final[dict[str, tuple[int, str]]] = {
    "malformed-json": (400, "Malformed JSON"),
    "invalid-request": (422, "Invalid request"),
    "unauthorized": (401, "Authentication required"),
    "forbidden": (403, "Permission denied"),
    "cross-origin": (403, "Cross-origin request"),
    "not-found": (404, "Not found"),
    "method-not-allowed": (405, "Method not allowed"),
    "conflict": (409, "Conflict with the current state"),
    "idempotency-conflict": (409, "Idempotency key used for another request"),
    "quota-exceeded": (409, "Quota exceeded"),
    "unreadable": (409, "Job not readable by this version"),
    "body-too-large": (413, "Body too large"),
    "unknown-host": (421, "Unknown host"),
    "too-many-requests": (429, "Too many requests"),
    "unavailable": (503, "Service unavailable"),
    "draining": (503, "Server shutting down"),
    "internal-error": (500, "Internal server error"),
}
"""Status and title of every problem type, by the last part of its URN."""

_KINDS: Final[tuple[tuple[type[Exception], str], ...]] = (
    (domain.InvalidRequest, "invalid-request"),
    (domain.NotFound, "not-found"),
    (domain.Unauthorized, "unauthorized"),
    (domain.Forbidden, "forbidden"),
    (domain.IdempotencyConflict, "idempotency-conflict"),
    (domain.QuotaExceeded, "quota-exceeded"),
    (domain.Unreadable, "unreadable"),
    (domain.Conflict, "conflict"),
    (domain.LeaseLost, "conflict"),
    (domain.StoreUnavailable, "unavailable"),
    (domain.EvaluatorUnavailable, "unavailable"),
    (SimulationInputError, "invalid-request"),
    (SimulationError, "unavailable"),
)
"""Types of domain errors, subclasses first."""

DOMAIN_ERRORS: Final = (domain.GaitswarmError, SimulationError)
"""Errors that `domain_problem` handles."""

_HTTP: Final = {
    400: (
        "malformed-json",
        "the body is no valid JSON or nested too deeply; send one JSON object",
    ),
    404: ("not-found", "no resource has this path; see /docs"),
    405: ("method-not-allowed", "use a method of the Allow header; see /docs"),
    413: ("body-too-large", None),
}
"""Types and details of errors that the framework raises."""


def problem(
    request_path: str,
    kind: str,
    detail: str,
    *,
    status: int | None = None,
    errors: Sequence[FieldErrorView] = (),
    headers: Mapping[str, str] | None = None,
) -> Response:
    code, title = PROBLEMS.get(kind) or (status or 500, HTTPStatus(status or 500).phrase)
    view = ProblemView(
        type=f"urn:gaitswarm:problem:{kind}",
        title=title,
        status=code,
        detail=shortened(detail, _LONGEST_DETAIL),
        instance=request_path,
        errors=list(errors),
    )
    body = view.model_dump_json()
    return Response(body, code, dict(headers or {}), media_type=MEDIA_TYPE)


def unauthorized(request_path: str, detail: str) -> Response:
    """Return a 401 with its challenge."""
    headers = {"WWW-Authenticate": "Bearer"}
    return problem(request_path, "unauthorized", detail, headers=headers)


def unavailable(
    request_path: str,
    detail: str,
    kind: str = "unavailable",
    *,
    errors: Sequence[FieldErrorView] = (),
) -> Response:
    """Return a 503 with the time after which to retry, and log it."""
    _log.error("%r: %s", request_path, detail)
    return problem(request_path, kind, detail, errors=errors, headers=_RETRY)


def too_many_requests(request_path: str, seconds: float, detail: str | None = None) -> Response:
    """Return a 429 with the time after which to retry."""
    wait = max(1, math.ceil(seconds))
    text = detail or f"too many invalid tokens from this address; retry in {wait} s"
    headers = {"Retry-After": str(wait)}
    return problem(request_path, "too-many-requests", text, headers=headers)


def internal_error(request_path: str, request_id: str) -> Response:
    """Return a 500 without internals, but with the id to report."""
    return problem(
        request_path,
        "internal-error",
        f"try again; if the error persists, report it with the request id {request_id}, under which"
        " the server's log has the cause",
    )


def add_problem_handlers(app: FastAPI) -> None:
    """Answer every error of the table above with a problem."""
    app.add_exception_handler(RequestValidationError, _on_invalid)
    app.add_exception_handler(HTTPException, _on_http_error)
    for raised in DOMAIN_ERRORS:
        app.add_exception_handler(raised, domain_problem)


async def domain_problem(request: Request, error: Exception) -> Response:
    if isinstance(error, domain.TooManyRequests):
        return too_many_requests(request.url.path, error.retry_after, str(error))
    name = next((kind for raised, kind in _KINDS if isinstance(error, raised)), None)
    if name is None:
        raise error
    status, _ = PROBLEMS[name]
    # Without the text of a database driver.
    detail = error.for_clients if isinstance(error, domain.StoreUnavailable) else str(error)
    errors = []
    if isinstance(error, domain.InvalidRequest | domain.QuotaExceeded):
        message = detail.removeprefix(f"{error.field}: ")
        errors = [_short(FieldErrorView(field=error.field, message=message))]
    elif isinstance(error, SimulationInputError):
        errors = [_short(FieldErrorView.from_message("", detail))]
    if status == HTTPStatus.SERVICE_UNAVAILABLE:
        _log.error("%s %r: %s", request.method, request.url.path, error)
        return problem(request.url.path, name, detail, headers=_RETRY)
    if status == HTTPStatus.UNAUTHORIZED:
        return unauthorized(request.url.path, detail)
    return problem(request.url.path, name, detail, errors=errors)


async def _on_http_error(request: Request, raised: Exception) -> Response:
    error = cast(HTTPException, raised)
    kind, advice = _HTTP.get(error.status_code, (f"http-{error.status_code}", None))
    headers = error.headers
    if error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        # Starlette names the methods of the first route of a path alone.
        headers = {"Allow": ", ".join(_methods(request))}
    detail = advice or str(error.detail)
    return problem(request.url.path, kind, detail, status=error.status_code, headers=headers)


def _methods(request: Request) -> list[str]:
    """Return the methods that any route accepts at the request's path."""
    routes = request.app.routes
    scopes = {method: dict(request.scope) | {"method": method} for method in _METHODS}
    return [
        method
        for method, scope in scopes.items()
        if any(route.matches(scope)[0] is Match.FULL for route in routes)
    ]


async def _on_invalid(request: Request, raised: Exception) -> Response:
    error = cast(RequestValidationError, raised)
    entries = error.errors()
    if any(entry["type"] == "json_invalid" for entry in entries):
        entry = entries[0]
        reason = entry.get("ctx", {}).get("error", "it cannot be parsed")
        place = f" at character {entry['loc'][-1]}" if entry["loc"][-1] else ""
        message = f"{reason}{place}; send one JSON object"
        errors = [FieldErrorView(field="body", message=message)]
        return problem(request.url.path, "malformed-json", f"body: {message}", errors=errors)
    errors = _field_errors(entries, error.body)
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


def _field_errors(entries: Sequence[Mapping[str, Any]], body: Any) -> list[FieldErrorView]:
    """Return errors by fields of the body and names of parameters."""
    in_body, in_parameters = (
        [{**e, "loc": e["loc"][1:]} for e in entries if (e["loc"][0] == "body") is of_body]
        for of_body in (True, False)
    )
    if in_body and not isinstance(body, dict):
        message = "send a JSON object as application/json; /docs has examples"
        return [FieldErrorView(field="body", message=message)]
    return field_errors(in_parameters) + field_errors(in_body)
