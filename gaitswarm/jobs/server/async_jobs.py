"""Jobs of a gaitswarm server, for programs with an event loop."""

from __future__ import annotations

import os
import uuid
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from contextlib import asynccontextmanager
from typing import TypeVar, Unpack

import anyio
import httpx2
from anyio import to_thread
from pydantic import BaseModel, ValidationError

from gaitswarm.errors import StoreUnavailable
from gaitswarm.jobs.async_port import AsyncJobs
from gaitswarm.jobs.port import JobEvent
from gaitswarm.jobs.server import calls, design_calls, job_calls
from gaitswarm.jobs.server.async_findings import AsyncServerFindings
from gaitswarm.jobs.server.async_walks import AsyncServerWalks
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
from gaitswarm.jobs.server.jobs import TIMEOUT
from gaitswarm.requests import arguments, design_arguments
from gaitswarm.requests.firmware import FirmwareOptions
from gaitswarm.services.optimizer.jobs.job import Command, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import ANY_JOB, JobFilter
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


class AsyncServerJobs(AsyncServerFindings, AsyncServerWalks, AsyncJobs):
    """Jobs behind a server, over an `httpx2.AsyncClient`; attempts are those of `ServerJobs`."""

    def __init__(
        self,
        url: str,
        *,
        timeout: float = TIMEOUT,
        backoff: Backoff = BACKOFF,
        reconnect: Backoff = RECONNECT,
        headers: Mapping[str, str] | None = None,
        transport: httpx2.AsyncBaseTransport | None = None,
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
        self._client = httpx2.AsyncClient(
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

    async def submit(
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
        return await self._send(call)

    async def fork(
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
        return await self._send(call)

    async def estimate(
        self, spec: SpecInput | None = None, **options: Unpack[SpecOptions]
    ) -> EstimateView:
        """Let the server say what a job would cost there."""
        return await self._send(calls.estimate(chosen_spec(spec, options)))

    async def jobs(
        self,
        *,
        state: JobState | str | None = None,
        parent: str | None = None,
        search: str = "",
        where: JobFilter = ANY_JOB,
        order: JobOrder | str = JobOrder.CREATED,
        reverse: bool = False,
        limit: int | None = None,
    ) -> AsyncIterator[JobSummaryView]:
        """List the server's jobs, page by page."""
        wanted, sorted_by = arguments.state(state), arguments.order(order)
        pages = self._items(
            lambda after: calls.jobs(wanted, parent, search, where, (sorted_by, reverse), after)
        )
        async for job in _first(limit, pages):
            yield job

    async def job(self, job_id: str) -> JobView:
        """Ask the server for one job."""
        return await self._send(calls.job(job_id))

    async def command(
        self, job_id: str, command: Command | str, *, accept_changes: bool = False
    ) -> JobView:
        """Send a command to a job."""
        call = job_calls.command(job_id, arguments.command(command), accept_changes)
        return await self._send(call)

    async def extend(self, job_id: str, iterations: int) -> JobView:
        """Send another budget for a job."""
        return await self._send(job_calls.extend(job_id, iterations))

    async def prioritize(self, job_id: str, priority: int) -> JobView:
        """Send another priority for a job."""
        return await self._send(job_calls.prioritize(job_id, priority))

    async def label(
        self,
        job_id: str,
        *,
        name: str | None = None,
        note: str | None = None,
        tags: Iterable[str] | None = None,
        archived: bool | None = None,
    ) -> JobView:
        """Let the server write on a job."""
        return await self._send(
            job_calls.label(job_id, arguments.labels(name, note, tags, archived))
        )

    async def keep(self, job_id: str, *, kept: bool = True) -> JobView:
        """Let the server keep a job, or release it."""
        return await self._send(job_calls.keep(job_id, kept))

    async def delete(self, job_id: str) -> None:
        """Let the server delete a job; it removes the rows of a long one afterwards."""
        await self._send(job_calls.delete(job_id))

    async def follow(self, job_id: str, *, after: int | None = None) -> AsyncIterator[JobEvent]:
        """Read the server's events; a connection that breaks is taken up again where it broke."""
        await self.job(job_id)
        following = Following(self._url, after, self._reconnect)
        while True:
            broken: httpx2.HTTPError | StoreUnavailable | None = None
            try:
                async with self._opened(calls.events(job_id, following.last)) as response:
                    async for sent in httpx2.EventSource(response):
                        event = following.event(sent)
                        if event is not None:
                            yield event
                if following.ended:
                    return
            except (httpx2.HTTPError, StoreUnavailable) as error:
                broken = error
            except ValidationError as error:
                raise foreign(self._url) from error
            await anyio.sleep(following.after_break(broken))

    async def write_firmware(
        self,
        design: Mapping[str, float | str] | str,
        output: str | os.PathLike[str],
        **options: Unpack[FirmwareOptions],
    ) -> FirmwareView:
        """Let the server make firmware, and write its files here."""
        from gaitswarm.firmware import check_replaceable, write_folder

        if isinstance(design, str):
            spec, best = (await self.job(design)).spec, await self.best(design)
            request = design_arguments.firmware_of_best(design, spec, best, options)
        else:
            request = design_arguments.firmware(design, options)
        await to_thread.run_sync(check_replaceable, output)
        view = await self._send(design_calls.firmware_summary(request))
        files = await self._send(design_calls.firmware(request))
        await to_thread.run_sync(write_folder, output, files)
        return view.model_copy(update={"folder": str(output)})

    async def record(self, walk: RecordedWalk) -> RecordingView:
        """Send a recorded walk to the server."""
        return await self._send(calls.record(walk))

    async def recordings(
        self, *, search: str = "", limit: int | None = None
    ) -> AsyncIterator[RecordingEntryView]:
        """List the server's recorded walks, page by page."""
        pages = self._items(lambda after: calls.recordings(search, after))
        async for recording in _first(limit, pages):
            yield recording

    async def recording(self, recording_id: str) -> RecordedWalk:
        """Ask the server for a recorded walk."""
        return await self._send(calls.recording(recording_id))

    async def close(self) -> None:
        """Close the connections."""
        await self._client.aclose()

    async def _items(self, page: Callable[[str | None], Call[PageView[V]]]) -> AsyncIterator[V]:
        after: str | None = None
        while True:
            found = await self._send(page(after))
            for item in found.items:
                yield item
            if found.next is None:
                return
            after = found.next

    async def _send(self, call: Call[T]) -> T:
        return result(call, await self._answer(call), self._url)

    @asynccontextmanager
    async def _opened(self, call: Call[bytes]) -> AsyncIterator[httpx2.Response]:
        """A successful answer whose body is read as it comes."""
        response = await self._answer(call, stream=True)
        try:
            yield response
        finally:
            await response.aclose()

    async def _answer(self, call: Call[T], *, stream: bool = False) -> httpx2.Response:
        """A successful answer, after as many attempts as it takes."""
        attempts = Attempts(call, self._url, self._backoff)
        while True:
            try:
                request = request_of(self._client, call)
                response = await self._client.send(request, stream=stream)
                if response.is_success:
                    return response
                await response.aread()
                await response.aclose()
            except httpx2.HTTPError as error:
                seconds = attempts.after_failure(error)
            else:
                seconds = attempts.after_refusal(response)
            await anyio.sleep(seconds)


async def _first(limit: int | None, items: AsyncIterator[T]) -> AsyncIterator[T]:
    """So many items, or all; no further page is asked for."""
    left = limit
    if left is not None and left <= 0:
        return
    async for item in items:
        yield item
        if left is not None:
            left -= 1
            if left <= 0:
                return
