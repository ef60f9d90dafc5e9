"""Schema revisions: bring a database to the newest, or say why it cannot be used."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Final

from sqlalchemy import URL, Connection, inspect
from sqlalchemy.exc import DBAPIError

from services.optimizer.errors import StoreUnavailable
from services.optimizer.store.engine import Database, connect

_MIGRATIONS: Final = Path(__file__).with_name("migrations")

# "gaitswarm migrates", as a number that no other program is likely to lock by.
_ADVISORY_LOCK: Final = 0x6761_6974_7377_6D01

# Alembic keeps the migration under way in module globals.
_one_at_a_time: Final = threading.Lock()


def migrate(url: URL) -> None:
    """Bring a database to the newest revision; safe when several processes do so at once.

    Args:
        url: Of the database, as `parse_url` has it; an SQLite file is created.

    Raises:
        StoreUnavailable: It cannot be opened or migrated, or was made by a newer gaitswarm.
    """
    database = connect(url, for_migration=True)
    try:
        # Looking first: an open database that is up to date needs no write lock.
        with database.transaction(write=False) as connection:
            if _revision(connection, database.name) == head():
                return
        with database.transaction(write=True) as connection:
            lock_for_migration(connection)
            if _revision(connection, database.name) != head():
                _upgrade(connection, database.name)
    except DBAPIError as error:
        raise StoreUnavailable(
            f"database {database.name} cannot be migrated: {error.orig}; it needs a user who may"
            " create tables in it, and no other program's tables of the same names"
        ) from error
    finally:
        database.close()


def check_revision(database: Database) -> None:
    """Check that a database answers and has the newest revision.

    Args:
        database: The database.

    Raises:
        StoreUnavailable: It does not; says what to do.
    """
    with database.transaction(write=False) as connection:
        revision = _revision(connection, database.name)
    if revision != head():
        raise StoreUnavailable(
            f"database {database.name} has schema revision {revision or 'none'}, this gaitswarm"
            f" needs {head()}; restart it to migrate the database"
        )


def head() -> str:
    """The newest revision that this program knows."""
    known = _known_revisions()
    if not known:
        raise StoreUnavailable(f"gaitswarm is not wholly installed: no migrations in {_MIGRATIONS}")
    return known[-1]


def lock_for_migration(connection: Connection) -> None:
    """Let one process migrate at a time; on SQLite the write transaction is lock enough.

    Args:
        connection: The transaction of the migration, with which the lock ends.
    """
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_ADVISORY_LOCK})")


def _known_revisions() -> list[str]:
    """In their order, as the files' names begin with them."""
    files = (_MIGRATIONS / "versions").glob("r*_*.py")
    return sorted(file.name[1:].partition("_")[0] for file in files)


def _revision(connection: Connection, name: str) -> str | None:
    """Revision of the database, None if it has none; StoreUnavailable for an unknown one."""
    if not inspect(connection).has_table("alembic_version"):
        return None
    found = connection.exec_driver_sql("SELECT version_num FROM alembic_version").first()
    revision = None if found is None else str(found[0])
    known = _known_revisions()
    if revision is not None and revision not in known:
        raise StoreUnavailable(
            f"database {name} has schema revision {revision}, which this gaitswarm (up to"
            f" {head()}) does not know; upgrade gaitswarm, or name another database"
        )
    return revision


def _upgrade(connection: Connection, name: str) -> None:
    # Most databases are up to date, and nobody should wait for Alembic to look at them.
    from alembic import command  # noqa: PLC0415
    from alembic.config import Config  # noqa: PLC0415

    config = Config()
    # A percent sign in a path would be read as the configuration's interpolation.
    config.set_main_option("script_location", str(_MIGRATIONS).replace("%", "%%"))
    config.attributes["connection"] = connection
    with _one_at_a_time:
        command.upgrade(config, "head")
    if connection.dialect.name == "sqlite":
        broken = connection.exec_driver_sql("PRAGMA foreign_key_check").first()
        if broken is not None:
            raise StoreUnavailable(f"database {name} has rows that refer to nothing: {broken}")
