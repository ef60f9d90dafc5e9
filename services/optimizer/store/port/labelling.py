"""The part of the memory's port by which people write on jobs, and find them by that."""

from __future__ import annotations

from typing import Protocol

from gaitswarm.services.optimizer.jobs.audit import LOCAL
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.labels import FacetCounts, LabelsChange


class Labelling(Protocol):
    """What people write on jobs. Thread-safe, as all of `Store` is."""

    def facets(self, *, archived: bool | None = None) -> FacetCounts:
        """Count jobs by what they are found by.

        Args:
            archived: Only jobs that are archived, or that are not; None for both.

        Returns:
            The counts.
        """

    def label(self, job_id: str, change: LabelsChange, *, actor: str = LOCAL) -> Job:
        """Change what is written on a job; nothing that determines results.

        Args:
            job_id: Of the job.
            change: What is to be different.
            actor: Whom the audit log is to name.

        Returns:
            The job as it is then.
        """
