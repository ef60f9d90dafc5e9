"""Claims, leases and fencing: how runners hold jobs and commit iterations"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime, timedelta
from typing import Any, Final

from sqlalchemy import ColumnElement, Connection, and_, delete, not_, or_, select

from gaitswarm.services.optimizer.errors import BudgetChanged, LeaseLost, NotFound, Unreadable
from gaitswarm.services.optimizer.jobs.iteration import Ask, CompletedIteration, JournalEntry
from gaitswarm.services.optimizer.jobs.job import (
    QUARANTINE_AFTER,
    Claim,
    JobState,
    Renewal,
    UnreadableSpec,
)
from gaitswarm.services.optimizer.jobs.listing import storable
from gaitswarm.services.optimizer.jobs.provenance import RECORDS, JobProvenance, with_record
from gaitswarm.services.optimizer.jobs.time_left import recent_pace
from gaitswarm.services.optimizer.store import history, job_rows
from gaitswarm.services.optimizer.store.engine import Aggregate
from gaitswarm.services.optimizer.store.recordings import load_recordings
from gaitswarm.services.optimizer.store.tables import Row, jobs, journal

_LARGEST_STEP: Final = timedelta(seconds=5)
"""By how much the clock may be set back without ending a lease."""

_log = logging.getLogger(__name__)


class Leases(Aggregate):
    """Operations of runners."""

    def claim(
        self,
        runner: str,
        *,
        lease_seconds: float,
        job_id: str | None = None,
        quarantine_after: int = QUARANTINE_AFTER,
    ) -> Claim | None:
        """Lease the oldest job of highest priority that is queued or whose lease has expired.

        A lease that was renewed in the future, as a wrong clock wrote it, has expired. The claimed
        job is running, under a token higher than any before. A pausing job without a lease becomes
        paused, an unreadable one fails, and so does one whose runners have crashed too often; none
        of them keeps others from being claimed. A lease that expires without release counts as a
        crash until the next commit or resumption. Returns None if there is no job to claim.

        job_id: the only job to claim; None for any.
        """
        claim = None
        with self._database.write("claim") as connection:
            if job_id is not None:
                job_rows.require_job(connection, job_id)
            now = self._clock(connection)
            abandoned = and_(
                jobs.c.state.in_((JobState.RUNNING, JobState.PAUSING)), not_(has_live_lease(now))
            )
            query = (
                select(*job_rows.COLUMNS)
                .where(or_(jobs.c.state == JobState.QUEUED, abandoned))
                .order_by(jobs.c.priority.desc(), jobs.c.created_at, jobs.c.id)
                .limit(1)
                # Concurrent runners skip each other's candidates, but wait for a given job.
                .with_for_update(skip_locked=job_id is None)
            )
            if job_id is not None:
                query = query.where(jobs.c.id == job_id)
            while (row := connection.execute(query).mappings().first()) is not None:
                # Again, as there may have been a wait for a lock.
                now = self._clock(connection)
                claim = _take_or_end(
                    connection, row, runner, lease_seconds, now, quarantine_after=quarantine_after
                )
                if claim is not None:
                    break
        if claim is not None:
            for observer in self._database.observers:
                observer.claimed(claim)
        return claim

    def renew(self, claim: Claim, *, lease_seconds: float, waiting: str | None = None) -> Renewal:
        """Prolong a lease; return the job's state and priority, which users may have changed."""
        with self._held("renew", claim) as (connection, row):
            now = self._clock(connection)
            changes: dict[str, Any] = _lease(now, lease_seconds)
            reason = None if waiting is None else storable(waiting)
            if reason != row["waiting"]:
                changes |= {"waiting": reason, "updated_at": now}
            job_rows.update_job(connection, row, changes)
            return Renewal(JobState(row["state"]), row["priority"])

    def record_provenance(self, claim: Claim, provenance: JobProvenance) -> None:
        """Record the provenance from the next iteration on, and clear the acceptance of changes."""
        with self._held("record_provenance", claim) as (connection, row):
            stored = job_rows.parsed(row["provenance"]) or ()
            before = RECORDS.validate_python(stored)
            added = with_record(before, row["iterations"], provenance)[len(before) :]
            # Earlier records stay as written, as digests depend on them.
            document = [*stored, *job_rows.provenance_document(added)]
            job_rows.update_job(connection, row, {"provenance": document, "accepts_changes": False})

    def begin(self, claim: Claim, ask: Ask) -> None:
        """Store the ask of a new or extended job. Idempotent. Raises BudgetChanged and Conflict."""
        with self._held("begin", claim) as (connection, row):
            if history.open_ask(connection, row) is None:
                _require_budget(claim, row)
                now = self._clock(connection)
                history.insert_ask(connection, row, ask, expected=row["iterations"], now=now)

    def journal(self, claim: Claim, entries: Sequence[JournalEntry]) -> None:
        """Store outcomes of finished tasks of the open ask; later claims bring them."""
        with self._held("journal", claim) as (connection, row):
            history.insert_entries(connection, row, entries)

    def commit(
        self,
        claim: Claim,
        done: CompletedIteration,
        following: Ask | None,
        *,
        journaled: bool = False,
    ) -> JobState:
        """Store a completed iteration and the next ask. A repeated commit changes nothing.

        Returns the job's state afterwards: succeeded at the end of the budget; paused, without a
        lease, if it was pausing; otherwise unchanged. Raises BudgetChanged if the job's budget is
        not the claim's, on which `following` depends, and Conflict if the iteration was not asked.
        """
        with self._held("commit", claim, committed=done.iteration) as (connection, row):
            if done.iteration < row["iterations"]:
                return JobState(row["state"])
            now = self._clock(connection)
            _require_budget(claim, row)
            progress = _progress(row, done) | history.complete_iteration(connection, row, done, now)
            if journaled:
                connection.execute(delete(journal).where(journal.c.job_id == row["id"]))
            if following is not None:
                history.insert_ask(connection, row, following, expected=done.iteration + 1, now=now)
            state = JobState(row["state"])
            if following is None:
                state = JobState.SUCCEEDED
            elif state is JobState.PAUSING:
                state = JobState.PAUSED
            job_rows.update_job(connection, row, job_rows.entering(state, now) | progress)
        for observer in self._database.observers:
            observer.committed(claim, done, state)
        return state

    def release(self, claim: Claim, state: JobState, *, error: str | None = None) -> None:
        """Give up a lease; the job fails by an error, or is paused, also if pausing, or queued."""
        if state not in (JobState.FAILED, JobState.PAUSED, JobState.QUEUED):
            raise ValueError(f"a runner cannot release a job as {state}")
        with self._held("release", claim) as (connection, row):
            pausing = row["state"] == JobState.PAUSING and state is JobState.QUEUED
            text = storable(error) if error is not None else row["error"]
            after = JobState.PAUSED if pausing else state
            changes = job_rows.entering(after, self._clock(connection)) | {"error": text}
            job_rows.update_job(connection, row, changes)
        for observer in self._database.observers:
            observer.released(claim, state, error)

    @contextmanager
    def _held(
        self, operation: str, claim: Claim, *, committed: int | None = None
    ) -> Iterator[tuple[Connection, Row]]:
        """Open a transaction with the locked row of a claimed job. Raises LeaseLost."""
        try:
            with self._database.write(operation) as connection:
                row = _claimed_row(connection, claim, committed)
                yield connection, row
        except LeaseLost as error:
            for observer in self._database.observers:
                observer.lost(claim, error)
            raise


