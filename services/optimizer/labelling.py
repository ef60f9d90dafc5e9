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
        """List jobs, page by page. Jobs submitted meanwhile do not shift later pages.

        Args:
            state: only jobs in it; None for any.
            kind: only jobs whose specs say that they are of this kind; None for any.
            parent: only jobs that were forked from the job of this id; None for any.
            search: only jobs whose name, id, note or tags contain this, whatever its case.
            where: only jobs that this admits.
            order: how they are sorted.
            after: `next` of the page before, of the same order.
            limit: most jobs on a page.
            reverse: whether the order is reversed; jobs without what they are sorted by stay last.

        Returns:
            A page; `next` is None on the last one.

        Raises:
            InvalidRequest: `after` is no cursor of that order.
        """
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
