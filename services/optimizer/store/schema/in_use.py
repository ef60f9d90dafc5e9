"""Who uses a database: every connection marks it, and an upgrade needs it alone."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any, Final

from sqlalchemy import Connection, event, inspect, select, text

from gaitswarm.services.optimizer.errors import Conflict, StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.store.connections.engine import Database, database_time
from gaitswarm.services.optimizer.store.rows.tables import jobs
from gaitswarm.services.optimizer.store.schema.revisions import require_newest
from gaitswarm.services.optimizer.store.statements.claims import lease_is_alive

# "gaitswarm is in use", as a number that no other program is likely to lock by.
_IN_USE: Final = 0x6761_6974_7377_6D02


@contextmanager
def exclusive(database: Database) -> Iterator[Connection]:
    """A transaction in a database that nobody else uses, or comes to use before it has ended.

    Args:
        database: As `connect` gives it for a migration.

    Yields:
        A connection inside the transaction, which may write.

    Raises:
        Conflict: The database is in use: a process has it open, or a job in it a live lease.
    """
    sqlite = database.engine.dialect.name == "sqlite"
    prepare = _lock_file if sqlite else None
    with database.transaction(write=True, before=prepare) as connection:
        if not sqlite:
            _lock_out(connection, database.name)
        _require_no_lease(connection, database.name)
        yield connection


def _lock_file(connection: Connection) -> None:
    with closing(connection.connection.cursor()) as cursor:
        lock_file(cursor, str(connection.engine.url.database))


def lock_file(cursor: Any, name: str) -> None:
    """Leave an SQLite file's write-ahead log, which only one who is alone can, and stay alone.

    Args:
        cursor: Of a connection outside a transaction, with which the lock ends.
        name: Of the file, for people.

    Raises:
        Conflict: Somebody else has the file open.
    """
    cursor.execute("PRAGMA busy_timeout = 1000")
    cursor.execute("PRAGMA locking_mode = EXCLUSIVE")
    try:
        cursor.execute("PRAGMA journal_mode = DELETE")
    except sqlite3.OperationalError as error:
        raise Conflict(
            f"database {name} is in use by another process: end all that use it first"
        ) from error


def _lock_out(connection: Connection, name: str) -> None:
    locked = text("SELECT pg_try_advisory_xact_lock(:key)")
    if connection.execute(locked, {"key": _IN_USE}).scalar_one():
        return
    holders = text(
        "SELECT DISTINCT coalesce(nullif(application_name, ''), 'process ' || pid)"
        " FROM pg_locks JOIN pg_stat_activity USING (pid)"
        " WHERE locktype = 'advisory' AND objid = :low AND granted AND pid <> pg_backend_pid()"
        " AND database = (SELECT oid FROM pg_database WHERE datname = current_database())"
    )
    low = {"low": _IN_USE & 0xFFFF_FFFF}
    found = ", ".join(sorted(connection.execute(holders, low).scalars()))
    raise Conflict(f"database {name} is in use by {found}: end all that use it first")


def _require_no_lease(connection: Connection, name: str) -> None:
    """Refuse a database with a job under way, whose runner may be cut off from the server."""
    if not inspect(connection).has_table("jobs"):
        return
    columns = (jobs.c.id, jobs.c.lease_owner)
    under_way = jobs.c.state.in_((JobState.RUNNING, JobState.PAUSING))
    live = lease_is_alive(database_time(connection))
    row = connection.execute(select(*columns).where(under_way, live).limit(1)).first()
    if row is not None:
        raise Conflict(
            f"database {name} is in use: job {row.id} is run by {row.lease_owner}; end that"
            " process, or wait until the lease of one that has died is over"
        )


def admit(database: Database) -> None:
    """Let every new connection be of the newest schema, and keep migrations off while it lasts.

    A process that outlives an upgrade, cut off from its server meanwhile, is refused from then on.

    Args:
        database: Of which no connection was made yet.
    """

    @event.listens_for(database.engine, "connect")
    def _admit(connection: Any, _record: object) -> None:
        try:
            require_newest(_revision_in_use(database, connection), database.name)
        except BaseException:
            connection.close()
            raise


def _revision_in_use(database: Database, connection: Any) -> str | None:
    """Mark the database as used for as long as a driver's connection lasts; its revision."""
    dialect = database.engine.dialect
    # An open cursor would keep an SQLite file open after its connection was closed.
    with closing(connection.cursor()) as cursor:
        if dialect.name == "postgresql":
            cursor.execute(f"SELECT pg_try_advisory_lock_shared({_IN_USE})")
            if not cursor.fetchone()[0]:
                raise StoreUnavailable(
                    f"database {database.name} is being upgraded or restored; try again then"
                )
        try:
            cursor.execute("SELECT version_num FROM alembic_version")
            found = cursor.fetchone()
        except dialect.loaded_dbapi.Error as error:
            if "alembic_version" not in str(error):
                raise
            found = None
    connection.commit()
    return None if found is None else str(found[0])