def _claimed_row(connection: Connection, claim: Claim, committed: int | None) -> Row:
    try:
        row = job_rows.job_row(connection, claim.job.id, lock=True)
    except NotFound:
        lost = f"{claim.runner} has lost job {claim.job.id}: it was deleted"
        raise LeaseLost(lost) from None
    taken_over, owner = row["lease_token"] != claim.token, row["lease_owner"]
    repeated = committed is not None and committed < row["iterations"]
    if not taken_over and (repeated or owner == claim.runner):
        return row
    holder = f"held by {owner}" if owner else f"{row['state']} and not held"
    lost = f"{claim.runner} has lost job {claim.job.id}: it is {holder}"
    raise LeaseLost(lost, taken_over=taken_over)


def has_live_lease(now: datetime) -> ColumnElement[bool]:
    """Match jobs with a lease that has not expired; see `Leases.claim`. Never NULL."""
    renewed, expires = jobs.c.lease_renewed_at, jobs.c.lease_expires_at
    known = and_(renewed.is_not(None), expires.is_not(None))
    return and_(known, renewed <= now + _LARGEST_STEP, expires > now)


def _lease(now: datetime, seconds: float) -> dict[str, datetime]:
    return {"lease_renewed_at": now, "lease_expires_at": now + timedelta(seconds=seconds)}


