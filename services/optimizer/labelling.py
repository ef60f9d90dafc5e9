"""What people write on jobs, and how they find them by that."""

from __future__ import annotations

from gaitswarm.services.optimizer.jobs.audit import LOCAL
from gaitswarm.services.optimizer.jobs.job import Job, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import ANY_JOB, FacetCounts, JobFilter, LabelsChange
from gaitswarm.services.optimizer.store.port.base import Store
from gaitswarm.services.optimizer.store.port.reading import Page


class Labelling:
    """Lists, labels and counts jobs. Thread-safe, as the store is."""

    __slots__ = ()

    store: Store

    def jobs(
        self,
        *,
        state: JobState | None = None,
        kind: str | None = None,
        parent: str | None = None,
        search: str = "",
        where: JobFilter = ANY_JOB,
        order: JobOrder = JobOrder.CREATED,
        after: str | None = None,
        limit: int = 50,
        reverse: bool = False,
    ) -> Page[Job]:
        """List jobs, page by page. Jobs submitted meanwhile do not shift later pages."""
        return self.store.jobs(
            state=state,
            kind=kind,
            parent=parent,
            search=search,
            where=where,
            order=order,
            after=after,
            limit=limit,
            reverse=reverse,
        )

    def facets(self, *, archived: bool | None = None) -> FacetCounts:
        """Count jobs by what they are found by."""
        return self.store.facets(archived=archived)

    def label(self, job_id: str, change: LabelsChange, *, actor: str = LOCAL) -> Job:
        """Change what is written on a job; nothing that determines results."""
        return self.store.label(job_id, change, actor=actor)
