"""Repetition of requests, and errors of servers. No I/O."""

from __future__ import annotations

import time
from collections.abc import Mapping
from email.utils import parsedate_to_datetime
from http import HTTPStatus
from typing import Final

import httpx2
from pydantic import ValidationError

from gaitswarm.services.optimizer.errors import (
    Conflict,
    Forbidden,
    GaitswarmError,
    IdempotencyConflict,
    InvalidRequest,
    NotFound,
    QuotaExceeded,
    StoreUnavailable,
    TooManyRequests,
    Unauthorized,
    Unreadable,
)
from gaitswarm.services.optimizer.masking import masked_url
from gaitswarm.services.optimizer.run.outage import Backoff
from gaitswarm.views.base import ProblemView

_TRANSIENT: Final = (httpx2.NetworkError, httpx2.ConnectTimeout, httpx2.RemoteProtocolError)
"""The connection was not established, or broke."""

_ERRORS: Final[Mapping[int, type[GaitswarmError]]] = {
    HTTPStatus.UNAUTHORIZED: Unauthorized,
    HTTPStatus.FORBIDDEN: Forbidden,
    HTTPStatus.NOT_FOUND: NotFound,
    HTTPStatus.CONFLICT: Conflict,
}

_CONFLICTS: Final[Mapping[str, type[Conflict]]] = {
    "idempotency-conflict": IdempotencyConflict,
    "unreadable": Unreadable,
}
"""By the end of the problem's type, where the status is ambiguous."""


class Attempts:
    """The attempts at one request.

    A request is repeated after a lost connection or a 503 if it is `repeatable`: if it only reads
    or has an idempotency key. After a 429, which says that nothing was done, every request is.
    """

    def __init__(self, url: str, backoff: Backoff, *, repeatable: bool) -> None:
        self._url = url
        self._backoff = backoff
        self._repeatable = repeatable
        self._failures = 0

    def after_failure(self, error: httpx2.HTTPError) -> float:
        """Return the time until the next attempt [s]; raise StoreUnavailable if there is none."""
        again = self._repeatable and isinstance(error, _TRANSIENT)
        seconds = self._wait(0.0, again=again)
        if seconds is None:
            raise unreachable(self._url, error) from error
        return seconds

    def after_refusal(self, response: httpx2.Response) -> float:
        """Return the time until the next attempt [s]; raise the server's error if there is none."""
        busy = response.status_code == HTTPStatus.TOO_MANY_REQUESTS
        again = busy or (
            self._repeatable and response.status_code == HTTPStatus.SERVICE_UNAVAILABLE
        )
        seconds = self._wait(_retry_after(response), again=again)
        if seconds is None:
            raise error_of(response)
        return seconds

    def _wait(self, at_least: float, *, again: bool) -> float | None:
        self._failures += 1
        delay = self._backoff.delay(self._failures) if again else None
        # A server that wants a longer pause than allowed gets no further attempt.
        if delay is None or at_least > self._backoff.longest:
            return None
        return max(delay, at_least)


def unreachable(url: str, error: Exception) -> StoreUnavailable:
    """Return the error for a server that did not answer."""
    return StoreUnavailable(
        f"server {masked_url(url)}: {str(error) or type(error).__name__}; start one with"
        " `gaitswarm serve`, or check the URL"
    )


def foreign(url: str) -> StoreUnavailable:
    """Return the error for a server that is not gaitswarm's, or of another version."""
    return StoreUnavailable(
        f"server {masked_url(url)} does not answer as a gaitswarm server of this version does"
    )


def error_of(response: httpx2.Response) -> GaitswarmError:
    """Return the error that a response reports."""
    try:
        problem = ProblemView.model_validate_json(response.content)
    except ValidationError:
        return StoreUnavailable(f"server answered {response.status_code} without saying why")
    kind_of_problem = problem.type.rpartition(":")[2]
    field = problem.errors[0].field if problem.errors else ""
    if kind_of_problem == "quota-exceeded":
        return QuotaExceeded(problem.detail.removeprefix(f"{field}: "), field=field)
    kind = _CONFLICTS.get(kind_of_problem) or _ERRORS.get(problem.status)
    if kind is not None:
        return kind(problem.detail)
    if problem.status == HTTPStatus.TOO_MANY_REQUESTS:
        return TooManyRequests(problem.detail, retry_after=_retry_after(response))
    if problem.status >= HTTPStatus.INTERNAL_SERVER_ERROR:
        return StoreUnavailable(problem.detail)
    return InvalidRequest(problem.detail.removeprefix(f"{field}: "), field=field)


def _retry_after(response: httpx2.Response) -> float:
    """Return the pause that the server wants [s]; 0 if none."""
    text = response.headers.get("Retry-After", "")
    try:
        return max(0.0, float(text))
    except ValueError:
        pass
    try:
        return max(0.0, parsedate_to_datetime(text).timestamp() - time.time())
    except ValueError:
        return 0.0