def _take_or_end(
    connection: Connection,
    row: Row,
    runner: str,
    lease_seconds: float,
    now: datetime,
    *,
    quarantine_after: int,
) -> Claim | None:
    """Take a locked job that can be claimed, or pause or fail it."""
    if row["state"] == JobState.PAUSING:
        job_rows.update_job(connection, row, job_rows.entering(JobState.PAUSED, now))
        return None
    owner = row["lease_owner"]
    crashes = row["crashes"] + (owner is not None and owner != runner)
    if crashes >= quarantine_after:
        error = (
            f"quarantined: {crashes} runner processes in a row were killed or not heard of while"
            f" they ran its iteration {row['iterations']}, the last of them {owner}. See there"
            " what ended it, such as a lack of memory; resume the job to try again"
        )
        columns = job_rows.entering(JobState.FAILED, now) | {"error": error, "crashes": crashes}
        job_rows.update_job(connection, row, columns)
        return None
    try:
        return take_job(connection, row, runner, lease_seconds, now, crashes=crashes)
    except Unreadable as error:
        _log.warning("job %s is set aside: %s", row["id"], error)
        columns = job_rows.entering(JobState.FAILED, now) | {"error": storable(str(error))}
        job_rows.update_job(connection, row, columns)
        return None


def take_job(
    connection: Connection,
    row: Row,
    runner: str,
    lease_seconds: float,
    now: datetime,
    *,
    crashes: int = 0,
) -> Claim:
    """Lease a locked job under a higher token. Raises Unreadable, and changes nothing."""
    spec = job_rows.to_job(row).stored_spec
    if isinstance(spec, UnreadableSpec):
        raise Unreadable(spec.reason)
    try:
        walks = load_recordings(connection, spec.recording_ids)
        ask = history.open_ask(connection, row)
        answered = history.answered_ask(connection, row) if ask is None else None
        journal = () if ask is None else history.journal_of(connection, row)
    except NotFound as error:
        raise job_rows.unreadable(str(error)) from error
    except (ValueError, TypeError, LookupError, RecursionError) as error:
        raise job_rows.unreadable(
            f"its iteration {row['iterations']} cannot be read ({error})"
        ) from error
    owner, token = row["lease_owner"], row["lease_token"] + 1
    changes = job_rows.entering(JobState.RUNNING, now) | {
        "started_at": row["started_at"] or now,
        "lease_owner": runner,
        "lease_token": token,
        "crashes": crashes,
        **_lease(now, lease_seconds),
    }
    job = job_rows.to_job(job_rows.update_job(connection, row, changes))
    taken_from = None if owner == runner else owner
    return Claim(job, runner, token, ask, walks, answered, taken_from, journal)


def _require_budget(claim: Claim, row: Row) -> None:
    budget = job_rows.to_job(row).stored_spec.iterations
    if budget != claim.job.spec.iterations:
        raise BudgetChanged(f"job {row['id']} is to run {budget} iterations now")


def _progress(job: Row, done: CompletedIteration) -> dict[str, Any]:
    """Return the columns of progress, besides results, after one more iteration."""
    pace = done.evaluate_seconds / max(1, len(done.fitness))
    return {
        "crashes": 0,
        "evaluations_saved": job["evaluations_saved"] + done.saved,
        "compute_seconds": job["compute_seconds"] + done.evaluate_seconds,
        "recent_seconds": recent_pace(job["recent_seconds"], pace),
        "evaluated_on": done.evaluated_on,
    }
