"""Jobs of a gaitswarm server, over its HTTP API."""

from __future__ import annotations

import ssl
import time
import uuid
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, suppress
from http import HTTPStatus
from socket import SHUT_RDWR
from typing import Any, Final, TypeVar, get_origin
from urllib.parse import quote, urlsplit

import httpx2
from pydantic import BaseModel, ValidationError

from gaitswarm.jobs.base import JobEvent, Jobs, Stop, Submission
from gaitswarm.jobs.operation import Operation
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
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.masking import masked_url
from gaitswarm.services.optimizer.run.outage import Backoff
from gaitswarm.views.base import PREFIX, ProblemView
from gaitswarm.views.job import IterationView, JobView, StateView

T = TypeVar("T")

TIMEOUT: Final = 30.0
"""Longest silence of a server [s]."""

BACKOFF: Final = Backoff(first=0.25, longest=10.0, attempts=4)
"""Default repetition of requests."""

RECONNECT: Final = Backoff(first=1.0, longest=1.0, attempts=30)
"""Default repetition of connections to an event stream; a restarted server is back by then."""

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


class ServerJobs(Jobs):
    """Jobs behind a server.

    A request is repeated after a lost connection or a 503 if it is safe: one that only reads, or
    has an idempotency key, as `submit` sends. After a 429, which says that nothing was done, every
    request is.
    """

    def __init__(
        self,
        url: str,
        *,
        timeout: float = TIMEOUT,
        backoff: Backoff = BACKOFF,
        reconnect: Backoff = RECONNECT,
        headers: Mapping[str, str] | None = None,
        transport: httpx2.BaseTransport | None = None,
    ) -> None:
        """Create a client, as `gaitswarm.connect` does; nothing is sent yet."""
        self._url = server_url(url)
        self._backoff = backoff
        self._reconnect = reconnect
        self._client = httpx2.Client(
            base_url=self._url + PREFIX,
            timeout=timeout,
            headers=headers,
            transport=transport,
            verify=authorities(self._url),
        )

    @property
    def place(self) -> str:
        """Options by which a command reaches the same jobs."""
        return f" --server {masked_url(self._url)}"

    def _answer(self, operation: Operation, arguments: Mapping[str, Any]) -> Any:
        path, request = operation.validated(arguments)
        options: dict[str, Any] = {"repeatable": operation.reads}
        if request is not None and operation.method == "GET":
            options["params"] = request.model_dump(mode="json", exclude_none=True)
        elif request is not None:
            options["body"] = request
        url = operation.path.format_map({name: _segment(part) for name, part in path.items()})
        if get_origin(operation.result) is Iterator:
            return self._parts(url, **options)
        response = self._response(operation.method, url, **options)
        if operation.result is bytes:
            return response.content
        return self._decoded(operation.adapter.validate_json, response.content or b"null")

    def _submit(self, spec: AnySpec, submission: Submission) -> JobView:
        return self._created("/jobs", spec, submission)

    def _fork(self, job_id: str, request: ForkRequest, submission: Submission) -> JobView:
        return self._created(f"/jobs/{_segment(job_id)}/fork", request, submission)

    def _created(self, url: str, body: BaseModel, submission: Submission) -> JobView:
        headers = {
            "Idempotency-Key": submission.idempotency_key or uuid.uuid4().hex,
            "Job-Priority": str(submission.priority),
        }
        if submission.notify_url is not None:
            headers["Notify-URL"] = submission.notify_url
        response = self._response("POST", url, body=body, headers=headers)
        return self._decoded(JobView.model_validate_json, response.content)

    def _parts(self, url: str, **options: Any) -> Iterator[bytes]:
        """Yield the parts of a file."""
        with closing(self._response("GET", url, stream=True, **options)) as response:
            try:
                yield from response.iter_bytes()
            except httpx2.HTTPError as error:
                raise unreachable(self._url, error) from error

    def _follow(self, job_id: str, after: int | None, stop: Stop) -> Iterator[JobEvent]:
        self.job(job_id)
        failures, last, ended = 0, None, False
        while not stop.is_set():
            seconds = self._reconnect.first
            try:
                for event in self._events(job_id, after, stop):
                    failures = 0
                    if isinstance(event, IterationView):
                        after = event.index
                    elif (event.state, event.waiting) == last:
                        # A new connection begins with the state that the previous one sent.
                        continue
                    else:
                        last, ended = (event.state, event.waiting), event.state.terminal
                    yield event
            except (httpx2.HTTPError, StoreUnavailable) as error:
                failures += 1
                if not stop.is_set():
                    seconds = self._pause(failures, error)
            except ValidationError as error:
                raise foreign(self._url) from error
            if ended:
                return
            stop.wait(seconds)

    def _pause(self, failures: int, error: httpx2.HTTPError | StoreUnavailable) -> float:
        """Return the time until the next connection [s]; raise the error if there is none."""
        seconds = self._reconnect.delay(failures)
        if seconds is not None:
            return seconds
        if isinstance(error, StoreUnavailable):
            raise error
        raise unreachable(self._url, error) from error

    def _events(self, job_id: str, after: int | None, stop: Stop) -> Iterator[JobEvent]:
        """Yield the events of one connection."""
        headers = {"Accept": "text/event-stream", "Cache-Control": "no-store"}
        if after is not None:
            headers["Last-Event-ID"] = str(after)
        url = f"/jobs/{_segment(job_id)}/events"
        with (
            closing(self._response("GET", url, headers=headers, stream=True)) as response,
            stop.waking(lambda: _shut(response)),
        ):
            for sent in httpx2.EventSource(response):
                event = _event(sent)
                if event is not None:
                    yield event

    def close(self) -> None:
        """Close the connections."""
        self._client.close()

    def _decoded(self, decode: Callable[[bytes], T], content: bytes) -> T:
        try:
            return decode(content)
        except ValueError as error:
            raise foreign(self._url) from error

    def _response(
        self,
        method: str,
        url: str,
        *,
        params: Mapping[str, Any] | None = None,
        body: BaseModel | None = None,
        headers: Mapping[str, str] | None = None,
        repeatable: bool = True,
        stream: bool = False,
    ) -> httpx2.Response:
        """Return a successful response, after as many attempts as necessary and allowed."""
        headers = dict(headers or {})
        if body is not None:
            headers["Content-Type"] = "application/json"
        content = None if body is None else body.model_dump_json()
        attempts = Attempts(self._url, self._backoff, repeatable=repeatable)
        while True:
            request = self._client.build_request(
                method, url, params=params, content=content, headers=headers
            )
            try:
                response = self._client.send(request, stream=stream)
                if response.is_success:
                    return response
                response.read()
                response.close()
                outcome: httpx2.Response | httpx2.HTTPError = response
            except httpx2.HTTPError as error:
                outcome = error
            time.sleep(attempts.after(outcome))


