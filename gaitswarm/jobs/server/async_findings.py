"""What jobs of a server found, for programs with an event loop."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AbstractAsyncContextManager
from typing import TypeVar

import httpx2
from pydantic import BaseModel

from gaitswarm.jobs.server import analysis_calls, calls
from gaitswarm.jobs.server.attempts import (
    unreachable,
)
from gaitswarm.jobs.server.call import Call
from gaitswarm.requests import arguments
from gaitswarm.services.optimizer.analysis.front import FrontView
from gaitswarm.services.optimizer.analysis.preferences import (
    PreferenceForView,
    RobustPreferencesView,
)
from gaitswarm.services.optimizer.analysis.targets import LeaveOut
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.specs import (
    PreferenceInput,
)
from gaitswarm.tables import EvaluationTable, TableFormat
from gaitswarm.views import (
    BestView,
    HistoryIterationView,
    IterationView,
    PageView,
    RankingView,
)
from gaitswarm.views.analysis import ImportanceView, ScenarioFamiliesView
from gaitswarm.views.calibration import TargetsView
from gaitswarm.views.certificate import CertificateView
from gaitswarm.views.comparison import JobComparisonView
from gaitswarm.views.identification import IdentifiabilityView
from gaitswarm.views.verification import HistoryVerificationView

T = TypeVar("T")
V = TypeVar("V", bound=BaseModel)


class AsyncServerFindings(ABC):
    """Findings, computed by the server."""

    @property
    @abstractmethod
    def url(self) -> str:
        """The server's URL."""

    @abstractmethod
    async def _send(self, call: Call[T]) -> T:
        """The result of a call."""

    @abstractmethod
    def _items(self, page: Callable[[str | None], Call[PageView[V]]]) -> AsyncIterator[V]:
        """Items of all pages."""

    @abstractmethod
    def _opened(self, call: Call[bytes]) -> AbstractAsyncContextManager[httpx2.Response]:
        """A successful answer whose body is read as it comes."""

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
        job = await self._send(calls.job(job_id))
        return await self._send(calls.evaluations(job_id, job.spec))

    async def ranking(
        self, job_id: str, preference: PreferenceInput, *, top: int = 20
    ) -> RankingView:
        """Let the server rank a job's designs."""
        return await self._send(analysis_calls.ranking(job_id, arguments.ranking(preference, top)))

    async def scenarios(self, job_id: str, *, tolerance: float = 0.01) -> ScenarioFamiliesView:
        """Let the server judge a job's designs by fewer scenarios."""
        return await self._send(analysis_calls.scenarios(job_id, tolerance))

    async def importance(self, job_id: str) -> ImportanceView:
        """Let the server estimate indices."""
        return await self._send(analysis_calls.importance(job_id))

    async def comparison(self, job_ids: Sequence[str]) -> JobComparisonView:
        """Let the server compare jobs."""
        return await self._send(analysis_calls.comparison(arguments.runs(job_ids)))

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
        return await self._send(analysis_calls.preferences(job_id, request))

    async def front(self, job_id: str, *, most: int = 1000) -> FrontView:
        """Let the server find a job's front."""
        return await self._send(analysis_calls.front(job_id, most))

    async def preference_for(self, job_id: str, iteration: int, particle: int) -> PreferenceForView:
        """Let the server find a design's preference."""
        return await self._send(analysis_calls.preference_for(job_id, iteration, particle))

    async def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """Let the server compare runs."""
        return await self._send(calls.parameters(arguments.runs(job_ids)))

    async def targets(
        self, job_ids: Sequence[str], *, leave_out: LeaveOut | None = None
    ) -> TargetsView:
        """Let the server compare runs with their targets."""
        chosen = arguments.leave_out(leave_out)
        return await self._send(calls.targets(arguments.runs(job_ids), chosen))

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
                raise unreachable(self.url, error) from error

    async def evidence(self, job_id: str) -> bytes:
        """Let the server write evidence, and download it."""
        return await self._send(calls.evidence(job_id))

    async def verify(
        self, job_id: str, *, replay: int = 0, seed: int | None = None, head: str | None = None
    ) -> HistoryVerificationView:
        """Let the server compute a job's chain again, and walk."""
        request = arguments.verification(replay, seed, head)
        return await self._send(calls.verify(job_id, request))
