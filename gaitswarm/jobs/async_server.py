"""Jobs of a gaitswarm server, for programs with an event loop."""

from __future__ import annotations

import os
import uuid
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from typing import TypeVar, Unpack

import anyio
import httpx2
from anyio import to_thread
from pydantic import BaseModel, ValidationError

from gaitswarm.errors import StoreUnavailable
from gaitswarm.jobs import calls, design_calls
from gaitswarm.jobs.async_port import AsyncJobs
from gaitswarm.jobs.async_server_walks import AsyncServerWalks
from gaitswarm.jobs.attempts import (
    BACKOFF,
    RECONNECT,
    Attempts,
    Following,
    foreign,
    request_of,
    result,
    server_url,
    unreachable,
)
from gaitswarm.jobs.call import Call
from gaitswarm.jobs.port import JobEvent
from gaitswarm.jobs.server import TIMEOUT
from gaitswarm.requests import arguments, design_arguments
from gaitswarm.requests.firmware import FirmwareOptions
from gaitswarm.specs import (
    ForkOptions,
    PreferenceInput,
    SpecInput,
    SpecOptions,
    chosen_spec,
)
from gaitswarm.tables import EvaluationTable, TableFormat
from gaitswarm.views import (
    PREFIX,
    BestView,
    EstimateView,
    HistoryIterationView,
    IterationView,
    JobSummaryView,
    JobView,
    PageView,
    RankingView,
)
from gaitswarm.views.calibration import TargetsView
from gaitswarm.views.certificate import CertificateView
from gaitswarm.views.families import ScenarioFamiliesView
from gaitswarm.views.firmware import FirmwareView
from gaitswarm.views.identification import IdentifiabilityView, RecordingView
from gaitswarm.views.preferences import RobustPreferencesView
from gaitswarm.views.tournament import ProblemRunsView, TournamentStandingsView, TournamentView
from gaitswarm.views.trade_offs import FrontView, PreferenceForView
from services.optimizer.analysis.fits.targets import LeaveOut
from services.optimizer.jobs.job import Command, JobOrder, JobState
from services.optimizer.run.coordinator import Backoff
from sim.identification.recorded_walk import RecordedWalk
from sim.kernel.walk import Precision

T = TypeVar("T")
V = TypeVar("V", bound=BaseModel)


