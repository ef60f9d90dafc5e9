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
        """Pause, resume or cancel a job."""
        return self.store.command(
            job_id, command, accept_changes=accept_changes, actor=actor, quota=quota
        )

    def prioritize(self, job_id: str, priority: int, *, actor: str = LOCAL) -> Job:
        """Change a job's priority; nothing of its results depends on it."""
        check_priority(priority)
        return self.store.prioritize(job_id, priority, actor=actor)
