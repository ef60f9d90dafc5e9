"""Jobs of a gaitswarm server, over its HTTP API."""

from __future__ import annotations

import os
import time
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import islice
from typing import Final, TypeVar, Unpack

import httpx2
from pydantic import BaseModel, ValidationError

from gaitswarm.errors import StoreUnavailable
from gaitswarm.jobs.port import JobEvent, Jobs
from gaitswarm.jobs.server import calls, design_calls, job_calls
from gaitswarm.jobs.server.attempts import (
    BACKOFF,
    RECONNECT,
    Attempts,
    Following,
    authorities,
    foreign,
    request_of,
    result,
    server_url,
)
from gaitswarm.jobs.server.call import Call
from gaitswarm.jobs.server.findings import ServerFindings
from gaitswarm.jobs.server.walks import ServerWalks
from gaitswarm.requests import arguments, design_arguments
from gaitswarm.requests.firmware import FirmwareOptions
from gaitswarm.services.optimizer.jobs.job import Command, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import ANY_JOB, JobFilter
from gaitswarm.services.optimizer.masking import masked_url
from gaitswarm.services.optimizer.run.outage import Backoff
from gaitswarm.sim.identification.recorded_walk import RecordedWalk
from gaitswarm.specs import (
    ForkOptions,
    SpecInput,
    SpecOptions,
    chosen_spec,
)
from gaitswarm.views import (
    PREFIX,
    EstimateView,
    JobSummaryView,
    JobView,
    PageView,
)
from gaitswarm.views.firmware import FirmwareView
from gaitswarm.views.identification import RecordingEntryView, RecordingView

T = TypeVar("T")
V = TypeVar("V", bound=BaseModel)

TIMEOUT: Final = 30.0
"""Seconds in which a server must begin to answer, and go on."""


