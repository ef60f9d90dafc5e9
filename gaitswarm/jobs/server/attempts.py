"""When a call is sent again, and what its failure means. No I/O here; both clients lean on it.

Sent again are calls that do no harm twice, those that only read or have an idempotency key: when
the connection could not be made or broke, and on 503, after the time that the server asks for. On
429, which says that nothing was done, any call is.
"""

from __future__ import annotations

import ssl
import time
from collections.abc import Mapping
from email.utils import parsedate_to_datetime
from http import HTTPStatus
from typing import Final, TypeVar
from urllib.parse import urlsplit

import httpx2
from pydantic import ValidationError

from gaitswarm.errors import (
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
from gaitswarm.jobs.port import JobEvent
from gaitswarm.jobs.server.call import Call
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.masking import masked_url
from gaitswarm.services.optimizer.run.outage import Backoff
from gaitswarm.views import IterationView, ProblemView, StateView

T = TypeVar("T")

BACKOFF: Final = Backoff(first=0.25, longest=10.0, attempts=4)
"""How a call is repeated unless told otherwise."""

RECONNECT: Final = Backoff(first=1.0, longest=1.0, attempts=30)
"""How a broken stream of events is taken up again: a server that restarts is back by then."""

_TRANSIENT: Final = (httpx2.NetworkError, httpx2.ConnectTimeout, httpx2.RemoteProtocolError)
"""The connection was not made, or broke."""

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
"""By the end of the problem's type, where the status alone does not tell."""


class Attempts:
    """The attempts at one call: counts failures, and says when to try again or what went wrong."""

    def __init__(self, call: Call[T], url: str, backoff: Backoff) -> None:
        """Begin with the first attempt.

        Args:
            call: What is sent.
            url: Of the server, for messages.
            backoff: How long to wait before which of the further attempts.
        """
        self._repeatable = call.repeatable
        self._url = url
        self._backoff = backoff
        self._failures = 0

    def after_failure(self, error: httpx2.HTTPError) -> float:
        """Decide what follows a call that got no answer.

        Args:
            error: Why there is no answer.

        Returns:
            Time to wait before the next attempt [s].

        Raises:
            StoreUnavailable: There is to be no further attempt.
        """
        again = self._repeatable and isinstance(error, _TRANSIENT)
        seconds = self._next(0.0, repeatable=again)
        if seconds is None:
            raise unreachable(self._url, error) from error
        return seconds

    def after_refusal(self, response: httpx2.Response) -> float:
        """Decide what follows an error of the server.

        Args:
            response: The error, with its body.

        Returns:
            Time to wait before the next attempt [s].

        Raises:
            GaitswarmError: There is to be no further attempt: the error that the server had.
        """
        seconds = None
        if response.status_code == HTTPStatus.SERVICE_UNAVAILABLE:
            seconds = self._next(_retry_after(response), repeatable=self._repeatable)
        elif response.status_code == HTTPStatus.TOO_MANY_REQUESTS:
            seconds = self._next(_retry_after(response), repeatable=True)
        if seconds is None:
            raise error_of(response)
        return seconds

    def _next(self, at_least: float, *, repeatable: bool) -> float | None:
        self._failures += 1
        delay = self._backoff.delay(self._failures) if repeatable else None
        # A server that asks for more patience than there is gets no further attempt.
        if delay is None or at_least > self._backoff.longest:
            return None
        return max(delay, at_least)


class Following:
    """What has been seen of a job's events, over all connections that it took.

    Attributes:
        last: Index of the last iteration that was seen; None before the first.
        ended: Whether the job has ended, so that nothing more comes.
    """

    def __init__(self, url: str, after: int | None, backoff: Backoff) -> None:
        """Begin to follow a job.

        Args:
            url: Of the server, for messages.
            after: Index of the last iteration that is known already; None for none.
            backoff: How long to wait before which of the further connections.
        """
        self.last = after
        self.ended = False
        self._url = url
        self._backoff = backoff
        self._state: JobState | None = None
        self._failures = 0

    def event(self, sent: httpx2.ServerSentEvent) -> JobEvent | None:
        """Read what the server sent.

        Args:
            sent: An event of the stream.

        Returns:
            The job's event; None if it is no news.

        Raises:
            NotFound: The job was deleted.
        """
        self._failures = 0
        if sent.event == "iteration":
            iteration = IterationView.model_validate_json(sent.data)
            self.last = iteration.index
            return iteration
        if sent.event == "deleted":
            raise NotFound("the job was deleted while it was followed")
        if sent.event != "state":
            return None
        state = StateView.model_validate_json(sent.data)
        self.ended = state.state.terminal
        # A new connection begins with the state that the one before has told.
        told, self._state = self._state, state.state
        return None if state.state is told else state

    def after_break(self, error: httpx2.HTTPError | StoreUnavailable | None) -> float:
        """Decide what follows the end of a connection.

        Args:
            error: What broke the connection; None where the server ended the stream.

        Returns:
            Time to wait before connecting again [s].

        Raises:
            StoreUnavailable: It broke too often in a row.
        """
        if error is None:
            return self._backoff.first
        self._failures += 1
        seconds = self._backoff.delay(self._failures)
        if seconds is not None:
            return seconds
        if isinstance(error, StoreUnavailable):
            raise error
        raise unreachable(self._url, error) from error


def result(call: Call[T], response: httpx2.Response, url: str) -> T:
    """What a successful answer says.

    Args:
        call: What was sent.
        response: The answer, with its body.
        url: Of the server, for messages.

    Returns:
        The call's result.

    Raises:
        StoreUnavailable: The answer makes no sense.
    """
    try:
        return call.read(response.content)
    except ValueError as error:
        raise foreign(url) from error


def unreachable(url: str, error: Exception) -> StoreUnavailable:
    """The error for a server that did not answer.

    Args:
        url: Of the server.
        error: Why there is no answer.

    Returns:
        The error, to be raised.
    """
    return StoreUnavailable(
        f"server {masked_url(url)}: {str(error) or type(error).__name__}; start one with"
        " `gaitswarm serve`, or check the URL"
    )


def foreign(url: str) -> StoreUnavailable:
    """The error for a server that answered something else.

    Args:
        url: Of the server.

    Returns:
        The error, to be raised.
    """
    return StoreUnavailable(
        f"server {masked_url(url)} does not answer as a gaitswarm server of this version does"
    )


def error_of(response: httpx2.Response) -> GaitswarmError:
    """The error that the server had, again.

    Args:
        response: An answer that is no success, with its body.

    Returns:
        The error, to be raised.
    """
    try:
        problem = ProblemView.model_validate_json(response.content)
    except ValidationError:
        return StoreUnavailable(f"server answered {response.status_code} without saying why")
    kind_of_problem = problem.type.rpartition(":")[2]
    field = problem.errors[0].field if problem.errors else ""
    if kind_of_problem == "quota-exceeded":
        return QuotaExceeded(problem.detail.removeprefix(f"{field}: "), field=field)
    special = _CONFLICTS.get(kind_of_problem)
    if special is not None:
        return special(problem.detail)
    if problem.status == HTTPStatus.TOO_MANY_REQUESTS:
        return TooManyRequests(problem.detail, retry_after=_retry_after(response))
    kind = _ERRORS.get(problem.status)
    if kind is not None:
        return kind(problem.detail)
    # What the client got wrong is bad input; anything else is for the server's owner.
    if problem.status >= HTTPStatus.INTERNAL_SERVER_ERROR:
        return StoreUnavailable(problem.detail)
    return InvalidRequest(problem.detail.removeprefix(f"{field}: "), field=field)


def _retry_after(response: httpx2.Response) -> float:
    """Seconds that the server asks to wait; 0 if it does not say."""
    text = response.headers.get("Retry-After", "")
    try:
        return max(0.0, float(text))
    except ValueError:
        pass
    try:
        return max(0.0, parsedate_to_datetime(text).timestamp() - time.time())
    except ValueError:
        return 0.0


def server_url(url: str) -> str:
    """A server's URL without a slash at its end.

    Args:
        url: As a user gave it.

    Returns:
        The same, without that slash.

    Raises:
        InvalidRequest: It is not a URL of HTTP.
    """
    try:
        parts = urlsplit(url)
        valid = parts.scheme in ("http", "https") and parts.hostname and parts.port != 0
    except ValueError:
        valid = False
    if not valid:
        raise InvalidRequest(
            f"{masked_url(url)!r} is not a URL like http://127.0.0.1:8000", field="server"
        )
    return url.rstrip("/")


def authorities(url: str) -> ssl.SSLContext | bool:
    """Who vouches for the certificates of a server.

    Args:
        url: Of the server.

    Returns:
        True for those that are usual. For a server without certificates, a context that trusts
        nobody: reading the usual ones takes longer than most answers.
    """
    return urlsplit(url).scheme == "https" or ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)


def request_of(client: httpx2.Client | httpx2.AsyncClient, call: Call[T]) -> httpx2.Request:
    """A call as the client sends it.

    Args:
        client: Which knows the server's URL.
        call: What is asked.

    Returns:
        The request, with body and headers.
    """
    headers = dict(call.headers)
    if call.body is not None:
        headers["Content-Type"] = "application/json"
    return client.build_request(
        call.method, call.path, params=dict(call.params), content=call.body, headers=headers
    )
