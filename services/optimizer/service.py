"""What can be asked of the service, in the words of its users."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from gaitswarm.services.optimizer.analysis.fork import Parent, check_begun, forked
from gaitswarm.services.optimizer.analysis.questions import Questions
from gaitswarm.services.optimizer.analysis.start import started
from gaitswarm.services.optimizer.commands import Commands
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
from gaitswarm.services.optimizer.jobs.job import Claim, Job, refusal
from gaitswarm.services.optimizer.jobs.priority import check_priority
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, job_provenance
from gaitswarm.services.optimizer.jobs.quota import Quota
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.labelling import Labelling
from gaitswarm.services.optimizer.run.embedded import EMBEDDED_LEASE_SECONDS
from gaitswarm.services.optimizer.run.runner import runner_name
from gaitswarm.services.optimizer.store.port.reading import Page
from gaitswarm.services.optimizer.store.port.recordings import RecordingEntry
from gaitswarm.sim.identification.recorded_walk import RecordedWalk

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

        Args:
            spec: What the job is to do.
            idempotency_key: A key by which a repeated request is recognized.
            request: The JSON document that asked for the job, as it was sent; None: the fields
                that were given to the spec.
            owner: Name of the token that the request came with, if any.
            notify_url: Where its end is told, if anywhere; checked.
            quota: What the owner's unfinished jobs may come to; None for no limit.
            priority: From -10 to 10; the higher, the sooner.

        Returns:
            The job, and whether it is new.

        Raises:
            InvalidRequest: It cannot be simulated, or the priority is out of bounds; names the
                field.
            IdempotencyConflict: The key was used before, for another job.
            QuotaExceeded: The owner has too much under way.
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
        """Queue a job that begins with iterations of another one.

        Args:
            job_id: id of the job that is forked, its parent; nothing of it is changed.
            request: from where, and what is to be different from there on.
            idempotency_key: a key by which a repeated request is recognized.
            sent: the JSON document that asked for the fork, as it was sent; None: the fields that
                were given to the request.
            owner: name of the token that the request came with, if any.
            notify_url: where its end is told, if anywhere; checked.
            quota: what the owner's unfinished jobs may come to; None for no limit.
            priority: from -10 to 10; the higher, the sooner. The parent's is not taken over.

        Returns:
            The fork, whose `lineage` says what it took over, and whether it is new.

        Raises:
            NotFound: no job of that id.
            InvalidRequest: it makes no sense or cannot be simulated; names the field.
            ProvenanceChanged: it would go on with numbers of another provenance, and that is not
                accepted.
            Conflict: its search cannot be taken over, or not in time, or it has no design to
                start from.
            IdempotencyConflict: the key was used before, for another job.
            QuotaExceeded: the owner has too much under way.
        """
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
        """Check that the job can be simulated and store it for this process alone to run.

        Args:
            spec: What the job is to do.

        Returns:
            The job with a claim on it, which no other runner can take; to be run by `run_embedded`
            before its lease of `EMBEDDED_LEASE_SECONDS` runs out.

        Raises:
            InvalidRequest: It cannot be simulated; names the field.
        """
        self._check(spec)
        return self.store.create_claimed_job(
            started(spec, self.job, self.columns),
            runner_name(),
            lease_seconds=EMBEDDED_LEASE_SECONDS,
            provenance=self.provenance(spec),
        )

    def record(self, walk: RecordedWalk, *, actor: str = LOCAL) -> str:
        """Keep a recorded walk, to which jobs can fit.

        Args:
            walk: as it was recorded.
            actor: name of the token that the request came with, if any; for the audit log.

        Returns:
            Its id, the same for the same walk.
        """
        return self.store.add_recording(walk, actor=actor)

    def recording(self, recording_id: str) -> RecordedWalk:
        """Read a recorded walk.

        Args:
            recording_id: as `record` gave it.

        Returns:
            The walk.

        Raises:
            NotFound: no walk of that id.
        """
        return self.store.recordings([recording_id])[recording_id]

    def recordings(
        self, *, search: str = "", after: str | None = None, limit: int = 50
    ) -> Page[RecordingEntry]:
        """Read a page of the list of recorded walks, the newest first.

        Args:
            search: only walks whose id, scenario or controller contain this, whatever its case.
            after: `next` of the page before; None for the first page.
            limit: most walks on the page.

        Returns:
            The page, without the currents.

        Raises:
            InvalidRequest: `after` is no cursor of this list.
        """
        return self.store.recording_list(search=search, after=after, limit=limit)

    def estimate(self, spec: Spec) -> Estimate:
        """Say what a job would cost, by the rate of jobs like it or a walk that is measured here.

        Args:
            spec: of the job; it is not submitted.

        Returns:
            Counts, and times where a rate is known.

        Raises:
            InvalidRequest: it cannot be simulated; names the field.
        """
        self._check(spec)
        cases = spec.cases(self.store.recordings(spec.recording_ids))
        others = [job for job in self.store.jobs(limit=_EARLIER).items if job.readable]
        return estimate(started(spec, self.job, self.columns), cases, others, self._rates)

    def job(self, job_id: str) -> Job:
        """Read a job.

        Args:
            job_id: id of the job.

        Returns:
            The job as it is now.

        Raises:
            NotFound: no job of that id.
        """
        return self.store.job(job_id)

    def check_unchanged(self, job: Job) -> None:
        """Check that a job's next numbers, computed here, depend on what those that it has do.

        Args:
            job: as it was read.

        Raises:
            ProvenanceChanged: they would not; says what is different.
        """
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
        """Give a job another budget.

        Args:
            job_id: id of the job.
            iterations: of the budget, in all.
            actor: name of the token that the request came with, if any; for the audit log.
            quota: what the unfinished jobs of the job's owner may come to; None for no limit.

        Returns:
            The job as it is then; queued if it had succeeded.

        Raises:
            NotFound: no job of that id.
            Conflict: it was cancelled.
            InvalidRequest: the budget is spent already, or too large.
            QuotaExceeded: its owner would have too much under way.
        """
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
        """List committed iterations, page by page.

        Args:
            job_id: id of the job.
            after: only iterations with a greater index; None for all.
            limit: most iterations on a page.

        Returns:
            A page, by index; `next` is None on the last one.

        Raises:
            NotFound: no job of that id.
        """
        return self.store.iterations(job_id, after=after, limit=limit)

    def evaluations(self, job_id: str, iteration: int) -> tuple[Evaluation, ...]:
        """Read every design of a committed iteration.

        Args:
            job_id: id of the job.
            iteration: index, from 0.

        Returns:
            In order.

        Raises:
            NotFound: no job of that id, or no such iteration of it.
        """
        return self.store.evaluations(job_id, iteration)

    def best(self, job_id: str) -> Evaluation | None:
        """Read the best design so far.

        Args:
            job_id: id of the job.

        Returns:
            The earliest of least fitness in double precision, None while every design has failed.

        Raises:
            NotFound: no job of that id.
        """
        return self.store.best(job_id)
