"""Schema revisions: which one a database has, and which this program knows."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from sqlalchemy import Connection, inspect

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.store.connections.engine import Database

MIGRATIONS: Final = Path(__file__).with_name("migrations")
"""Alembic's folder."""


def check_revision(database: Database) -> None:
    """Check that a database answers and has the newest revision.

    Args:
        database: The database.

    Raises:
        StoreUnavailable: It does not; says what to do.
    """
    with database.transaction(write=False) as connection:
        revision = read_revision(connection)
    require_newest(revision, database.name)


def require_newest(revision: str | None, name: str) -> None:
    """Refuse a database of another schema than this program's.

    Args:
        revision: Of the database; None if it has none.
        name: Of the database, for people.

    Raises:
        StoreUnavailable: It is another one; names both, and says what to do.
    """
    if revision == head():
        return
    if revision is not None:
        require_known(revision, name)
    way_out = (
        "it was emptied while it was in use: restart, and restore a backup"
        if revision is None
        else "end all processes that use it, make a backup, then run `gaitswarm db upgrade`"
    )
    raise StoreUnavailable(
        f"database {name} has schema revision {revision or 'none'}, this gaitswarm needs"
        f" {head()}; {way_out}"
    )


def require_known(revision: str, name: str) -> None:
    """Refuse what a newer gaitswarm has made, or one before the first release.

    Args:
        revision: Of a database or of a backup.
        name: Of it, for people.

    Raises:
        StoreUnavailable: This program does not know the revision; names both.
    """
    known = _known_revisions()
    if revision in known:
        return
    if revision < known[0]:
        raise StoreUnavailable(
            f"database {name} has schema revision {revision} of a version before 0.1.0, which this"
            f" gaitswarm cannot read; name another database, or run `gaitswarm db upgrade` of a"
            f" version whose schema revision is {known[0]} first"
        )
    raise StoreUnavailable(
        f"database {name} has schema revision {revision}, which this gaitswarm (up to {known[-1]})"
        " does not know; upgrade gaitswarm, or name another database"
    )


def head() -> str:
    """The newest revision that this program knows."""
    known = _known_revisions()
    if not known:
        raise StoreUnavailable(f"gaitswarm is not wholly installed: no migrations in {MIGRATIONS}")
    return known[-1]


def read_revision(connection: Connection) -> str | None:
    """Read the revision of a database.

    Args:
        connection: An open transaction.

    Returns:
        The revision, whether this program knows it or not; None if there is none.
    """
    if not inspect(connection).has_table("alembic_version"):
        return None
    found = connection.exec_driver_sql("SELECT version_num FROM alembic_version").first()
    return None if found is None else str(found[0])


def _known_revisions() -> list[str]:
    """In their order, as the files' names begin with them."""
    files = (MIGRATIONS / "versions").glob("r*_*.py")
    return sorted(file.name[1:].partition("_")[0] for file in files)
