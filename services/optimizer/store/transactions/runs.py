"""How runners run jobs in SQL: claims and leases, asks and commits, each in one transaction."""

from __future__ import annotations

import logging
from datetime import timedelta
from typing import Any

from gaitswarm.services.optimizer.errors import Unreadable
from gaitswarm.services.optimizer.jobs.iteration import Ask, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import (
    QUARANTINE_AFTER,
    Claim,
    JobState,
    Renewal,
)
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance
from gaitswarm.services.optimizer.store.connections.engine import (
    Clock,
    Database,
)
from gaitswarm.services.optimizer.store.rows.job_rows import storable
from gaitswarm.services.optimizer.store.statements.claims import (
    claimable,
    claimed_row,
    crashes_before,
    held,
    quarantine,
    require_budget_of,
    set_aside,
    take_job,
)
from gaitswarm.services.optimizer.store.statements.records import (
    complete_iteration,
    entering,
    insert_ask,
    outstanding_ask,
    progress_after,
    provenance_columns,
    require_job,
    state_after_commit,
    state_after_release,
    update_job,
)

_log = logging.getLogger(__name__)


class SqlRuns:
    """Those methods of `Store` by which runners run jobs.

    Args:
        database: With the newest schema.
        clock: Tells the time of all that is stored, leases included.
    """

    def __init__(self, database: Database, clock: Clock) -> None:
        self._database = database
        self._clock = clock

    def claim(
        self,
        runner: str,
        *,
        lease_seconds: float,
        job_id: str | None = None,
        quarantine_after: int = QUARANTINE_AFTER,
    ) -> Claim | None:
        """Take a job that waits for a runner, for as long as the lease lasts."""
        with self._database.transaction(write=True) as connection:
            if job_id is not None:
                require_job(connection, job_id)
            query = claimable(self._clock(connection), job_id)
            while (row := connection.execute(query).mappings().first()) is not None:
                # Once more: a certain job may have been waited for.
                now = self._clock(connection)
                if row["state"] == JobState.PAUSING:
                    update_job(connection, row, entering(JobState.PAUSED, now))
                    continue
                crashes = crashes_before(row, runner)
                if crashes >= quarantine_after:
                    quarantine(connection, row, crashes, now)
                    continue
                try:
                    return take_job(connection, row, runner, lease_seconds, now, crashes=crashes)
                except Unreadable as error:
                    # The next job must not wait for somebody to mend this one.
                    _log.warning("job %s is set aside: %s", row["id"], error)
                    set_aside(connection, row, error, now)
        return None

    def renew(self, claim: Claim, *, lease_seconds: float, waiting: str | None = None) -> Renewal:
        """Prolong a lease."""
        with self._database.transaction(write=True) as connection:
            row = held(connection, claim)
            expires = self._clock(connection) + timedelta(seconds=lease_seconds)
            changes: dict[str, Any] = {"lease_expires_at": expires}
            reason = None if waiting is None else storable(waiting)
            if reason != row["waiting"]:
                changes |= {"waiting": reason}
            update_job(connection, row, changes)
            return Renewal(JobState(row["state"]), row["priority"])

    def record_provenance(self, claim: Claim, provenance: JobProvenance) -> None:
        """Record what the numbers depend on from the next iteration on."""
        with self._database.transaction(write=True) as connection:
            row = held(connection, claim)
            update_job(connection, row, provenance_columns(row, provenance))

    def begin(self, claim: Claim, ask: Ask) -> None:
        """Store an ask where there is none."""
        with self._database.transaction(write=True) as connection:
            row = held(connection, claim)
            if outstanding_ask(connection, row) is None:
                require_budget_of(claim, row)
                now = self._clock(connection)
                insert_ask(connection, row, ask, expected=row["iterations"], now=now)

    def commit(self, claim: Claim, done: CompletedIteration, following: Ask | None) -> JobState:
        """Store an iteration, the ask that follows, and what becomes of the job."""
        with self._database.transaction(write=True) as connection:
            row = claimed_row(connection, claim)
            # The token outlives the lease, which a commit that ends or pauses the job gives up.
            if row["lease_token"] == claim.token and done.iteration < row["iterations"]:
                return JobState(row["state"])
            row = held(connection, claim)
            now = self._clock(connection)
            require_budget_of(claim, row)
            head = complete_iteration(connection, row, done, now)
            if following is not None:
                insert_ask(connection, row, following, expected=done.iteration + 1, now=now)
            state = state_after_commit(JobState(row["state"]), following)
            progress = progress_after(row, done) | {"head": head}
            update_job(connection, row, entering(state, now) | progress)
            return state

    def release(self, claim: Claim, state: JobState, *, error: str | None = None) -> None:
        """Give a job back, or let it fail."""
        if state not in (JobState.FAILED, JobState.PAUSED, JobState.QUEUED):
            raise ValueError(f"a runner cannot release a job as {state}")
        with self._database.transaction(write=True) as connection:
            row = held(connection, claim)
            after = state_after_release(JobState(row["state"]), state)
            text = storable(error) if error is not None else row["error"]
            changes = entering(after, self._clock(connection)) | {"error": text}
            update_job(connection, row, changes)
