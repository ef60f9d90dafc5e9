"""Notifications that wait to be sent: one attempt at a time, whoever makes it."""

from __future__ import annotations

from gaitswarm.services.optimizer.jobs.notification import Notification
from gaitswarm.services.optimizer.store.connections.engine import Clock, Database
from gaitswarm.services.optimizer.store.statements.notifications import (
    is_due,
    notifications_of,
    settle,
    take_due,
)
from gaitswarm.services.optimizer.store.statements.records import require_job


class SqlOutbox:
    """`Outbox` in a database of jobs.

    Args:
        database: Its owner's to close.
        clock: Tells the time of all that is stored.
    """

    def __init__(self, database: Database, clock: Clock) -> None:
        self._database = database
        self._clock = clock

    def take(self, *, lease_seconds: float) -> Notification | None:
        """Take the notification that has been due for longest; see `Outbox`.

        Args:
            lease_seconds: For so long it is nobody else's [s].

        Returns:
            The notification; None if none is due.
        """
        # Looking first: most of the time there is none, and a look needs no lock.
        with self._database.transaction(write=False) as connection:
            if not is_due(connection, self._clock(connection)):
                return None
        with self._database.transaction(write=True) as connection:
            return take_due(connection, self._clock(connection), lease_seconds)

    def settle(self, taken: Notification, error: str | None, *, final: bool = False) -> None:
        """Note what came of an attempt; see `Outbox`.

        Args:
            taken: As `take` gave it.
            error: Why it failed; None if it was delivered.
            final: Whether it is given up at once.
        """
        with self._database.transaction(write=True) as connection:
            settle(connection, taken, self._clock(connection), error, final=final)

    def about(self, job_id: str) -> tuple[Notification, ...]:
        """Read the notifications about a job; see `Outbox`.

        Args:
            job_id: Of the job.

        Returns:
            The oldest first.

        Raises:
            NotFound: There is no such job.
        """
        with self._database.transaction(write=False) as connection:
            require_job(connection, job_id)
            return notifications_of(connection, job_id)
