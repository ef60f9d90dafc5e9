"""Schema revisions, creation and migration of databases, and exclusive use of one"""

from __future__ import annotations

import os
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.exc import DBAPIError

from gaitswarm.services.optimizer.errors import Conflict, StoreUnavailable
from gaitswarm.services.optimizer.store.engine import Database, database_time, parse_url
from gaitswarm.services.optimizer.store.leases import has_live_lease
from gaitswarm.services.optimizer.store.tables import jobs, metadata

MIGRATIONS: Final = Path(__file__).with_name("migrations")
"""Alembic's folder."""

# Numbers of advisory locks: "gaitsw" and the kind.
_MIGRATING: Final = 0x6761_6974_7377_6D01
_IN_USE: Final = 0x6761_6974_7377_6D02

_alembic_lock: Final = threading.Lock()
"""Alembic keeps the migration in progress in module globals."""


def head() -> str:
    return _known_revisions()[-1]


def _known_revisions() -> list[str]:
    files = (MIGRATIONS / "versions").glob("r*_*.py")
    known = sorted(file.name[1:].partition("_")[0] for file in files)
    if not known:
        raise StoreUnavailable(f"gaitswarm is not wholly installed: no migrations in {MIGRATIONS}")
    return known


def read_revision(connection: sa.Connection) -> str | None:
    """Return the revision of a database; None if it has none."""
    if not sa.inspect(connection).has_table("alembic_version"):
        return None
    row = connection.exec_driver_sql("SELECT version_num FROM alembic_version").first()
    return None if row is None else str(row[0])


def check_revision(database: Database, operation: str = "") -> None:
    """Raise StoreUnavailable unless the database answers and has the newest revision."""
    with database.read(operation) as connection:
        revision = read_revision(connection)
    _require_newest(revision, database.name)


def _require_newest(revision: str | None, name: str) -> None:
    if revision == head():
        return
    if revision is None:
        way_out = "it was emptied while it was in use: restart, and restore a backup"
    else:
        _require_known(revision, name)
        way_out = "end all processes that use it, make a backup, then run `gaitswarm db upgrade`"
    raise StoreUnavailable(
        f"database {name} has schema revision {revision or 'none'}, this gaitswarm needs"
        f" {head()}; {way_out}"
    )


def _require_known(revision: str, name: str) -> None:
    known = _known_revisions()
    if revision not in known:
        raise StoreUnavailable(
            f"database {name} has schema revision {revision}, which this gaitswarm ({known[0]} to"
            f" {known[-1]}) does not know; use another version of gaitswarm, or name another"
            " database"
        )


def create(url: sa.URL) -> None:
    """Create the tables of an empty database, by one of several processes at once."""
    with closing(Database(url, for_migration=True)) as database:
        if database.path is not None:
            # Only this user can read it, and SQLite's log. SQLite says why it cannot be made.
            with suppress(OSError):
                os.close(os.open(database.path, os.O_CREAT | os.O_RDWR, 0o600))
        # An existing database needs no write lock.
        with database.read() as connection:
            revision = read_revision(connection)
        if revision is not None:
            _require_newest(revision, database.name)
            return
        with _explained_errors(database), database.write() as connection:
            lock_for_migration(connection)
            if read_revision(connection) is None:
                others = sa.inspect(connection).get_table_names()
                if others and database.path is not None:
                    raise StoreUnavailable(
                        f"database {database.name} is of another program: it has the tables"
                        f" {', '.join(others[:5])}; name another file"
                    )
                # Migrating, and importing Alembic, takes ten times as long.
                metadata.create_all(connection, checkfirst=False)
                version = f"CREATE TABLE alembic_version AS SELECT '{head()}' AS version_num"
                connection.exec_driver_sql(version)


def upgrade(url: str) -> str | None:
    """Migrate an unused database to the newest revision; return that before, None if empty."""
    parsed = parse_url(url)
    with closing(Database(parsed, for_migration=True)) as database:
        with database.read() as connection:
            before = read_revision(connection)
        if before is None:
            create(parsed)
        elif before != head():
            _require_known(before, database.name)
            with _explained_errors(database), exclusive(database) as connection:
                _migrate(connection, database.name)
        return before


