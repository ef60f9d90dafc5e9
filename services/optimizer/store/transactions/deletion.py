"""Jobs that are deleted: gone for everybody in one transaction, their rows removed by pieces.

A write transaction of SQLite keeps all other writers waiting, and the rows of a long job take many
seconds to remove. So a job is marked first, which hides it at once; its rows go afterwards, in
pieces that take a fraction of a second each.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from datetime import datetime
from typing import Final

from sqlalchemy import Connection, Table, delete, exists, func, select, update

from gaitswarm.services.optimizer.errors import Conflict
from gaitswarm.services.optimizer.jobs.audit import LOCAL, RETENTION, AuditAction
from gaitswarm.services.optimizer.jobs.job import DELETABLE, ENDED, Job, JobState
from gaitswarm.services.optimizer.store.connections.changes import announce
from gaitswarm.services.optimizer.store.connections.engine import Clock, Database
from gaitswarm.services.optimizer.store.rows.evaluation_rows import Row
from gaitswarm.services.optimizer.store.rows.job_rows import to_job
from gaitswarm.services.optimizer.store.rows.tables import (
    EXISTING,
    evaluations,
    jobs,
    metadata,
    notifications,
)
from gaitswarm.services.optimizer.store.statements.audit import note_change, remove_oldest
from gaitswarm.services.optimizer.store.statements.records import job_row, update_job

_PIECE: Final = 5000
"""Evaluations, or entries of the audit log, removed in one transaction."""

_JOBS: Final = 500
"""Jobs deleted in one transaction."""

_DELETED: Final = select(jobs.c.id).where(jobs.c.deleted_at.is_not(None)).limit(1)

_OF_JOBS: Final[tuple[Table, ...]] = tuple(
    table
    for table in reversed(metadata.sorted_tables)
    if "job_id" in table.c and (table.foreign_keys or table is notifications)
)
"""Tables whose rows go with their job, those that refer to others first. Not the audit log's."""


class SqlDeletion:
    """Those methods of `Store` that delete jobs, or protect them from that.

    Args:
        database: With the newest schema.
        clock: Tells the time of all that is stored.
    """

    def __init__(self, database: Database, clock: Clock) -> None:
        self._database = database
        self._clock = clock

    def keep(self, job_id: str, kept: bool, *, actor: str = LOCAL) -> Job:
        """Protect a job from deletion, or release it."""
        with self._database.transaction(write=True) as connection:
            row = job_row(connection, job_id, lock=True)
            action = AuditAction.KEEP if kept else AuditAction.RELEASE
            note_change(connection, self._clock(connection), actor, action, job_id)
            return to_job(update_job(connection, row, {"kept": kept}))

    def delete_job(self, job_id: str, *, actor: str = LOCAL) -> None:
        """Mark a job, and remove its rows at once if they are few."""
        with self._database.transaction(write=True) as connection:
            row = job_row(connection, job_id, lock=True)
            _require_deletable(row)
            now = self._clock(connection)
            _mark_deleted(connection, [job_id], now)
            note_change(connection, now, actor, AuditAction.DELETE, job_id)
            if row["evaluations"] <= _PIECE:
                _remove_piece(connection, job_id=job_id)

    def delete_ended_before(
        self, moment: datetime, states: Collection[JobState] = ENDED
    ) -> tuple[str, ...]:
        """Mark jobs that ended long ago."""
        deleted: list[str] = []
        while True:
            with self._database.transaction(write=True) as connection:
                found = _ended_before(connection, moment, states)
                now = self._clock(connection)
                _mark_deleted(connection, found, now)
                for job_id in found:
                    note_change(connection, now, RETENTION, AuditAction.DELETE, job_id)
            deleted += found
            if len(found) < _JOBS:
                return tuple(deleted)

    def forget_audit_before(self, moment: datetime) -> int:
        """Remove entries by pieces, as a log of years has many."""
        removed = 0
        while True:
            with self._database.transaction(write=True) as connection:
                piece = remove_oldest(connection, moment, _PIECE)
            removed += piece
            if piece < _PIECE:
                return removed

    def purge_deleted(self, should_stop: Callable[[], bool] = lambda: False) -> None:
        """Remove rows of deleted jobs, and leave half of the time to other writers."""
        with self._database.transaction(write=False) as connection:
            more = connection.execute(_DELETED).first() is not None
        while more and not should_stop():
            begun = time.monotonic()
            with self._database.transaction(write=True) as connection:
                more = _remove_piece(connection)
            if more:
                time.sleep(time.monotonic() - begun)


