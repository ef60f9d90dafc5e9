"""The part of the memory's port by which jobs are deleted, or protected from that."""

from __future__ import annotations

from collections.abc import Callable, Collection
from datetime import datetime
from typing import Protocol

from gaitswarm.services.optimizer.jobs.audit import LOCAL
from gaitswarm.services.optimizer.jobs.job import ENDED, Job, JobState


class Deletions(Protocol):
    """What becomes of jobs that nobody needs. Thread-safe, as all of `Store` is."""

    def keep(self, job_id: str, kept: bool, *, actor: str = LOCAL) -> Job:
        """Protect a job from deletion, or release it.

        Args:
            job_id: Of the job.
            kept: Whether it is protected.
            actor: Whom the audit log is to name.

        Returns:
            The job as it is then.
        """

    def delete_job(self, job_id: str, *, actor: str = LOCAL) -> None:
        """Delete a job with all that it has committed.

        It is gone for everybody when this returns, and its idempotency key is free. Rows of a long
        job are removed by `purge_deleted`. Forks have copies of theirs, and stay.

        Args:
            job_id: Of the job.
            actor: Whom the audit log is to name.

        Raises:
            Conflict: It has not ended and is not paused, or is kept.
        """

    def delete_ended_before(
        self, moment: datetime, states: Collection[JobState] = ENDED
    ) -> tuple[str, ...]:
        """Delete jobs that ended long ago, as `delete_job` does.

        Those that are kept stay, and parents of forks that have not ended.

        Args:
            moment: Jobs that ended before this time, aware, are deleted.
            states: In which they ended.

        Returns:
            Their ids.
        """

    def forget_audit_before(self, moment: datetime) -> int:
        """Remove the oldest entries of the audit log, in many short transactions.

        Args:
            moment: Entries from before this time, aware, are removed, up to the first that is not.

        Returns:
            How many are gone.
        """

    def purge_deleted(self, should_stop: Callable[[], bool] = lambda: False) -> None:
        """Remove what is left of deleted jobs, in many short transactions.

        It may be called by several processes at once, and is gone on with by any later call.

        Args:
            should_stop: Asked between transactions; the rest is left when it says so.
        """
