"""What people write on jobs, and how they find them by that."""

from __future__ import annotations

from services.optimizer.jobs.audit import LOCAL
from services.optimizer.jobs.job import Job
from services.optimizer.jobs.labels import FacetCounts, LabelsChange
from services.optimizer.store.base import Store


class Labelling:
    """Labels jobs, and counts them by what they are found by. Thread-safe, as the store is."""

    __slots__ = ()

    store: Store

    def facets(self, *, archived: bool | None = None) -> FacetCounts:
        """Count jobs by what they are found by.

        Args:
            archived: only jobs that are archived, or that are not; None for both.

        Returns:
            The counts.
        """
        return self.store.facets(archived=archived)

    def label(self, job_id: str, change: LabelsChange, *, actor: str = LOCAL) -> Job:
        """Change what is written on a job; nothing that determines results.

        Args:
            job_id: id of the job.
            change: what is to be different.
            actor: name of the token that the request came with, if any; for the audit log.

        Returns:
            The job as it is then.

        Raises:
            NotFound: no job of that id.
        """
        return self.store.label(job_id, change, actor=actor)
