"""The port through which commands reach jobs: in a database of their own, or behind a server."""

from __future__ import annotations

from collections.abc import Iterator
from types import TracebackType
from typing import TYPE_CHECKING, Protocol, Self

if TYPE_CHECKING:
    from api.views import (
        BestView,
        HistoryIterationView,
        IterationView,
        JobSummaryView,
        JobView,
        StateView,
    )
    from services.optimizer.job import Command, JobState
    from services.optimizer.spec import Spec


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

    def jobs(self, *, state: JobState | None, limit: int) -> Iterator[JobSummaryView]:
        """Newest first, at most `limit`."""

    def job(self, job_id: str) -> JobView:
        """One job in full."""

    def command(self, job_id: str, command: Command) -> JobView:
        """Pause, resume or cancel. Raises Conflict."""

    def best(self, job_id: str) -> BestView:
        """The best design so far; NotFound while there is none."""

    def iterations(self, job_id: str) -> Iterator[IterationView]:
        """Committed iterations, in order."""

    def history(self, job_id: str) -> Iterator[HistoryIterationView]:
        """Committed iterations with every particle, in order."""

    def follow(self, job_id: str) -> Iterator[IterationView | StateView]:
        """What is committed, then what comes, until the job has ended; state when it changes."""

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
