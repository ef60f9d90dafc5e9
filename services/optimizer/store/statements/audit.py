"""Statements on the audit log, inside a transaction that someone else began."""

from __future__ import annotations

from datetime import datetime
from itertools import takewhile
from typing import Any

from sqlalchemy import Connection, delete, insert, select

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.audit import LOCAL, AuditAction, AuditEntry
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.store.port.reading import Page
from gaitswarm.services.optimizer.store.rows.evaluation_rows import Row
from gaitswarm.services.optimizer.store.rows.tables import audit

_LARGEST_INDEX = 2**63 - 1


def note_change(
    connection: Connection,
    now: datetime,
    actor: str,
    action: AuditAction,
    job_id: str | None = None,
    **details: Any,
) -> None:
    """Add an entry, which is stored if the change is.

    Args:
        connection: The transaction that makes the change.
        now: The time of the change.
        actor: Name of the token that asked for it, or `LOCAL`.
        action: What was done.
        job_id: To which job, if to one.
        **details: What else tells the change from others like it; JSON, and no secrets.
    """
    connection.execute(
        insert(audit).values(at=now, actor=actor, action=action, job_id=job_id, details=details)
    )


def note_submission(connection: Connection, now: datetime, job: Job) -> None:
    """Add the entry of a new job.

    Args:
        connection: The transaction that makes the job.
        now: The time of its submission.
        job: With its owner, and where it comes from.
    """
    actor = job.owner or LOCAL
    if job.lineage is None:
        note_change(connection, now, actor, AuditAction.SUBMIT, job.id)
        return
    parent, at = job.lineage.parent, job.lineage.from_iteration
    note_change(connection, now, actor, AuditAction.FORK, job.id, parent=parent, from_iteration=at)


def audit_page(
    connection: Connection, job_id: str | None, after: str | None, limit: int
) -> Page[AuditEntry]:
    """Read entries, the newest first.

    Args:
        connection: An open transaction.
        job_id: Only entries about this job; None for all.
        after: `next` of the page before.
        limit: Most entries on the page.

    Returns:
        The page.

    Raises:
        InvalidRequest: `after` is no cursor of the audit log.
    """
    query = select(audit).order_by(audit.c.id.desc()).limit(limit + 1)
    if job_id is not None:
        query = query.where(audit.c.job_id == job_id)
    if after is not None:
        query = query.where(audit.c.id < _from_cursor(after))
    rows = connection.execute(query).mappings().all()
    found = tuple(map(_entry, rows[:limit]))
    return Page(found, str(found[-1].index) if len(rows) > limit else None)


def remove_oldest(connection: Connection, moment: datetime, most: int) -> int:
    """Remove the first entries, up to the first that is young enough.

    Args:
        connection: An open transaction that may write.
        moment: Entries from before are old.
        most: Entries removed.

    Returns:
        How many are gone.
    """
    query = select(audit.c.id, audit.c.at).order_by(audit.c.id).limit(most)
    old = takewhile(lambda row: row.at < moment, connection.execute(query))
    ids = [row.id for row in old]
    if ids:
        connection.execute(delete(audit).where(audit.c.id <= ids[-1]))
    return len(ids)


def _from_cursor(text: str) -> int:
    if text.isascii() and text.isdecimal() and len(text) < 20 and int(text) <= _LARGEST_INDEX:
        return int(text)
    raise InvalidRequest(
        "not a cursor of the audit log; pass the `next` of the page before", field="after"
    )


def _entry(row: Row) -> AuditEntry:
    return AuditEntry(
        row["id"],
        row["at"],
        row["actor"],
        AuditAction(row["action"]),
        row["job_id"],
        row["details"],
    )