def _event(sent: httpx2.ServerSentEvent) -> JobEvent | None:
    if sent.event == "deleted":
        raise NotFound("the job was deleted while it was followed")
    if sent.event == "iteration":
        return IterationView.model_validate_json(sent.data)
    return StateView.model_validate_json(sent.data) if sent.event == "state" else None


def _segment(name: str | int) -> str:
    """Quote an identifier as one segment of a path."""
    text = str(name)
    if text in ("", ".", ".."):
        raise NotFound(f"no resource has the id {text!r}")
    return quote(text, safe="")


def _shut(response: httpx2.Response) -> None:
    """Shut the connection of a response, so that a thread that reads from it continues."""
    stream = response.extensions.get("network_stream")
    connection = None if stream is None else stream.get_extra_info("socket")
    if connection is not None:
        with suppress(OSError):
            connection.shutdown(SHUT_RDWR)


def server_url(url: str) -> str:
    """Return a server's URL without a slash at its end; raise InvalidRequest if it is not one."""
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
    """Return the trusted authorities: the usual ones for https, none otherwise."""
    return urlsplit(url).scheme == "https" or ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)


class Attempts:
    """The attempts at one request; see `ServerJobs`."""

    def __init__(self, url: str, backoff: Backoff, *, repeatable: bool) -> None:
        self._url = url
        self._backoff = backoff
        self._repeatable = repeatable
        self._failures = 0

    def after(self, outcome: httpx2.Response | httpx2.HTTPError) -> float:
        """Return the time until the next attempt [s]; raise the error if there is none."""
        self._failures += 1
        if isinstance(outcome, httpx2.Response):
            at_least, code = _retry_after(outcome), outcome.status_code
            again = code == HTTPStatus.TOO_MANY_REQUESTS or (
                self._repeatable and code == HTTPStatus.SERVICE_UNAVAILABLE
            )
        else:
            at_least, again = 0.0, self._repeatable and isinstance(outcome, _TRANSIENT)
        delay = self._backoff.delay(self._failures) if again else None
        # A server that wants a longer pause than allowed gets no further attempt.
        if delay is not None and at_least <= self._backoff.longest:
            return max(delay, at_least)
        if isinstance(outcome, httpx2.Response):
            raise error_of(outcome)
        raise unreachable(self._url, outcome) from outcome


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
    try:
        return max(0.0, float(response.headers.get("Retry-After", "")))
    except ValueError:
        return 0.0
