"""What can be asked of the service, in the words of its users."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from gaitswarm.services.optimizer.analysis.fork import Parent, check_begun, forked, started
from gaitswarm.services.optimizer.analysis.history import Questions
from gaitswarm.services.optimizer.deletion import Deletion
from gaitswarm.services.optimizer.errors import ProvenanceChanged
from gaitswarm.services.optimizer.jobs.audit import LOCAL
from gaitswarm.services.optimizer.jobs.estimate import (
    Estimate,
    MeasuredRates,
    checked_length,
    estimate,
)
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, Iteration
from gaitswarm.services.optimizer.jobs.job import Claim, Command, Job, JobOrder, JobState, refusal
from gaitswarm.services.optimizer.jobs.labels import ANY_JOB, FacetCounts, JobFilter, LabelsChange
from gaitswarm.services.optimizer.jobs.priority import check_priority
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, job_provenance
from gaitswarm.services.optimizer.jobs.quota import Quota
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.run.embedded import EMBEDDED_LEASE_SECONDS
from gaitswarm.services.optimizer.run.runner import runner_name
from gaitswarm.services.optimizer.store.port.base import Store
from gaitswarm.services.optimizer.store.port.reading import Page
from gaitswarm.services.optimizer.store.port.recordings import RecordingEntry
from gaitswarm.sim.identification.recorded_walk import RecordedWalk


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


_EARLIER: Final = 50
"""Newest jobs among which one like a new job is looked for."""


@dataclass(frozen=True, slots=True)
class JobService(Questions, Commands, Deletion, Labelling):
    """Jobs as their users see them. Thread-safe, as the store is.

    Attributes:
        store: where jobs are kept; its owner's to close.
        provenance: spec -> provenance of what is computed from here for it.
        longest_job: simulated time of all walks of all designs that a job may have [s]; if it is
            finite, the walks of an iteration are limited as well.
        longest_fork: time that bringing a search to where it was may take, for a fork [s].
    """

    provenance: Callable[[Spec], JobProvenance] = job_provenance
    longest_job: float = math.inf
    longest_fork: float = math.inf
    _rates: MeasuredRates = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        Questions.__post_init__(self)
        object.__setattr__(self, "_rates", MeasuredRates())

    def submit(
        self,
        spec: Spec,
        *,
        idempotency_key: str | None = None,
        request: Any = None,
        owner: str | None = None,
        notify_url: str | None = None,
        quota: Quota | None = None,
        priority: int = 0,
    ) -> tuple[Job, bool]:
        """Check that the job can be simulated and queue it.

        Its numbers are to depend on what they would depend on if they were computed here.
        """
        check_priority(priority)
        seconds = self._check(spec)
        if request is None:
            request = spec.model_dump(mode="json", exclude_unset=True)
        return self.store.create_job(
            started(spec, self.job, self.columns),
            provenance=self.provenance(spec),
            idempotency_key=idempotency_key,
            request=request,
            owner=owner,
            notify_url=notify_url,
            seconds=seconds,
            quota=quota,
            priority=priority,
        )

    def fork(
        self,
        job_id: str,
        request: ForkRequest,
        *,
        idempotency_key: str | None = None,
        sent: Any = None,
        owner: str | None = None,
        notify_url: str | None = None,
        quota: Quota | None = None,
        priority: int = 0,
    ) -> tuple[Job, bool]:
        """Queue a job that begins with iterations of another one."""
        check_priority(priority)
        job = self.job(job_id)
        check_begun(job, request.from_iteration)
        columns = self.columns(job)
        rows = slice(int(np.searchsorted(columns.iteration, request.from_iteration)))
        (last,) = self.store.links(job_id, request.from_iteration - 1, request.from_iteration)
        parent = Parent(
            job,
            columns.rows(rows),
            lambda: self.asked(job, request.from_iteration),
            last.link.digest,
        )
        spec, fork = forked(parent, request, self.provenance, longest=self.longest_fork)
        seconds = self._check(spec)
        if sent is None:
            sent = request.model_dump(mode="json", exclude_unset=True)
        return self.store.create_job(
            spec,
            provenance=self.provenance(spec),
            idempotency_key=idempotency_key,
            request={"fork": job_id, "request": sent},
            fork=fork,
            owner=owner,
            notify_url=notify_url,
            seconds=seconds,
            quota=quota,
            priority=priority,
        )

    def submit_embedded(self, spec: Spec) -> Claim:
        """Check that the job can be simulated and store it for this process alone to run."""
        self._check(spec)
        return self.store.create_claimed_job(
            started(spec, self.job, self.columns),
            runner_name(),
            lease_seconds=EMBEDDED_LEASE_SECONDS,
            provenance=self.provenance(spec),
        )

    def record(self, walk: RecordedWalk, *, actor: str = LOCAL) -> str:
        """Keep a recorded walk, to which jobs can fit."""
        return self.store.add_recording(walk, actor=actor)

    def recording(self, recording_id: str) -> RecordedWalk:
        """Read a recorded walk."""
        return self.store.recordings([recording_id])[recording_id]

    def recordings(
        self, *, search: str = "", after: str | None = None, limit: int = 50
    ) -> Page[RecordingEntry]:
        """Read a page of the list of recorded walks, the newest first."""
        return self.store.recording_list(search=search, after=after, limit=limit)

    def estimate(self, spec: Spec) -> Estimate:
        """Say what a job would cost, by the rate of jobs like it or a walk that is measured here"""
        self._check(spec)
        cases = spec.cases(self.store.recordings(spec.recording_ids))
        others = [job for job in self.store.jobs(limit=_EARLIER).items if job.readable]
        return estimate(started(spec, self.job, self.columns), cases, others, self._rates)

    def job(self, job_id: str) -> Job:
        """Read a job."""
        return self.store.job(job_id)

    def check_unchanged(self, job: Job) -> None:
        """Check that a job's next numbers, computed here, depend on what those that it has do."""
        refused = refusal(job, self.provenance(job.spec))
        if refused is not None:
            raise ProvenanceChanged(f"job {job.id} cannot go on: {refused}")

    def extend(
        self,
        job_id: str,
        iterations: int,
        *,
        actor: str = LOCAL,
        quota: Quota | None = None,
    ) -> Job:
        """Give a job another budget."""
        job = self.job(job_id)
        again = job.spec.with_budget(iterations) if job.readable else None
        seconds = None if again is None else self._check_length(again)
        return self.store.extend(job_id, iterations, actor=actor, seconds=seconds, quota=quota)

    def _check(self, spec: Spec) -> float | None:
        """Simulated time of all walks [s]. Raises InvalidRequest."""
        spec.check_can_be_simulated()
        spec.check_recordings(self.recording)
        return self._check_length(spec)

    def _check_length(self, spec: Spec) -> float | None:
        """Simulated time of all walks [s], None where nothing limits it. Raises InvalidRequest."""
        if math.isinf(self.longest_job):
            return None
        cases = spec.cases(self.store.recordings(spec.recording_ids))
        return checked_length(spec, cases, self.longest_job)

    def iterations(
        self, job_id: str, *, after: int | None = None, limit: int = 100
    ) -> Page[Iteration]:
        """List committed iterations, page by page."""
        return self.store.iterations(job_id, after=after, limit=limit)

    def evaluations(self, job_id: str, iteration: int) -> tuple[Evaluation, ...]:
        """Read every design of a committed iteration."""
        return self.store.evaluations(job_id, iteration)

    def best(self, job_id: str) -> Evaluation | None:
        """Read the best design so far."""
        return self.store.best(job_id)
