"""What jobs of a database found, read in threads."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from functools import partial
from typing import TypeVar

from anyio import to_thread

from gaitswarm.jobs.database.findings import DatabaseFindings
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
    RankingView,
)
from gaitswarm.views.analysis import ImportanceView, ScenarioFamiliesView
from gaitswarm.views.calibration import TargetsView
from gaitswarm.views.certificate import CertificateView
from gaitswarm.views.comparison import JobComparisonView
from gaitswarm.views.identification import IdentifiabilityView
from gaitswarm.views.verification import HistoryVerificationView

T = TypeVar("T")


class AsyncDatabaseFindings(ABC):
    """Findings, read without blocking the event loop."""

    @abstractmethod
    async def _jobs(self) -> DatabaseFindings:
        """By whom they are read."""

    async def best(self, job_id: str) -> BestView:
        """Read the best design of a job."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.best, job_id)

    async def iterations(
        self, job_id: str, *, after: int | None = None
    ) -> AsyncIterator[IterationView]:
        """Read committed iterations by pages."""
        jobs = await self._jobs()
        async for iteration in iterated(partial(jobs.iterations, job_id, after=after)):
            yield iteration

    async def history(self, job_id: str) -> AsyncIterator[HistoryIterationView]:
        """Read committed iterations with their designs, by pieces."""
        jobs = await self._jobs()
        async for iteration in iterated(partial(jobs.history, job_id)):
            yield iteration

    async def evaluations(self, job_id: str) -> EvaluationTable:
        """Read every evaluation."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.evaluations, job_id)

    async def ranking(
        self, job_id: str, preference: PreferenceInput, *, top: int = 20
    ) -> RankingView:
        """Rank a job's designs from what is stored."""
        jobs = await self._jobs()
        return await to_thread.run_sync(partial(jobs.ranking, job_id, preference, top=top))

    async def scenarios(self, job_id: str, *, tolerance: float = 0.01) -> ScenarioFamiliesView:
        """Judge a job's designs by fewer scenarios, from what is stored."""
        jobs = await self._jobs()
        return await to_thread.run_sync(partial(jobs.scenarios, job_id, tolerance=tolerance))

    async def importance(self, job_id: str) -> ImportanceView:
        """Estimate indices from what is stored, in a thread."""
        jobs = await self._jobs()
        return await to_thread.run_sync(partial(jobs.importance, job_id))

    async def comparison(self, job_ids: Sequence[str]) -> JobComparisonView:
        """Compare jobs from what is stored, in a thread."""
        jobs = await self._jobs()
        return await to_thread.run_sync(partial(jobs.comparison, job_ids))

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
        """Rank a job's designs under many preferences, in a thread."""
        jobs = await self._jobs()
        asked = partial(
            jobs.preferences,
            job_id,
            drawn=drawn,
            candidates=candidates,
            samples=samples,
            radius=radius,
            seed=seed,
            precision=precision,
        )
        return await to_thread.run_sync(asked)

    async def front(self, job_id: str, *, most: int = 1000) -> FrontView:
        """Find a job's front from what is stored."""
        jobs = await self._jobs()
        return await to_thread.run_sync(partial(jobs.front, job_id, most=most))

    async def preference_for(self, job_id: str, iteration: int, particle: int) -> PreferenceForView:
        """Find a design's preference from what is stored."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.preference_for, job_id, iteration, particle)

    async def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """Compare runs from what is stored."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.parameters, job_ids)

    async def targets(
        self, job_ids: Sequence[str], *, leave_out: LeaveOut | None = None
    ) -> TargetsView:
        """Compare runs with their targets, from what is stored."""
        jobs = await self._jobs()
        asked = partial(jobs.targets, job_ids, leave_out=leave_out)
        return await to_thread.run_sync(asked)

    async def certificate(
        self, job_id: str, *, worlds: int | None = None, most: int = 5
    ) -> CertificateView:
        """Say what a certificate comes to, from what is stored."""
        jobs = await self._jobs()
        asked = partial(jobs.certificate, job_id, worlds=worlds, most=most)
        return await to_thread.run_sync(asked)

    async def export(
        self, job_id: str, file_format: TableFormat = "parquet"
    ) -> AsyncIterator[bytes]:
        """Write every evaluation as a file, in parts as they are read."""
        jobs = await self._jobs()
        async for part in iterated(partial(jobs.export, job_id, file_format)):
            yield part

    async def evidence(self, job_id: str) -> bytes:
        """Write evidence from what is stored."""
        jobs = await self._jobs()
        return await to_thread.run_sync(jobs.evidence, job_id)

    async def verify(
        self, job_id: str, *, replay: int = 0, seed: int | None = None, head: str | None = None
    ) -> HistoryVerificationView:
        """Compute a job's chain again from what is stored, in a thread."""
        jobs = await self._jobs()
        asked = partial(jobs.verify, job_id, replay=replay, seed=seed, head=head)
        return await to_thread.run_sync(asked)


async def iterated(items: Callable[[], Iterator[T]]) -> AsyncIterator[T]:
    """Take the items of an iterator in threads.

    Args:
        items: Makes the iterator.

    Yields:
        Its items, in order.
    """
    iterator = await to_thread.run_sync(items)
    while True:
        taken = await to_thread.run_sync(_next, iterator)
        if not taken:
            return
        yield taken[0]


def _next(iterator: Iterator[T]) -> tuple[T, ...]:
    """The next item, or none: StopIteration cannot leave a thread."""
    for item in iterator:
        return (item,)
    return ()
