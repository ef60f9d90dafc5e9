"""Notifications in SQL: written with the end of their job, sent until they are delivered."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import Connection, insert, select, update

from gaitswarm.services.optimizer.jobs.notification import Notification, pause_after
from gaitswarm.services.optimizer.store.rows.evaluation_rows import Row
from gaitswarm.services.optimizer.store.rows.tables import notifications

_BYTES = 12


def note_end(connection: Connection, job: Mapping[str, Any]) -> None:
    """Leave a notification, which is stored if the end of the job is.

    Args:
        connection: The transaction in which the job ends.
        job: Its row, as it is then; it names the URL.
    """
    spec = job["spec"]
    at: datetime = job["finished_at"]
    document = {
        "type": f"job.{job['state']}",
        "timestamp": at.isoformat(),
        "data": {
            "id": job["id"],
            "name": spec.get("name", "") if isinstance(spec, dict) else "",
            "state": str(job["state"]),
            "iterations": job["iterations"],
            "evaluations": job["evaluations"],
            "best_fitness": job["best_fitness"],
            "error": job["error"],
        },
    }
    connection.execute(
        insert(notifications).values(
            id=f"msg_{secrets.token_hex(_BYTES)}",
            job_id=job["id"],
            url=job["notify_url"],
            document=document,
            created_at=at,
            attempts=0,
            next_attempt_at=at,
        )
    )


def is_due(connection: Connection, now: datetime) -> bool:
    """Whether some notification is to be sent.

    Args:
        connection: An open transaction.
        now: The time by which it is due.
    """
    query = select(notifications.c.id).where(notifications.c.next_attempt_at <= now).limit(1)
    return connection.execute(query).first() is not None


def take_due(connection: Connection, now: datetime, lease_seconds: float) -> Notification | None:
    """Take the notification that has been due for longest, for one attempt.

    It is nobody else's for a while; if whoever took it goes down, it is due again after that.

    Args:
        connection: An open transaction that may write.
        now: The time by which it is due.
        lease_seconds: How long the attempt may take [s].

    Returns:
        The notification; None if none is due.
    """
    query = (
        select(notifications)
        .where(notifications.c.next_attempt_at <= now)
        .order_by(notifications.c.next_attempt_at)
        .limit(1)
        .with_for_update(skip_locked=True)
    )
    row = connection.execute(query).mappings().first()
    if row is None:
        return None
    until = now + timedelta(seconds=lease_seconds)
    _change(connection, row["id"], next_attempt_at=until)
    return _notification(row)


def settle(
    connection: Connection, taken: Notification, now: datetime, error: str | None, *, final: bool
) -> None:
    """Note what came of an attempt.

    Args:
        connection: An open transaction that may write.
        taken: The notification as it was taken.
        now: The time of the attempt.
        error: Why it failed; None if it was delivered.
        final: Whether it is given up at once.
    """
    attempts = taken.attempts + 1
    pause = None if final or error is None else pause_after(attempts)
    _change(
        connection,
        taken.id,
        attempts=attempts,
        error=error,
        delivered_at=now if error is None else None,
        next_attempt_at=None if pause is None else now + timedelta(seconds=pause),
    )


def notifications_of(connection: Connection, job_id: str) -> tuple[Notification, ...]:
    """Read the notifications about a job.

    Args:
        connection: An open transaction.
        job_id: Of the job.

    Returns:
        The oldest first.
    """
    query = (
        select(notifications)
        .where(notifications.c.job_id == job_id)
        .order_by(notifications.c.created_at, notifications.c.id)
    )
    return tuple(map(_notification, connection.execute(query).mappings()))


def _change(connection: Connection, name: str, **columns: Any) -> None:
    connection.execute(update(notifications).where(notifications.c.id == name).values(**columns))


def _notification(row: Row) -> Notification:
    return Notification(**{column.name: row[column.name] for column in notifications.c})
