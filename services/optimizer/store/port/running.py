"""What runners ask of the memory: claims and leases, asks and commits."""

from __future__ import annotations

from typing import Protocol

from gaitswarm.services.optimizer.jobs.iteration import Ask, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import QUARANTINE_AFTER, Claim, JobState, Renewal
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance


class Runs(Protocol):
    """How jobs are run. Thread-safe, as all of `Store` is.

    Methods that take a claim raise LeaseLost, and change nothing, if the claim's token is no longer
    the job's.
    """

    def claim(
        self,
        runner: str,
        *,
        lease_seconds: float,
        job_id: str | None = None,
        quarantine_after: int = QUARANTINE_AFTER,
    ) -> Claim | None:
        """Take a job that is queued, or running/pausing with a lease that ran out.

        Of these, one of the highest priority that there is, the oldest of them.

        A lease that ends more than `LONGEST_LEASE_SECONDS` from now, as a clock that was ahead has
        written it, counts as one that ran out.

        The claimed job is running, its token one higher than any before. A pausing job without a
        live lease becomes paused; one that cannot be read fails with the reason, and so does one
        that is quarantined. None of them is claimed, and none keeps others from being claimed.

        A claim counts as a crash if its lease ran out without release, and another runner takes the
        job over. A commit sets the count to zero, and so does the user who resumes the job.

        Args:
            runner: Name of whoever takes it.
            lease_seconds: For how long, unless the claim is renewed; at most
                `LONGEST_LEASE_SECONDS` [s].
            job_id: The only job that is wanted; None for any.
            quarantine_after: A job with so many crashes in a row fails instead of being claimed.

        Returns:
            The claim, with all that a run needs; None if no job is to be had.
        """

    def renew(self, claim: Claim, *, lease_seconds: float, waiting: str | None = None) -> Renewal:
        """Prolong a lease: the heartbeat of whoever runs the job.

        Args:
            claim: On the job.
            lease_seconds: From now on [s].
            waiting: What the job waits for, for people; None for nothing.

        Returns:
            The job's state and priority, so that changes of users are seen.

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
