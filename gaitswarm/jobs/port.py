"""The port through which commands reach jobs: in a database of their own, or behind a server."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Protocol, Self

if TYPE_CHECKING:
    from gaitswarm.tables import TableFormat
    from gaitswarm.views import (
        BestView,
        HistoryIterationView,
        IterationView,
        JobSummaryView,
        JobView,
        RankingRequest,
        RankingView,
        StateView,
    )
    from gaitswarm.views.identification import IdentifiabilityView, RecordingView
    from services.optimizer.jobs.job import Command, JobOrder, JobState
    from services.optimizer.jobs.spec import Spec
    from sim.identification.recorded_walk import RecordedWalk


class Jobs(Protocol):
    """Jobs as views. Both implementations answer alike and raise the same errors.

    Everything raises StoreUnavailable if the database or server cannot be reached; methods that
    take an id raise NotFound for an unknown one. Iterators read as they are consumed, so a long
    history is never held in memory.
    """

    @property
    def place(self) -> str:
        """What to add to another command that is to find the same jobs, such as " --db FILE"."""

    def submit(self, spec: Spec, *, idempotency_key: str | None = None) -> JobView:
        """Queue a job. Raises InvalidRequest, IdempotencyConflict."""

    def jobs(
        self,
        *,
        state: JobState | None,
        search: str,
        order: JobOrder,
        limit: int,
    ) -> Iterator[JobSummaryView]:
        """Jobs in a state whose name or id contains a text, in order, at most `limit`."""

    def job(self, job_id: str) -> JobView:
        """One job in full."""

    def command(self, job_id: str, command: Command, *, accept_changes: bool = False) -> JobView:
        """Pause, resume or cancel. Raises Conflict.

        Args:
            job_id: id of the job.
            command: what to do with it.
            accept_changes: for a job that is resumed, whether it goes on although what its numbers
                depend on (code, robot, compiler) has changed; that is then recorded with it.

        Returns:
            The job as it is then.
        """

    def extend(self, job_id: str, iterations: int) -> JobView:
        """Give a job a budget of `iterations` in all. Raises Conflict, InvalidRequest."""

    def ranking(self, job_id: str, request: RankingRequest) -> RankingView:
        """All designs of a job by another preference. Raises InvalidRequest, Conflict."""

    def best(self, job_id: str) -> BestView:
        """The best design so far; NotFound while there is none."""

    def iterations(self, job_id: str) -> Iterator[IterationView]:
        """Committed iterations, in order."""

    def history(self, job_id: str) -> Iterator[HistoryIterationView]:
        """Committed iterations with every particle, in order."""

    def follow(self, job_id: str) -> Iterator[IterationView | StateView]:
        """What is committed, then what comes, until the job has ended; state when it changes."""

    def record(self, walk: RecordedWalk) -> RecordingView:
        """Keep a recorded walk. The same walk again is the same recording."""

    def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """How the parameters of runs of one problem converge. Raises Conflict, InvalidRequest."""

    def export(self, job_id: str, file_format: TableFormat) -> Iterator[bytes]:
        """A file with every evaluation, in parts; see `gaitswarm.tables`."""

    def close(self) -> None:
        """Release connections. Idempotent."""

    def __enter__(self) -> Self:
        """Itself."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close."""