def _require_deletable(row: Row) -> None:
    """Refuse to delete a job that is under way or kept.

    Args:
        row: The job's row.

    Raises:
        Conflict: It is; says what to do first.
    """
    state, job_id = JobState(row["state"]), row["id"]
    if state not in DELETABLE:
        raise Conflict(
            f"cannot delete a job that is {state}; cancel it first: `gaitswarm cancel {job_id}`, or"
            f" POST /v1/jobs/{job_id}/cancel"
        )
    if row["kept"]:
        raise Conflict(
            f"cannot delete a job that is kept; release it first: `gaitswarm keep --release"
            f" {job_id}`, or DELETE /v1/jobs/{job_id}/keep"
        )


def _mark_deleted(connection: Connection, ids: Collection[str], now: datetime) -> None:
    """Hide jobs from their users, and free their idempotency keys.

    Args:
        connection: The transaction in which the jobs were locked.
        ids: Of the jobs.
        now: The time at which they are deleted.
    """
    gone = {"deleted_at": now, "idempotency_key": None, "request_digest": None}
    connection.execute(update(jobs).where(jobs.c.id.in_(ids)).values(**gone))
    for job_id in ids:
        announce(connection, job_id, frozenset({"state"}))


def _ended_before(
    connection: Connection, moment: datetime, states: Collection[JobState]
) -> list[str]:
    """Find jobs that ended long ago and that nobody needs, and lock them.

    Args:
        connection: An open transaction that may write.
        moment: Only jobs that ended before.
        states: Only jobs that ended in one of these.

    Returns:
        Ids of the jobs: neither kept, nor parents of forks that have not ended.
    """
    fork = jobs.alias("fork")
    has_unfinished_fork = exists().where(
        fork.c.parent_id == jobs.c.id,
        fork.c.state.not_in(ENDED),
        fork.c.deleted_at.is_(None),
    )
    query = select(jobs.c.id).where(
        jobs.c.state.in_(ENDED.intersection(states)),
        jobs.c.finished_at < moment,
        func.coalesce(jobs.c.kept, False).is_(False),
        EXISTING,
        ~has_unfinished_fork,
    )
    return list(connection.execute(query.limit(_JOBS).with_for_update()).scalars())


def _remove_piece(connection: Connection, *, job_id: str | None = None) -> bool:
    """Remove some rows of a deleted job, and with the last of them the job's own.

    Args:
        connection: An open transaction that may write.
        job_id: Of the job; None for any that nobody else is removing.

    Returns:
        Whether there may be more to remove.
    """
    query = _DELETED if job_id is None else _DELETED.where(jobs.c.id == job_id)
    found = connection.execute(query.with_for_update(skip_locked=True)).scalar()
    if found is None:
        return False
    end = _end_of_piece(connection, found)
    for table in _OF_JOBS:
        rows = delete(table).where(table.c.job_id == found)
        if end is not None and "iteration" in table.c:
            rows = rows.where(table.c.iteration < end)
        if end is None or "iteration" in table.c:
            connection.execute(rows)
    if end is None:
        connection.execute(delete(jobs).where(jobs.c.id == found))
    return True


def _end_of_piece(connection: Connection, job_id: str) -> int | None:
    """Index after the last iteration of a piece, of one at least; None if the piece is the rest."""
    table = evaluations.c
    own = (
        select(table.iteration)
        .where(table.job_id == job_id)
        .order_by(table.iteration, table.particle)
    )
    end = connection.execute(own.offset(_PIECE).limit(1)).scalar()
    if end is None:
        return None
    first = connection.execute(own.limit(1)).scalar_one()
    return max(int(end), int(first) + 1)
