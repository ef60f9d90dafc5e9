"""Makes the tables of a database, and brings those of an older one to the newest schema."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Final

from sqlalchemy import URL, Column, Connection, MetaData, PrimaryKeyConstraint, String, Table
from sqlalchemy.exc import DBAPIError

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.store.connections.engine import Database, connect, parse_url
from gaitswarm.services.optimizer.store.connections.file_system import check_file_system
from gaitswarm.services.optimizer.store.rows.tables import metadata
from gaitswarm.services.optimizer.store.schema.in_use import exclusive
from gaitswarm.services.optimizer.store.schema.revisions import (
    MIGRATIONS,
    head,
    read_revision,
    require_known,
    require_newest,
)

# "gaitswarm migrates", as a number that no other program is likely to lock by.
_MIGRATING: Final = 0x6761_6974_7377_6D01

# Alembic's own table, as it makes it.
_alembic_version: Final = Table(
    "alembic_version",
    MetaData(),
    Column("version_num", String(32), nullable=False),
    PrimaryKeyConstraint("version_num", name="alembic_version_pkc"),
)

# Alembic keeps the migration under way in module globals.
_one_at_a_time: Final = threading.Lock()


def create(url: URL) -> None:
    """Make the tables of an empty database; safe when several processes do so at once.

    Args:
        url: Of the database, as `parse_url` has it; an SQLite file is created.

    Raises:
        StoreUnavailable: It cannot be opened, or has another schema than the newest.
    """
    with closing(connect(url, for_migration=True)) as database:
        # Looking first: an open database that is up to date needs no write lock.
        if _empty(database):
            with _explained(database), database.transaction(write=True) as connection:
                lock_for_migration(connection)
                if read_revision(connection) is None:
                    _make(connection)


def _empty(database: Database) -> bool:
    """Whether nothing is stored; StoreUnavailable for a database of another schema."""
    with database.transaction(write=False) as connection:
        revision = read_revision(connection)
    if revision is not None:
        require_newest(revision, database.name)
    return revision is None


def upgrade(url: str) -> str | None:
    """Bring a database that nobody uses to the newest revision.

    Args:
        url: Of the database, as for `open_store`.

    Returns:
        The revision that it had before; None for one that was empty.

    Raises:
        Conflict: It is in use.
        StoreUnavailable: It cannot be opened or migrated, or was made by a newer gaitswarm.
    """
    parsed = parse_url(url)
    check_file_system(parsed)
    with closing(connect(parsed, for_migration=True)) as database:
        with database.transaction(write=False) as connection:
            before = read_revision(connection)
        if before is None:
            create(parsed)
        elif before != head():
            require_known(before, database.name)
            with _explained(database), exclusive(database) as connection:
                _migrate(connection, database.name)
        return before


def lock_for_migration(connection: Connection) -> None:
    """Let one process migrate at a time; on SQLite the write transaction is lock enough.

    Args:
        connection: The transaction of the migration, with which the lock ends.
    """
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_MIGRATING})")


@contextmanager
def _explained(database: Database) -> Iterator[None]:
    """What a database answers to a migration, for people."""
    try:
        yield
    except DBAPIError as error:
        cause = database.without_secrets(str(error.orig))
        raise StoreUnavailable(
            f"database {database.name} cannot be migrated: {cause}; it needs a user who may"
            " create tables in it, and no other program's tables of the same names"
        ) from error


def _make(connection: Connection) -> None:
    """The newest tables at once: importing Alembic and migrating takes ten times as long."""
    metadata.create_all(connection, checkfirst=False)
    _alembic_version.create(connection)
    connection.execute(_alembic_version.insert().values(version_num=head()))


def _migrate(connection: Connection, name: str) -> None:
    # Most databases are up to date, and nobody should wait for Alembic to look at them.
    from alembic import command  # noqa: PLC0415
    from alembic.config import Config  # noqa: PLC0415

    config = Config()
    # A percent sign in a path would be read as the configuration's interpolation.
    config.set_main_option("script_location", str(MIGRATIONS).replace("%", "%%"))
    config.attributes["connection"] = connection
    with _one_at_a_time:
        command.upgrade(config, "head")
    if connection.dialect.name == "sqlite":
        broken = connection.exec_driver_sql("PRAGMA foreign_key_check").first()
        if broken is not None:
            raise StoreUnavailable(f"database {name} has rows that refer to nothing: {broken}")
