"""Notifications about ended jobs, until they are delivered"""

from __future__ import annotations

from datetime import timedelta

from sqlalchemy import or_, select, update

from gaitswarm.services.optimizer.jobs.notification import LONGEST_PAUSE, Notification, pause_after
from gaitswarm.services.optimizer.store.engine import Aggregate
from gaitswarm.services.optimizer.store.job_rows import require_job
from gaitswarm.services.optimizer.store.tables import Row, notifications


class Outbox(Aggregate):
    """Notifications; the transaction that ends a job with a URL adds one."""

    def take(self, *, lease_seconds: float) -> Notification | None:
        """Lease the notification that has been due for longest, for one attempt; None if none is.

        lease_seconds: time after which it is due again [s].
        """
        due = notifications.c.next_attempt_at
        longest = timedelta(seconds=max(LONGEST_PAUSE, lease_seconds))
        # Mostly none is due, and looking needs no lock.
        with self._database.read("notification_take") as connection:
            now = self._clock(connection)
            # A later time was written by a wrong clock.
            is_due = or_(due <= now, due > now + longest)
            if connection.execute(select(due).where(is_due).limit(1)).first() is None:
                return None
        with self._database.write("notification_take") as connection:
            now = self._clock(connection)
            is_due = or_(due <= now, due > now + longest)
            query = select(notifications).where(is_due).order_by(due).limit(1)
            locked = query.with_for_update(skip_locked=True)
            row = connection.execute(locked).mappings().first()
            if row is None:
                return None
            leased = update(notifications).where(notifications.c.id == row["id"])
            until = now + timedelta(seconds=lease_seconds)
            connection.execute(leased.values(next_attempt_at=until))
            return _notification(row)

    def settle(self, taken: Notification, error: str | None, *, final: bool = False) -> None:
        """Record the result of an attempt: delivered without an error, due later, or given up."""
        attempts = taken.attempts + 1
        pause = None if final or error is None else pause_after(attempts)
        with self._database.write("notification_settle") as connection:
            now = self._clock(connection)
            connection.execute(
                update(notifications)
                .where(notifications.c.id == taken.id)
                .values(
                    attempts=attempts,
                    error=error,
                    delivered_at=now if error is None else None,
                    next_attempt_at=None if pause is None else now + timedelta(seconds=pause),
                )
            )

    def about(self, job_id: str) -> tuple[Notification, ...]:
        """Return the notifications about a job, oldest first."""
        order = (notifications.c.created_at, notifications.c.id)
        query = select(notifications).where(notifications.c.job_id == job_id).order_by(*order)
        with self._database.read("notification_about") as connection:
            require_job(connection, job_id)
            return tuple(map(_notification, connection.execute(query).mappings()))


def _notification(row: Row) -> Notification:
    return Notification(**{column.name: row[column.name] for column in notifications.c})