class ServerJobs(ServerFindings, ServerWalks, Jobs):
    """Jobs behind a server.

    A connection that breaks and a 503 are met by further attempts, where that is safe: for whatever
    only reads, and for `submit`, which sends an idempotency key of its own.
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
        """Make a client; nothing is sent yet.

        Args:
            url: Of the server, such as http://127.0.0.1:8000.
            timeout: Longest silence of the server [s].
            backoff: How long to wait before which of the further attempts.
            reconnect: The same where a stream of events broke; each event that comes begins anew.
            headers: Sent with every request, such as what a proxy asks for.
            transport: How requests are sent, in place of httpx2's own.

        Raises:
            InvalidRequest: It is not a URL.
        """
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
    def url(self) -> str:
        """The server's URL."""
        return self._url

    @property
    def place(self) -> str:
        """Options by which a command finds the same jobs."""
        return f" --server {masked_url(self._url)}"

    def submit(
        self,
        spec: SpecInput | None = None,
        *,
        idempotency_key: str | None = None,
        priority: int = 0,
        notify_url: str | None = None,
        **options: Unpack[SpecOptions],
    ) -> JobView:
        """Queue a job on the server; repeated as often as needed, it is queued once."""
        key = idempotency_key or uuid.uuid4().hex
        wanted = chosen_spec(spec, options)
        call = job_calls.submit(wanted, key, priority=priority, notify_url=notify_url)
        return self._send(call)

    def fork(
        self,
        job_id: str,
        from_iteration: int,
        *,
        idempotency_key: str | None = None,
        priority: int = 0,
        notify_url: str | None = None,
        **options: Unpack[ForkOptions],
    ) -> JobView:
        """Queue a fork on the server; repeated as often as needed, it is queued once."""
        key = idempotency_key or uuid.uuid4().hex
        wanted = arguments.fork(from_iteration, options)
        call = job_calls.fork(job_id, wanted, key, priority=priority, notify_url=notify_url)
        return self._send(call)

    def estimate(
        self, spec: SpecInput | None = None, **options: Unpack[SpecOptions]
    ) -> EstimateView:
        """Let the server say what a job would cost there."""
        return self._send(calls.estimate(chosen_spec(spec, options)))

    def jobs(
        self,
        *,
        state: JobState | str | None = None,
        parent: str | None = None,
        search: str = "",
        where: JobFilter = ANY_JOB,
        order: JobOrder | str = JobOrder.CREATED,
        reverse: bool = False,
        limit: int | None = None,
    ) -> Iterator[JobSummaryView]:
        """List the server's jobs, page by page."""
        wanted, sorted_by = arguments.state(state), arguments.order(order)
        found = self._items(
            lambda after: calls.jobs(wanted, parent, search, where, (sorted_by, reverse), after)
        )
        return islice(found, limit)

    def job(self, job_id: str) -> JobView:
        """Ask the server for one job."""
        return self._send(calls.job(job_id))

    def command(
        self, job_id: str, command: Command | str, *, accept_changes: bool = False
    ) -> JobView:
        """Send a command to a job."""
        call = job_calls.command(job_id, arguments.command(command), accept_changes)
        return self._send(call)

    def extend(self, job_id: str, iterations: int) -> JobView:
        """Send another budget for a job."""
        return self._send(job_calls.extend(job_id, iterations))

    def prioritize(self, job_id: str, priority: int) -> JobView:
        """Send another priority for a job."""
        return self._send(job_calls.prioritize(job_id, priority))

    def label(
        self,
        job_id: str,
        *,
        name: str | None = None,
        note: str | None = None,
        tags: Iterable[str] | None = None,
        archived: bool | None = None,
    ) -> JobView:
        """Let the server write on a job."""
        return self._send(job_calls.label(job_id, arguments.labels(name, note, tags, archived)))

    def keep(self, job_id: str, *, kept: bool = True) -> JobView:
        """Let the server keep a job, or release it."""
        return self._send(job_calls.keep(job_id, kept))

    def delete(self, job_id: str) -> None:
        """Let the server delete a job; it removes the rows of a long one afterwards."""
        self._send(job_calls.delete(job_id))

    def follow(self, job_id: str, *, after: int | None = None) -> Iterator[JobEvent]:
        """Read the server's events; a connection that breaks is taken up again where it broke."""
        self.job(job_id)
        following = Following(self._url, after, self._reconnect)
        while True:
            broken: httpx2.HTTPError | StoreUnavailable | None = None
            try:
                yield from self._events(job_id, following)
                if following.ended:
                    return
            except (httpx2.HTTPError, StoreUnavailable) as error:
                broken = error
            except ValidationError as error:
                raise foreign(self._url) from error
            time.sleep(following.after_break(broken))

    def write_firmware(
        self,
        design: Mapping[str, float | str] | str,
        output: str | os.PathLike[str],
        **options: Unpack[FirmwareOptions],
    ) -> FirmwareView:
        """Let the server make firmware, and write its files here."""
        from gaitswarm.firmware import check_replaceable, write_folder

        if isinstance(design, str):
            spec, best = self.job(design).spec, self.best(design)
            request = design_arguments.firmware_of_best(design, spec, best, options)
        else:
            request = design_arguments.firmware(design, options)
        check_replaceable(output)
        view = self._send(design_calls.firmware_summary(request))
        files = self._send(design_calls.firmware(request))
        write_folder(output, files)
        return view.model_copy(update={"folder": str(output)})

    def record(self, walk: RecordedWalk) -> RecordingView:
        """Send a recorded walk to the server."""
        return self._send(calls.record(walk))

    def recordings(
        self, *, search: str = "", limit: int | None = None
    ) -> Iterator[RecordingEntryView]:
        """List the server's recorded walks, page by page."""
        return islice(self._items(lambda after: calls.recordings(search, after)), limit)

    def recording(self, recording_id: str) -> RecordedWalk:
        """Ask the server for a recorded walk."""
        return self._send(calls.recording(recording_id))

    def close(self) -> None:
        """Close the connections."""
        self._client.close()

    def _items(self, page: Callable[[str | None], Call[PageView[V]]]) -> Iterator[V]:
        after: str | None = None
        while True:
            found = self._send(page(after))
            yield from found.items
            if found.next is None:
                return
            after = found.next

    def _events(self, job_id: str, following: Following) -> Iterator[JobEvent]:
        with self._opened(calls.events(job_id, following.last)) as response:
            for sent in httpx2.EventSource(response):
                event = following.event(sent)
                if event is not None:
                    yield event

    def _send(self, call: Call[T]) -> T:
        return result(call, self._answer(call), self._url)

    @contextmanager
    def _opened(self, call: Call[bytes]) -> Iterator[httpx2.Response]:
        """A successful answer whose body is read as it comes."""
        response = self._answer(call, stream=True)
        try:
            yield response
        finally:
            response.close()

    def _answer(self, call: Call[T], *, stream: bool = False) -> httpx2.Response:
        """A successful answer, after as many attempts as it takes."""
        attempts = Attempts(call, self._url, self._backoff)
        while True:
            try:
                response = self._client.send(request_of(self._client, call), stream=stream)
                if response.is_success:
                    return response
                response.read()
                response.close()
            except httpx2.HTTPError as error:
                seconds = attempts.after_failure(error)
            else:
                seconds = attempts.after_refusal(response)
            time.sleep(seconds)
