"""Who holds a job: claims, fencing tokens, and leases that run out."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, Connection, Select, and_, or_, select

from services.optimizer.errors import LeaseLost
from services.optimizer.job import Claim, JobState
from services.optimizer.store.records import job_row
from services.optimizer.store.rows import Row
from services.optimizer.store.tables import jobs


def held(connection: Connection, claim: Claim) -> Row:
    """The locked row of a claimed job; LeaseLost unless the claim is still the job's.

    A lease that ran out but that nobody has taken is still the claim's: the token decides.
    """
    row = job_row(connection, claim.job.id, lock=True)
    if row["lease_token"] == claim.token and row["lease_owner"] == claim.runner:
        return row
    owner = row["lease_owner"]
    now = f"held by {owner}" if owner is not None else f"{row['state']} and held by nobody"
    raise LeaseLost(f"{claim.runner} has lost job {claim.job.id}: it is {now}")


def lease_is_live(row: Row, now: datetime) -> bool:
    """Whether a runner has the job and has been heard of lately."""
    expires = row["lease_expires_at"]
    return expires is not None and expires > now


def claimable(now: datetime, job_id: str | None) -> Select[*tuple[Any, ...]]:
    """The oldest job waiting for a runner, or whose runner has gone; locked when it is selected.

    Runners that look at the same time pass over each other's candidates; only a runner that wants
    one certain job waits for it.
    """
    query = (
        select(jobs)
        .where(or_(jobs.c.state == JobState.QUEUED, _abandoned(now)))
        .order_by(jobs.c.created_at, jobs.c.id)
        .limit(1)
    )
    if job_id is None:
        return query.with_for_update(skip_locked=True)
    return query.where(jobs.c.id == job_id).with_for_update()


def _abandoned(now: datetime) -> ColumnElement[bool]:
    return and_(
        jobs.c.state.in_((JobState.RUNNING, JobState.PAUSING)),
        or_(jobs.c.lease_expires_at.is_(None), jobs.c.lease_expires_at <= now),
    )