def lock_for_migration(connection: sa.Connection) -> None:
    """Create in one process at a time; on SQLite the write transaction is lock enough."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_MIGRATING})")


@contextmanager
def _explained_errors(database: Database) -> Iterator[None]:
    try:
        yield
    except DBAPIError as error:
        cause = database.without_secrets(str(error.orig))
        raise StoreUnavailable(
            f"database {database.name} cannot be migrated: {cause}; it needs a user who may"
            " create tables in it, and no other program's tables of the same names"
        ) from error


def _migrate(connection: sa.Connection, name: str) -> None:
    # Slow to import, and most databases are up to date.
    from alembic import command  # noqa: PLC0415
    from alembic.config import Config  # noqa: PLC0415

    config = Config()
    # A percent sign in a path would be an interpolation.
    config.set_main_option("script_location", str(MIGRATIONS).replace("%", "%%"))
    config.attributes["connection"] = connection
    with _alembic_lock:
        command.upgrade(config, "head")
    if connection.dialect.name == "sqlite":
        broken = connection.exec_driver_sql("PRAGMA foreign_key_check").first()
        if broken is not None:
            raise StoreUnavailable(f"database {name} has rows that refer to nothing: {broken}")


@contextmanager
def exclusive(database: Database) -> Iterator[sa.Connection]:
    """Open a write transaction in a database that no other process has open or can open."""

    def lock_before(connection: sa.Connection) -> None:
        if database.path is not None:
            with closing(connection.connection.cursor()) as cursor:
                lock_file(cursor, database.name)

    with database.transaction(write=True, before=lock_before) as connection:
        if database.path is None:
            locked = sa.select(sa.func.pg_try_advisory_xact_lock(_IN_USE))
            if not connection.execute(locked).scalar_one():
                raise _in_use(database.name)
        if sa.inspect(connection).has_table("jobs"):
            # A runner may be cut off from the server.
            columns = (jobs.c.id, jobs.c.lease_owner)
            leased = sa.select(*columns).where(has_live_lease(database_time(connection)))
            row = connection.execute(leased.limit(1)).first()
            if row is not None:
                raise Conflict(
                    f"database {database.name} is in use: job {row.id} is run by"
                    f" {row.lease_owner}; end that process, or wait until the lease of one that"
                    " has died is over"
                )
        yield connection


def lock_file(cursor: Any, name: str) -> None:
    """Lock an SQLite file by leaving its write-ahead log, which needs exclusive use."""
    cursor.execute("PRAGMA busy_timeout = 1000")
    cursor.execute("PRAGMA locking_mode = EXCLUSIVE")
    try:
        cursor.execute("PRAGMA journal_mode = DELETE")
    except sqlite3.OperationalError as error:
        raise _in_use(name) from error


def _in_use(name: str) -> Conflict:
    return Conflict(f"database {name} is in use by another process: end all that use it first")


def admit(database: Database) -> None:
    """Require the newest revision of each new connection, and exclude migrations while it lasts."""

    @sa.event.listens_for(database.engine, "connect")
    def _admit(connection: Any, _record: object) -> None:
        try:
            _require_newest(_revision_in_use(database, connection), database.name)
        except BaseException:
            connection.close()
            raise


def _revision_in_use(database: Database, connection: Any) -> str | None:
    """Mark the database as used while a driver's connection lasts, and read its revision."""
    # An open cursor would keep an SQLite file open after its connection is closed.
    with closing(connection.cursor()) as cursor:
        if database.path is None:
            cursor.execute(f"SELECT pg_try_advisory_lock_shared({_IN_USE})")
            if not cursor.fetchone()[0]:
                raise StoreUnavailable(
                    f"database {database.name} is being upgraded or restored; try again then"
                )
        try:
            cursor.execute("SELECT version_num FROM alembic_version")
            row = cursor.fetchone()
        except database.engine.dialect.loaded_dbapi.Error as error:
            if "alembic_version" not in str(error):
                raise
            row = None
    connection.commit()
    return None if row is None else str(row[0])
