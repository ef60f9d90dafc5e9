"""Jobs of a gaitswarm server, over its HTTP API."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from http import HTTPStatus
from itertools import islice
from types import TracebackType
from typing import Any, Final, Self, TypeVar
from urllib.parse import quote

import httpx2
from pydantic import BaseModel, ValidationError

from gaitswarm.jobs.event_stream import read_events
from gaitswarm.tables import TableFormat
from gaitswarm.views import (
    PREFIX,
    BestView,
    CatalogueView,
    EvaluationView,
    HistoryIterationView,
    IterationView,
    JobSummaryView,
    JobView,
    PageView,
    ProblemView,
    RankingRequest,
    RankingView,
    StateView,
)
from gaitswarm.views.identification import IdentifiabilityView, RecordingView
from services.optimizer.errors import (
    Conflict,
    GaitswarmError,
    IdempotencyConflict,
    InvalidRequest,
    NotFound,
    StoreUnavailable,
)
from services.optimizer.jobs.job import Command, JobOrder, JobState
from services.optimizer.jobs.spec import Spec
from sim.identification.recorded_walk import RecordedWalk

V = TypeVar("V", bound=BaseModel)

_IS_JSON: Final = {"Content-Type": "application/json"}

_PAGE: Final = 100
_SECONDS: Final = 30.0
_RECONNECT_SECONDS: Final = 1.0
_RECONNECTS: Final = 30

_ERRORS: Final[Mapping[int, type[GaitswarmError]]] = {
    HTTPStatus.NOT_FOUND: NotFound,
    HTTPStatus.CONFLICT: Conflict,
}


class RemoteJobs:
    """`Jobs` over HTTP."""

    def __init__(self, url: str, *, transport: httpx2.BaseTransport | None = None) -> None:
        if not url.startswith(("http://", "https://")):
            raise InvalidRequest(f"{url!r} is not a URL like http://127.0.0.1:8000", field="server")
        self.place = f" --server {url}"
        self._url = url.rstrip("/")
        self._client = httpx2.Client(
            base_url=self._url + PREFIX, timeout=_SECONDS, transport=transport
        )

    def submit(self, spec: Spec, *, idempotency_key: str | None = None) -> JobView:
        """See `Jobs.submit`."""
        headers = {} if idempotency_key is None else {"Idempotency-Key": idempotency_key}
        body = spec.model_dump_json()
        return self._ask(JobView, "POST", "/jobs", content=body, headers={**headers, **_IS_JSON})

    def jobs(
        self, *, state: JobState | None, search: str, order: JobOrder, limit: int
    ) -> Iterator[JobSummaryView]:
        """See `Jobs.jobs`."""
        parameters = {"search": search, "order": order.value}
        if state is not None:
            parameters["state"] = state.value
        return islice(self._items(JobSummaryView, "/jobs", parameters), limit)

    def job(self, job_id: str) -> JobView:
        """See `Jobs.job`."""
        return self._ask(JobView, "GET", f"/jobs/{_path(job_id)}")

    def command(self, job_id: str, command: Command, *, accept_changes: bool = False) -> JobView:
        """See `Jobs.command`."""
        path = f"/jobs/{_path(job_id)}/{command.value}"
        body = {"json": {"accept_changes": True}} if accept_changes else {}
        return self._ask(JobView, "POST", path, **body)

    def extend(self, job_id: str, iterations: int) -> JobView:
        """See `Jobs.extend`."""
        path = f"/jobs/{_path(job_id)}/extend"
        return self._ask(JobView, "POST", path, json={"iterations": iterations})

    def ranking(self, job_id: str, request: RankingRequest) -> RankingView:
        """See `Jobs.ranking`."""
        path = f"/jobs/{_path(job_id)}/ranking"
        body = request.model_dump_json()
        return self._ask(RankingView, "POST", path, content=body, headers=_IS_JSON)

    def best(self, job_id: str) -> BestView:
        """See `Jobs.best`."""
        return self._ask(BestView, "GET", f"/jobs/{_path(job_id)}/best")

    def iterations(self, job_id: str) -> Iterator[IterationView]:
        """See `Jobs.iterations`."""
        return self._items(IterationView, f"/jobs/{_path(job_id)}/iterations", {})

    def history(self, job_id: str) -> Iterator[HistoryIterationView]:
        """See `Jobs.history`."""
        for iteration in self.iterations(job_id):
            path = f"/jobs/{_path(job_id)}/iterations/{iteration.index}/evaluations"
            evaluations = self._ask(CatalogueView[EvaluationView], "GET", path).items
            yield HistoryIterationView(**dict(iteration), evaluations=evaluations)

    def follow(self, job_id: str) -> Iterator[IterationView | StateView]:
        """See `Jobs.follow`. A connection that breaks is taken up again where it broke."""
        self.job(job_id)
        last: str | None = None
        failures = 0
        while True:
            try:
                for event in self._events(job_id, last):
                    failures = 0
                    if isinstance(event, IterationView):
                        last = str(event.index)
                    yield event
                    if isinstance(event, StateView) and event.state.terminal:
                        return
            except StoreUnavailable:
                failures += 1
                if failures > _RECONNECTS:
                    raise
            time.sleep(_RECONNECT_SECONDS)

    def record(self, walk: RecordedWalk) -> RecordingView:
        """See `Jobs.record`."""
        body = walk.model_dump_json()
        return self._ask(RecordingView, "POST", "/recordings", content=body, headers=_IS_JSON)

    def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """See `Jobs.parameters`."""
        first, *others = job_ids
        path = f"/jobs/{_path(first)}/parameters"
        return self._ask(IdentifiabilityView, "GET", path, params={"also": others})

    def export(self, job_id: str, file_format: TableFormat) -> Iterator[bytes]:
        """See `Jobs.export`."""
        path = f"/jobs/{_path(job_id)}/export"
        with (
            self._reaching_the_server(),
            self._client.stream("GET", path, params={"format": file_format}) as response,
        ):
            if response.is_error:
                response.read()
                raise _error(response)
            yield from response.iter_bytes()

    def close(self) -> None:
        """See `Jobs.close`."""
        self._client.close()

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the connections."""
        self.close()

    def _events(self, job_id: str, last: str | None) -> Iterator[IterationView | StateView]:
        headers = {"Accept": "text/event-stream"}
        if last is not None:
            headers["Last-Event-ID"] = last
        with self._reaching_the_server():
            path = f"/jobs/{_path(job_id)}/events"
            with self._client.stream("GET", path, headers=headers) as response:
                if response.is_error:
                    response.read()
                    raise _error(response)
                for event in read_events(response.iter_lines()):
                    if event.name == "iteration":
                        yield IterationView.model_validate_json(event.data)
                    elif event.name == "state":
                        yield StateView.model_validate_json(event.data)

    def _items(self, kind: type[V], path: str, parameters: dict[str, str]) -> Iterator[V]:
        after: str | None = None
        while True:
            cursor = {} if after is None else {"after": after}
            page = self._ask(
                PageView[kind],  # type: ignore[valid-type]
                "GET",
                path,
                params={**parameters, **cursor, "limit": str(_PAGE)},
            )
            yield from page.items
            if page.next is None:
                return
            after = page.next

    def _ask(self, kind: type[V], method: str, path: str, **request: Any) -> V:
        with self._reaching_the_server():
            response = self._client.request(method, path, **request)
            if response.is_error:
                raise _error(response)
            return kind.model_validate_json(response.content)

    @contextmanager
    def _reaching_the_server(self) -> Iterator[None]:
        try:
            yield
        except httpx2.HTTPError as error:
            raise StoreUnavailable(
                f"server {self._url}: {str(error) or type(error).__name__}; start one with"
                " `gaitswarm serve`, or check --server"
            ) from error
        except ValidationError as error:
            raise StoreUnavailable(
                f"server {self._url} does not answer as a gaitswarm server of this version does"
            ) from error


def _path(job_id: str) -> str:
    """An id as one segment of a path."""
    if not job_id or job_id in (".", ".."):
        raise NotFound(f"no job has the id {job_id!r}")
    return quote(job_id, safe="")


def _error(response: httpx2.Response) -> GaitswarmError:
    """The error that the server had, again."""
    try:
        problem = ProblemView.model_validate_json(response.content)
    except ValidationError:
        return StoreUnavailable(f"server answered {response.status_code} without saying why")
    if problem.type.endswith(":idempotency-conflict"):
        return IdempotencyConflict(problem.detail)
    kind = _ERRORS.get(problem.status)
    if kind is None:
        # What the client got wrong is bad input; anything else is for the server's owner.
        unavailable = problem.status >= HTTPStatus.INTERNAL_SERVER_ERROR
        kind = StoreUnavailable if unavailable else InvalidRequest
    return kind(problem.detail)
