"""What jobs of a server found, asked for over HTTP."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from typing import TypeVar

import httpx2
from pydantic import BaseModel

from gaitswarm.jobs.findings import Findings
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


class ServerFindings(Findings, ABC):
    """Findings, computed by the server."""

    @property
    @abstractmethod
    def url(self) -> str:
        """The server's URL."""

    @abstractmethod
    def _send(self, call: Call[T]) -> T:
        """The result of a call."""

    @abstractmethod
    def _items(self, page: Callable[[str | None], Call[PageView[V]]]) -> Iterator[V]:
        """Items of all pages."""

    @abstractmethod
    def _opened(self, call: Call[bytes]) -> AbstractContextManager[httpx2.Response]:
        """A successful answer whose body is read as it comes."""

    def best(self, job_id: str) -> BestView:
        """Ask the server for the best design of a job."""
        return self._send(calls.best(job_id))

    def iterations(self, job_id: str, *, after: int | None = None) -> Iterator[IterationView]:
        """List committed iterations, page by page."""
        first = None if after is None else str(after)
        return self._items(lambda cursor: calls.iterations(job_id, cursor or first))

    def history(self, job_id: str) -> Iterator[HistoryIterationView]:
        """List committed iterations, and ask for the designs of each."""
        for iteration in self.iterations(job_id):
            particles = self._send(calls.evaluations_of(job_id, iteration.index)).items
            yield HistoryIterationView(**dict(iteration), evaluations=particles)

    def evaluations(self, job_id: str) -> EvaluationTable:
        """Download every evaluation at once."""
        return self._send(calls.evaluations(job_id, self._send(calls.job(job_id)).spec))

    def ranking(self, job_id: str, preference: PreferenceInput, *, top: int = 20) -> RankingView:
        """Let the server rank a job's designs."""
        return self._send(analysis_calls.ranking(job_id, arguments.ranking(preference, top)))

    def scenarios(self, job_id: str, *, tolerance: float = 0.01) -> ScenarioFamiliesView:
        """Let the server judge a job's designs by fewer scenarios."""
        return self._send(analysis_calls.scenarios(job_id, tolerance))

    def importance(self, job_id: str) -> ImportanceView:
        """Let the server estimate indices."""
        return self._send(analysis_calls.importance(job_id))

    def comparison(self, job_ids: Sequence[str]) -> JobComparisonView:
        """Let the server compare jobs."""
        return self._send(analysis_calls.comparison(arguments.runs(job_ids)))

    def preferences(
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
        return self._send(analysis_calls.preferences(job_id, request))

    def front(self, job_id: str, *, most: int = 1000) -> FrontView:
        """Let the server find a job's front."""
        return self._send(analysis_calls.front(job_id, most))

    def preference_for(self, job_id: str, iteration: int, particle: int) -> PreferenceForView:
        """Let the server find a design's preference."""
        return self._send(analysis_calls.preference_for(job_id, iteration, particle))

    def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """Let the server compare runs."""
        return self._send(calls.parameters(arguments.runs(job_ids)))

    def targets(self, job_ids: Sequence[str], *, leave_out: LeaveOut | None = None) -> TargetsView:
        """Let the server compare runs with their targets."""
        chosen = arguments.leave_out(leave_out)
        return self._send(calls.targets(arguments.runs(job_ids), chosen))

    def certificate(
        self, job_id: str, *, worlds: int | None = None, most: int = 5
    ) -> CertificateView:
        """Ask the server what a certificate comes to."""
        arguments.certificate(worlds, most)
        return self._send(calls.certificate(job_id, worlds, most))

    def export(self, job_id: str, file_format: TableFormat = "parquet") -> Iterator[bytes]:
        """Download every evaluation as a file, in parts as they come."""
        call = calls.export(job_id, arguments.table_format(file_format))
        with self._opened(call) as response:
            try:
                yield from response.iter_bytes()
            except httpx2.HTTPError as error:
                raise unreachable(self.url, error) from error

    def evidence(self, job_id: str) -> bytes:
        """Let the server write evidence, and download it."""
        return self._send(calls.evidence(job_id))

    def verify(
        self, job_id: str, *, replay: int = 0, seed: int | None = None, head: str | None = None
    ) -> HistoryVerificationView:
        """Let the server compute a job's chain again, and walk."""
        request = arguments.verification(replay, seed, head)
        return self._send(calls.verify(job_id, request))