class AsyncServerJobs(AsyncServerWalks, AsyncJobs):
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
            base_url=self._url + PREFIX, timeout=timeout, headers=headers, transport=transport
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
        **options: Unpack[SpecOptions],
    ) -> JobView:
        """Queue a job on the server; repeated as often as needed, it is queued once."""
        key = idempotency_key or uuid.uuid4().hex
        return await self._send(calls.submit(chosen_spec(spec, options), key))

    async def fork(
        self,
        job_id: str,
        from_iteration: int,
        *,
        idempotency_key: str | None = None,
        **options: Unpack[ForkOptions],
    ) -> JobView:
        """Queue a fork on the server; repeated as often as needed, it is queued once."""
        key = idempotency_key or uuid.uuid4().hex
        wanted = arguments.fork(from_iteration, options)
        return await self._send(calls.fork(job_id, wanted, key))

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
        order: JobOrder | str = JobOrder.CREATED,
        limit: int | None = None,
    ) -> AsyncIterator[JobSummaryView]:
        """List the server's jobs, page by page."""
        wanted, sorted_by = arguments.state(state), arguments.order(order)
        left = limit
        pages = self._items(lambda after: calls.jobs(wanted, parent, search, sorted_by, after))
        async for job in pages:
            if left is not None:
                if left <= 0:
                    return
                left -= 1
            yield job

    async def job(self, job_id: str) -> JobView:
        """Ask the server for one job."""
        return await self._send(calls.job(job_id))

    async def command(
        self, job_id: str, command: Command | str, *, accept_changes: bool = False
    ) -> JobView:
        """Send a command to a job."""
        call = calls.command(job_id, arguments.command(command), accept_changes)
        return await self._send(call)

    async def extend(self, job_id: str, iterations: int) -> JobView:
        """Send another budget for a job."""
        return await self._send(calls.extend(job_id, iterations))

    async def best(self, job_id: str) -> BestView:
        """Ask the server for the best design of a job."""
        return await self._send(calls.best(job_id))

    def iterations(self, job_id: str, *, after: int | None = None) -> AsyncIterator[IterationView]:
        """List committed iterations, page by page."""
        first = None if after is None else str(after)
        return self._items(lambda cursor: calls.iterations(job_id, cursor or first))

    async def history(self, job_id: str) -> AsyncIterator[HistoryIterationView]:
        """List committed iterations, and ask for the designs of each."""
        async for iteration in self.iterations(job_id):
            particles = await self._send(calls.evaluations_of(job_id, iteration.index))
            yield HistoryIterationView(**dict(iteration), evaluations=particles.items)

    async def evaluations(self, job_id: str) -> EvaluationTable:
        """Download every evaluation at once."""
        job = await self.job(job_id)
        return await self._send(calls.evaluations(job_id, job.spec))

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

    async def ranking(
        self, job_id: str, preference: PreferenceInput, *, top: int = 20
    ) -> RankingView:
        """Let the server rank a job's designs."""
        return await self._send(calls.ranking(job_id, arguments.ranking(preference, top)))

    async def scenarios(self, job_id: str, *, tolerance: float = 0.01) -> ScenarioFamiliesView:
        """Let the server judge a job's designs by fewer scenarios."""
        return await self._send(calls.scenarios(job_id, tolerance))

    async def preferences(
        self,
        job_id: str,
        *,
        drawn: int = 512,
        candidates: int = 8,
        samples: int = 0,
        radius: float = 0.02,
        seed: int = 1,
        precision: Precision = "double",
    ) -> RobustPreferencesView:
        """Let the server rank a job's designs under many preferences."""
        request = arguments.preferences(
            drawn=drawn,
            candidates=candidates,
            samples=samples,
            radius=radius,
            seed=seed,
            precision=precision,
        )
        return await self._send(calls.preferences(job_id, request))

    async def front(self, job_id: str, *, most: int = 1000) -> FrontView:
        """Let the server find a job's front."""
        return await self._send(calls.front(job_id, most))

    async def preference_for(self, job_id: str, iteration: int, particle: int) -> PreferenceForView:
        """Let the server find a design's preference."""
        return await self._send(calls.preference_for(job_id, iteration, particle))

    async def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """Let the server compare runs."""
        return await self._send(calls.parameters(arguments.runs(job_ids)))

    async def targets(
        self, job_ids: Sequence[str], *, leave_out: LeaveOut | None = None
    ) -> TargetsView:
        """Let the server compare runs with their targets."""
        chosen = arguments.leave_out(leave_out)
        return await self._send(calls.targets(arguments.runs(job_ids), chosen))

    async def tournaments(self) -> list[TournamentView]:
        """Ask the server which tournaments there are."""
        return (await self._send(calls.tournaments())).items

    async def standings(
        self, job_id: str, *, compare_with: str | None = None
    ) -> TournamentStandingsView:
        """Let the server judge a tournament."""
        return await self._send(calls.standings(job_id, compare_with))

    async def problem_runs(self, job_id: str, problem: str) -> ProblemRunsView:
        """Ask the server for the runs on a problem."""
        return await self._send(calls.problem_runs(job_id, problem))

    async def certificate(
        self, job_id: str, *, worlds: int | None = None, most: int = 5
    ) -> CertificateView:
        """Ask the server what a certificate comes to."""
        arguments.certificate(worlds, most)
        return await self._send(calls.certificate(job_id, worlds, most))

    async def export(
        self, job_id: str, file_format: TableFormat = "parquet"
    ) -> AsyncIterator[bytes]:
        """Download every evaluation as a file, in parts as they come."""
        call = calls.export(job_id, arguments.table_format(file_format))
        async with self._opened(call) as response:
            try:
                async for part in response.aiter_bytes():
                    yield part
            except httpx2.HTTPError as error:
                raise unreachable(self._url, error) from error

    async def evidence(self, job_id: str) -> bytes:
        """Let the server write evidence, and download it."""
        return await self._send(calls.evidence(job_id))

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
