"""The port of the memory: jobs, iterations, evaluations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from services.optimizer.access import Tokens
from services.optimizer.jobs.audit import LOCAL, AuditEntry
from services.optimizer.jobs.fork import Fork
from services.optimizer.jobs.iteration import Ask, CompletedIteration
from services.optimizer.jobs.job import (
    QUARANTINE_AFTER,
    Claim,
    Command,
    Job,
    JobOrder,
    JobState,
)
from services.optimizer.jobs.notification import Outbox
from services.optimizer.jobs.provenance import JobProvenance
from services.optimizer.jobs.quota import Quota
from services.optimizer.jobs.spec import Spec
from services.optimizer.store.deletions import Deletions
from services.optimizer.store.reading import Changes, CommittedHistory, Page, Queue
from sim.identification.recorded_walk import RecordedWalk, Recordings


class Store(CommittedHistory, Deletions, Protocol):
    """Thread-safe. Every method is one transaction: it happens wholly or not at all.

    Methods that take an id raise NotFound for an unknown one. Methods that take a claim raise
    LeaseLost, and change nothing, if the claim's token is no longer the job's.
    """

    @property
    def changes(self) -> Changes:
        """Of jobs, for those who wait for them."""

    @property
    def tokens(self) -> Tokens:
        """Of those who ask over the network."""

    @property
    def outbox(self) -> Outbox:
        """Of notifications that jobs leave when they end."""

    def create_job(
        self,
        spec: Spec,
        *,
        provenance: JobProvenance | None = None,
        idempotency_key: str | None = None,
        request: Any = None,
        fork: Fork | None = None,
        owner: str | None = None,
        notify_url: str | None = None,
        seconds: float | None = None,
        quota: Quota | None = None,
    ) -> tuple[Job, bool]:
        """Insert a queued job of the resolved spec, or find the one that the same key made before.

        Args:
            spec: What the job is to do.
            provenance: What its numbers are to depend on; None leaves that to its first claim.
            idempotency_key: Of the user; a request that is repeated with it makes no second job,
                even if presets or defaults have changed in between.
            request: The JSON document that asked for the job, as it was sent. None: the fields
                that were given to the spec.
            fork: How the job is forked from another one. What it takes over is copied, so that it
                stays when its parent goes; None for a job of its own.
            owner: Name of the token that it comes with, if any.
            notify_url: Where its end is told, if anywhere; checked.
            seconds: Simulated time of all its walks [s]; None where nobody has asked.
            quota: What the owner's unfinished jobs may come to with it; None for no limit.

        Returns:
            The job, and whether it is new.

        Raises:
            Conflict: The job that is forked is gone.
            QuotaExceeded: The owner has too much under way.
            InvalidRequest: The key is empty, too long or not printable.
            IdempotencyConflict: The key was used for a request that is neither this one nor
                resolves to the same spec.
        """

    def create_claimed_job(
        self,
        spec: Spec,
        runner: str,
        *,
        lease_seconds: float,
        provenance: JobProvenance | None = None,
    ) -> Claim:
        """Insert a job of the resolved spec that is running from the start, held by a runner.

        It is never queued, so no other runner can have it before this one's lease runs out.

        Args:
            spec: What the job is to do.
            runner: Who holds it.
            lease_seconds: For how long, unless the claim is renewed [s].
            provenance: What its numbers are to depend on; None leaves that to whoever runs it.

        Returns:
            The claim, as `claim` would have given it for a new job.
        """

    def job(self, job_id: str) -> Job:
        """Read a job with its progress.

        Args:
            job_id: Of the job.

        Returns:
            The job as it is now, whether its spec can be read or not.
        """

    def jobs(
        self,
        *,
        state: JobState | None = None,
        kind: str | None = None,
        parent: str | None = None,
        search: str = "",
        order: JobOrder = JobOrder.CREATED,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[Job]:
        """Read a page of jobs.

        Args:
            state: Only jobs in this state.
            kind: Only jobs whose specs say that they are of this kind.
            parent: Only jobs that were forked from the job of this id.
            search: Only jobs whose name or id contains this, whatever its case.
            order: By what they are sorted.
            after: `next` of the page before.
            limit: Most jobs on the page.

        Returns:
            The page; jobs that are submitted meanwhile do not shift later ones.

        Raises:
            InvalidRequest: `after` is no cursor of this order, or `limit` is less than 1.
        """

    def queue(self) -> Queue:
        """Count the jobs, for those who watch over the service.

        Returns:
            The counts, all of one moment on SQLite.
        """

    def command(
        self,
        job_id: str,
        command: Command,
        *,
        accept_changes: bool = False,
        actor: str = LOCAL,
        quota: Quota | None = None,
    ) -> Job:
        """Apply a command of a user; see `commanded` for what is possible.

        Cancelling clears the lease, so a runner's next write is refused.

        Args:
            job_id: Of the job.
            command: What to do with it.
            accept_changes: Of a job that is queued again, whether it may go on although what its
                numbers depend on has changed; until it is claimed.
            actor: Whom the audit log is to name.
            quota: What the unfinished jobs of its owner may come to, if it has ended and is queued
                again; None for no limit.

        Returns:
            The job as it is then.

        Raises:
            Conflict: Its state does not allow it.
            QuotaExceeded: Its owner has too much under way.
            Unreadable: It would be queued, but cannot be read.
        """

    def extend(
        self,
        job_id: str,
        iterations: int,
        *,
        actor: str = LOCAL,
        seconds: float | None = None,
        quota: Quota | None = None,
    ) -> Job:
        """Give a job another budget; see `extended` for what it may be.

        What is committed stays, as does the iteration under way; what is asked after it is asked
        under the new budget. A job that has succeeded is queued again.

        Args:
            job_id: Of the job.
            iterations: The budget, in all.
            actor: Whom the audit log is to name.
            seconds: Simulated time of all its walks then [s]; None where nobody has asked.
            quota: What the unfinished jobs of its owner may come to then; None for no limit.

        Returns:
            The job as it is then.

        Raises:
            Conflict: The job was cancelled.
            QuotaExceeded: Its owner would have too much under way.
            InvalidRequest: The budget is spent already, or a job of this kind and method cannot
                have it.
            Unreadable: The job's spec cannot be read.
        """

    def add_recording(self, walk: RecordedWalk, *, actor: str = LOCAL) -> str:
        """Keep a recorded walk.

        Args:
            walk: As it was recorded.
            actor: Whom the audit log is to name, if the walk is new.

        Returns:
            Its id, which depends on its content alone.
        """

    def recordings(self, ids: Sequence[str]) -> Recordings:
        """Read recorded walks.

        Args:
            ids: Of the walks.

        Returns:
            The walks by id.

        Raises:
            NotFound: There is no such recording; names the first.
            Unreadable: One was stored by another version, or damaged.
        """

    def claim(
        self,
        runner: str,
        *,
        lease_seconds: float,
        job_id: str | None = None,
        quarantine_after: int = QUARANTINE_AFTER,
    ) -> Claim | None:
        """Take the oldest job that is queued, or running/pausing with a lease that ran out.

        The claimed job is running, its token one higher than any before. A pausing job without a
        live lease becomes paused; one that cannot be read fails with the reason, and so does one
        that is quarantined. None of them is claimed, and none keeps others from being claimed.

        A claim counts as a crash if its lease ran out without release, and another runner takes the
        job over. A commit sets the count to zero, and so does the user who resumes the job.

        Args:
            runner: Name of whoever takes it.
            lease_seconds: For how long, unless the claim is renewed [s].
            job_id: The only job that is wanted; None for any.
            quarantine_after: A job with so many crashes in a row fails instead of being claimed.

        Returns:
            The claim, with all that a run needs; None if no job is to be had.
        """

    def renew(self, claim: Claim, *, lease_seconds: float, waiting: str | None = None) -> JobState:
        """Prolong a lease: the heartbeat of whoever runs the job.

        Args:
            claim: On the job.
            lease_seconds: From now on [s].
            waiting: What the job waits for, for people; None for nothing.

        Returns:
            The job's state, so that a pause is seen.

        Raises:
            LeaseLost: The claim is no longer the job's.
        """

    def record_provenance(self, claim: Claim, provenance: JobProvenance) -> None:
        """Append what the job's next iterations depend on, unless that is as before.

        Changes that its user has accepted are accepted no longer: they are recorded.

        Args:
            claim: On the job.
            provenance: What numbers of whoever holds the claim depend on.

        Raises:
            LeaseLost: The claim is no longer the job's.
        """

    def begin(self, claim: Claim, ask: Ask) -> None:
        """Store the ask that a job begins with, or goes on with after an extension.

        Repeated, it keeps the ask that is there.

        Args:
            claim: Of whoever runs the job.
            ask: What is to be evaluated next.

        Raises:
            BudgetChanged: The job has another budget than the claim's, under which the ask would
                be another; nothing is stored.
            Conflict: The ask is not of the job's next iteration.
            LeaseLost: The claim is no longer the job's.
        """

    def commit(self, claim: Claim, done: CompletedIteration, following: Ask | None) -> JobState:
        """Store a completed iteration and the next ask, in one transaction.

        Unique on (job, iteration): a commit whose answer was lost may be repeated, and changes
        nothing the second time.

        Args:
            claim: On the job.
            done: The iteration.
            following: What is to be evaluated next; None at the end of the budget.

        Returns:
            The job's state after: succeeded at the end of the budget; paused, without a lease, if
            it was to pause; else as before.

        Raises:
            BudgetChanged: The job has another budget than the claim's, under which `following`
                would be another ask; nothing is stored.
            Conflict: The iteration was not asked.
            LeaseLost: The claim is no longer the job's.
        """

    def release(self, claim: Claim, state: JobState, *, error: str | None = None) -> None:
        """Give up the lease.

        Args:
            claim: On the job.
            state: `failed`, `paused`, or `queued` to be claimed again; the latter means paused for
                a job that is pausing, so a runner that stops need not look first.
            error: Why it failed.

        Raises:
            LeaseLost: The claim is no longer the job's.
        """

    def audit(
        self, *, job_id: str | None = None, after: str | None = None, limit: int = 50
    ) -> Page[AuditEntry]:
        """Read a page of the audit log, the newest entries first.

        Every change of users is noted in the transaction that makes it; runners' are not.

        Args:
            job_id: Only what was done to this job, which may be gone.
            after: `next` of the page before.
            limit: Most entries on the page.

        Returns:
            The page.

        Raises:
            InvalidRequest: `after` is no cursor of the audit log, or `limit` is less than 1.
        """

    def ping(self) -> None:
        """Check that the database can be used.

        Raises:
            StoreUnavailable: It does not answer, or has another schema than this version's.
        """

    def verify(self) -> None:
        """Read anew what is stored, for a few seconds at most, before it is said to be safe.

        Raises:
            StoreUnavailable: It is damaged or gone, though earlier reads and writes succeeded.
        """

    def close(self) -> None:
        """Release connections. Idempotent."""
