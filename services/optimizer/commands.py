"""What users may ask of a job under way: to pause, to go on, to end, to be sooner or later."""

from __future__ import annotations

from gaitswarm.services.optimizer.jobs.audit import LOCAL
from gaitswarm.services.optimizer.jobs.job import Command, Job
from gaitswarm.services.optimizer.jobs.priority import check_priority
from gaitswarm.services.optimizer.jobs.quota import Quota
from gaitswarm.services.optimizer.store.port.base import Store


class Commands:
    """Commands jobs. Thread-safe, as the store is."""

    __slots__ = ()

    store: Store

    def command(
        self,
        job_id: str,
        command: Command,
        *,
        accept_changes: bool = False,
        actor: str = LOCAL,
        quota: Quota | None = None,
    ) -> Job:
        """Pause, resume or cancel a job.

        Args:
            job_id: id of the job.
            command: what to do with it.
            accept_changes: for a job that is resumed, whether whoever takes it up may go on
                although what its numbers depend on has changed.
            actor: name of the token that the request came with, if any; for the audit log.
            quota: what the unfinished jobs of the job's owner may come to; None for no limit.

        Returns:
            The job as it is then.

        Raises:
            NotFound: no job of that id.
            Conflict: not possible in its state; says what is.
            QuotaExceeded: it had ended, and its owner has too much under way.
        """
        return self.store.command(
            job_id, command, accept_changes=accept_changes, actor=actor, quota=quota
        )

    def prioritize(self, job_id: str, priority: int, *, actor: str = LOCAL) -> Job:
        """Change a job's priority; nothing of its results depends on it.

        Args:
            job_id: id of the job.
            priority: from -10 to 10; the higher, the sooner.
            actor: name of the token that the request came with, if any; for the audit log.

        Returns:
            The job as it is then. A runner that has it shares its workers accordingly from the
            next iteration on.

        Raises:
            NotFound: no job of that id.
            Conflict: it has ended.
            InvalidRequest: the priority is out of bounds.
        """
        check_priority(priority)
        return self.store.prioritize(job_id, priority, actor=actor)
