"""Who holds a job: what can be claimed, what a claim brings, and whether one is still good."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import ColumnElement, Connection, Select, and_, not_, or_, select

from gaitswarm.services.optimizer.errors import BudgetChanged, LeaseLost, NotFound, Unreadable
from gaitswarm.services.optimizer.jobs.iteration import Answered, Ask
from gaitswarm.services.optimizer.jobs.job import (
    LONGEST_LEASE_SECONDS,
    Claim,
    JobState,
    UnreadableSpec,
)
from gaitswarm.services.optimizer.store.rows.evaluation_rows import Row
from gaitswarm.services.optimizer.store.rows.job_rows import (
    budget,
    kept,
    storable,
    to_job,
)
from gaitswarm.services.optimizer.store.rows.tables import jobs
from gaitswarm.services.optimizer.store.statements.recordings import load_recordings
from gaitswarm.services.optimizer.store.statements.records import (
    answered_ask,
    entering,
    job_row,
    outstanding_ask,
    update_job,
)
from gaitswarm.sim.identification.recorded_walk import Recordings


def claimable(now: datetime, job_id: str | None) -> Select[*tuple[Any, ...]]:
    """Select the next job that waits for a runner, or whose runner has gone, and lock it.

    The one of highest priority is next, the oldest among equals.

    Runners that look at the same time pass over each other's candidates; only a runner that wants
    one certain job waits for it.

    Args:
        now: The time by which leases are judged.
        job_id: The only job that is wanted; None for any.

    Returns:
        A query for at most one row of `jobs`.
    """
    query = (
        select(jobs)
        .where(or_(jobs.c.state == JobState.QUEUED, _abandoned(now)))
        .order_by(jobs.c.priority.desc(), jobs.c.created_at, jobs.c.id)
        .limit(1)
    )
    if job_id is None:
        return query.with_for_update(skip_locked=True)
    return query.where(jobs.c.id == job_id).with_for_update()


def _abandoned(now: datetime) -> ColumnElement[bool]:
    return and_(
        jobs.c.state.in_((JobState.RUNNING, JobState.PAUSING)),
        not_(lease_is_alive(now)),
    )


def lease_is_alive(now: datetime) -> ColumnElement[bool]:
    """Match jobs that a runner holds, by a lease that has not run out.

    A lease that ends further ahead than any lease lasts was written by a clock that was ahead, and
    would otherwise outlive its runner by as much.

    Args:
        now: The time by which leases are judged.

    Returns:
        A condition on `jobs`, never NULL.
    """
    expires = jobs.c.lease_expires_at
    latest = now + timedelta(seconds=LONGEST_LEASE_SECONDS)
    return and_(expires.is_not(None), expires > now, expires <= latest)


def has_live_lease(connection: Connection, job_id: str, now: datetime) -> bool:
    """Tell whether a runner holds a job.

    Args:
        connection: An open transaction.
        job_id: Of the job.
        now: The time by which its lease is judged.

    Returns:
        False for a job that any runner may claim.
    """
    query = select(jobs.c.id).where(jobs.c.id == job_id, lease_is_alive(now))
    return connection.execute(query).first() is not None


def crashes_before(row: Row, runner: str) -> int:
    """Runner processes in a row that went down with a job without committing an iteration.

    A lease that ran out counts as one, unless its owner is the one who asks, and so lives.

    Args:
        row: The job's row, as it is found by whoever may claim it.
        runner: Who asks.

    Returns:
        Their number.
    """
    owner = row["lease_owner"]
    return (row["crashes"] or 0) + (owner is not None and owner != runner)


def quarantine(connection: Connection, row: Row, crashes: int, now: datetime) -> None:
    """Let a locked job fail with which runner after runner went down.

    Args:
        connection: The transaction in which the job was locked.
        row: The job's row.
        crashes: How many went down.
        now: The time at which it fails.
    """
    error = (
        f"quarantined: {crashes} runner processes in a row were killed or not heard of while they"
        f" ran its iteration {row['iterations']}, the last of them {row['lease_owner']}. See there"
        " what ended it, such as a lack of memory; resume the job to try again"
    )
    columns = entering(JobState.FAILED, now) | {"error": error, "crashes": crashes}
    update_job(connection, row, columns)


def take_job(
    connection: Connection,
    row: Row,
    runner: str,
    lease_seconds: float,
    now: datetime,
    *,
    crashes: int = 0,
) -> Claim:
    """Make a locked job, which nobody else holds, the runner's: it runs, under a higher token.

    Args:
        connection: The transaction in which the job was locked.
        row: The job's row.
        runner: Who takes it.
        lease_seconds: For how long, unless the claim is renewed [s].
        now: The time at which it is taken.
        crashes: As `crashes_before` counts them.

    Returns:
        The claim.

    Raises:
        Unreadable: Something that a run needs cannot be read; nothing is changed.
    """
    work = _work(connection, row)
    token = row["lease_token"] + 1
    changes = entering(JobState.RUNNING, now) | {
        "started_at": row["started_at"] or now,
        "lease_owner": runner,
        "lease_token": token,
        "lease_expires_at": now + timedelta(seconds=lease_seconds),
        "crashes": crashes or None,
    }
    job = to_job(update_job(connection, row, changes))
    owner = row["lease_owner"]
    taken_from = None if owner == runner else owner
    return Claim(job, runner, token, work.ask, work.recordings, work.answered, taken_from)


@dataclass(frozen=True, slots=True)
class _Work:
    """What a claim brings beside the job; see `Claim`."""

    ask: Ask | None
    recordings: Recordings
    answered: Answered | None


def _work(connection: Connection, job: Row) -> _Work:
    """All that a run needs beside the job. Raises Unreadable."""
    spec = to_job(job).stored_spec
    if isinstance(spec, UnreadableSpec):
        raise Unreadable(spec.reason)
    try:
        walks = load_recordings(connection, spec.recording_ids)
        ask = outstanding_ask(connection, job)
        answered = answered_ask(connection, job) if ask is None else None
    except NotFound as error:
        raise kept(str(error)) from error
    except (ValueError, TypeError, LookupError) as error:
        raise kept(f"its iteration {job['iterations']} cannot be read ({error})") from error
    return _Work(ask, walks, answered)


def set_aside(connection: Connection, row: Row, reason: Unreadable, now: datetime) -> None:
    """Let a locked job fail that cannot be read, and touch nothing else of it.

    Args:
        connection: The transaction in which the job was locked.
        row: The job's row.
        reason: What cannot be read; becomes the job's error.
        now: The time at which it fails.
    """
    error = {"error": storable(str(reason))}
    update_job(connection, row, entering(JobState.FAILED, now) | error)


def claimed_row(connection: Connection, claim: Claim) -> Row:
    """Lock the row of a job that was claimed, whoever has it now.

    Args:
        connection: An open transaction that may write.
        claim: On the job.

    Returns:
        The job's row.

    Raises:
        LeaseLost: The job was deleted.
    """
    try:
        return job_row(connection, claim.job.id, lock=True)
    except NotFound as error:
        raise LeaseLost(f"{claim.runner} has lost job {claim.job.id}: it was deleted") from error


def held(connection: Connection, claim: Claim) -> Row:
    """Lock the row of a claimed job.

    A lease that ran out but that nobody has taken is still the claim's: the token decides.

    Args:
        connection: An open transaction that may write.
        claim: On the job.

    Returns:
        The job's row.

    Raises:
        LeaseLost: The claim is no longer the job's.
    """
    row = claimed_row(connection, claim)
    if row["lease_token"] == claim.token and row["lease_owner"] == claim.runner:
        return row
    owner = row["lease_owner"]
    now = f"held by {owner}" if owner is not None else f"{row['state']} and held by nobody"
    raise LeaseLost(
        f"{claim.runner} has lost job {claim.job.id}: it is {now}",
        taken_over=row["lease_token"] != claim.token,
    )


def require_budget_of(claim: Claim, row: Row) -> None:
    """Refuse an ask that was made under another budget than the job has now.

    Args:
        claim: On the job, with the job as whoever asks knows it.
        row: The job's row.

    Raises:
        BudgetChanged: The job was extended since.
    """
    if budget(row) != claim.job.spec.iterations:
        raise BudgetChanged(f"job {row['id']} is to run {budget(row)} iterations now")
