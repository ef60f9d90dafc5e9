"""The port of the memory: jobs, iterations, evaluations."""

from __future__ import annotations

from typing import Any, Protocol

from gaitswarm.services.optimizer.access import Tokens
from gaitswarm.services.optimizer.jobs.audit import LOCAL, AuditEntry
from gaitswarm.services.optimizer.jobs.fork import Fork
from gaitswarm.services.optimizer.jobs.job import (
    Claim,
    Command,
    Job,
    JobOrder,
    JobState,
)
from gaitswarm.services.optimizer.jobs.labels import ANY_JOB, JobFilter
from gaitswarm.services.optimizer.jobs.notification import Outbox
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance
from gaitswarm.services.optimizer.jobs.quota import Quota
from gaitswarm.services.optimizer.jobs.reference import Reference
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.store.port.deletions import Deletions
from gaitswarm.services.optimizer.store.port.labelling import Labelling
from gaitswarm.services.optimizer.store.port.reading import (
    Changes,
    CommittedHistory,
    Page,
    Queue,
)
from gaitswarm.services.optimizer.store.port.recordings import KeptRecordings
from gaitswarm.services.optimizer.store.port.running import Runs


class Store(CommittedHistory, Deletions, KeptRecordings, Labelling, Runs, Protocol):
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
        priority: int = 0,
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
            priority: Within bounds; the higher, the sooner it is claimed.

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
        where: JobFilter = ANY_JOB,
        order: JobOrder = JobOrder.CREATED,
        after: str | None = None,
        limit: int = 50,
        reverse: bool = False,
    ) -> Page[Job]:
        """Read a page of jobs.

        Args:
            state: Only jobs in this state.
            kind: Only jobs whose specs say that they are of this kind.
            parent: Only jobs that were forked from the job of this id.
            search: Only jobs whose name, id, note or tags contain this, whatever its case.
            where: Only jobs that this admits.
            order: By what they are sorted.
            after: `next` of the page before.
            limit: Most jobs on the page.
            reverse: Whether the order is reversed; jobs without what they are sorted by stay last.

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

        A job under way without a live lease is paused at once, and queued when it is resumed.

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

    def prioritize(self, job_id: str, priority: int, *, actor: str = LOCAL) -> Job:
        """Change the priority of a job that has not ended.

        Whoever runs it hears of it at the next renewal of its claim.

        Args:
            job_id: Of the job.
            priority: Within bounds; the higher, the sooner it is claimed.
            actor: Whom the audit log is to name.

        Returns:
            The job as it is then.

        Raises:
            Conflict: The job has ended.
        """

    def note_reference(self, job_id: str, reference: Reference) -> None:
        """Note what a job's best is measured against, unless that is known; nothing depends on it.

        Args:
            job_id: Of the job; one that is gone is let be.
            reference: The published or the start design in the job's cases.
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
