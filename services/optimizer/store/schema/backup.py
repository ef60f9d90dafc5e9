"""Backups: one SQLite file with all rows, made while jobs run, restored to either database."""

from __future__ import annotations

import os
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, Final

from sqlalchemy import JSON, URL, Connection, Table, bindparam, delete, func, insert, select

from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest, NotFound, StoreUnavailable
from gaitswarm.services.optimizer.store.connections.engine import connect, parse_url
from gaitswarm.services.optimizer.store.connections.file_system import check_file_system
from gaitswarm.services.optimizer.store.rows.tables import Document, metadata
from gaitswarm.services.optimizer.store.schema.in_use import exclusive, lock_file
from gaitswarm.services.optimizer.store.schema.migrate import create, upgrade
from gaitswarm.services.optimizer.store.schema.revisions import check_revision

_ROWS: Final = 1000
"""Rows that are copied at once."""


def backup(url: str, file: Path, *, overwrite: bool = False) -> None:
    """Write all that a database holds at one moment to a file; whoever uses it goes on.

    Args:
        url: Of the database, as for `open_store`; a server's has the newest schema.
        file: To be made: an SQLite database of the same revision, checked before it is there.
        overwrite: Whether a file of that name may be replaced.

    Raises:
        Conflict: The file exists, and is not to be replaced.
        StoreUnavailable: The database cannot be read, or the file not be written.
    """
    if file.exists() and not overwrite:
        raise Conflict(f"{file} exists already; name another file, or replace it with --force")
    parsed = parse_url(url)
    with _temporary(file.parent, f"backup {file}") as written:
        if parsed.get_backend_name() == "sqlite":
            _copy_file(Path(parsed.database or ""), written)
        else:
            _copy_server(parsed, written)
        written.replace(file)


def restore(url: str, file: Path, *, overwrite: bool = False) -> None:
    """Fill a database that nobody uses with what a backup holds, in the newest schema.

    Args:
        url: Of the database, as for `open_store`; an SQLite file need not exist.
        file: As `backup` made it, by this gaitswarm or an older one; it is not changed.
        overwrite: Whether what the database holds may be replaced.

    Raises:
        NotFound: There is no such file.
        InvalidRequest: It is no backup.
        Conflict: The database is in use; or it holds something, which is not to be replaced.
        StoreUnavailable: The database cannot be written, or the backup was made by a newer
            gaitswarm.
    """
    if not file.is_file():
        raise NotFound(f"there is no backup {file}")
    parsed = parse_url(url)
    check_file_system(parsed)
    target = Path(parsed.database or "") if parsed.get_backend_name() == "sqlite" else None
    if target is not None and target.exists() and not overwrite:
        raise Conflict(f"database {target} exists already; --force replaces all that it holds")
    folder = Path(tempfile.gettempdir()) if target is None else target.parent
    with _temporary(folder, f"backup {file}") as copy:
        _copy_file(file, copy)
        if upgrade(str(copy)) is None:
            raise InvalidRequest(f"{file} is no backup of gaitswarm", field="FILE")
        if target is None:
            _fill_server(parsed, copy, overwrite=overwrite)
        else:
            _fill_file(parsed, target, copy)


@contextmanager
def _temporary(folder: Path, what: str) -> Iterator[Path]:
    """Path of a new file, which is gone afterwards unless it was moved; what: for messages."""
    try:
        handle, name = tempfile.mkstemp(dir=folder, prefix=".gaitswarm-", suffix=".db")
    except OSError as error:
        raise StoreUnavailable(f"{what}: cannot write to {folder}: {error.strerror}") from error
    os.close(handle)
    path = Path(name)
    try:
        yield path
    except sqlite3.Error as error:
        raise StoreUnavailable(f"{what}: {error}") from error
    finally:
        for end in ("", "-wal", "-shm", "-journal"):
            path.with_name(path.name + end).unlink(missing_ok=True)


def _copy_file(source: Path, target: Path) -> None:
    """Copy an SQLite database as it is at one moment, and check the copy."""
    mode = "rw" if os.access(source, os.W_OK) else "ro"
    with (
        closing(sqlite3.connect(f"{source.absolute().as_uri()}?mode={mode}", uri=True)) as from_,
        closing(sqlite3.connect(target)) as to,
    ):
        from_.backup(to)
        _finish(to)


def _finish(connection: sqlite3.Connection) -> None:
    """Leave the write-ahead log, so that the file is all there is, and read it once."""
    connection.execute("PRAGMA journal_mode = DELETE")
    (found,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if found != "ok":
        raise StoreUnavailable(f"the database is damaged, and its copy with it: {found}")


def _copy_server(url: URL, target: Path) -> None:
    """Copy the rows of a server's database, all of one moment, to a new SQLite database."""
    create(parse_url(str(target)))

    def snapshot(connection: Connection) -> None:
        connection.execution_options(isolation_level="REPEATABLE READ")

    with (
        closing(connect(url, for_migration=True)) as source,
        closing(connect(parse_url(str(target)), for_migration=True)) as copy,
    ):
        check_revision(source)
        with (
            source.transaction(write=False, before=snapshot) as rows,
            copy.transaction(write=True) as to,
        ):
            _copy_rows(rows, to)
    with closing(sqlite3.connect(target)) as connection:
        _finish(connection)


def _fill_server(url: URL, copy: Path, *, overwrite: bool) -> None:
    create(url)
    with (
        closing(connect(parse_url(str(copy)), for_migration=True)) as source,
        closing(connect(url, for_migration=True)) as target,
        source.transaction(write=False) as rows,
        exclusive(target) as to,
    ):
        tables = metadata.sorted_tables
        held = [table.name for table in tables if to.execute(select(table).limit(1)).first()]
        if held and not overwrite:
            raise Conflict(
                f"database {target.name} holds {', '.join(held)}; --force replaces all of it"
            )
        for table in reversed(tables):
            to.execute(delete(table))
        _copy_rows(rows, to)


def _fill_file(url: URL, target: Path, copy: Path) -> None:
    if target.exists():
        try:
            with closing(connect(url, for_migration=True)) as database, exclusive(database):
                pass
        except StoreUnavailable as error:
            raise StoreUnavailable(
                f"{error}; to restore all the same, move {target} away, and with it -wal and -shm"
            ) from error
    with (
        closing(sqlite3.connect(copy)) as from_,
        closing(sqlite3.connect(target, isolation_level=None)) as to,
    ):
        with closing(to.cursor()) as cursor:
            lock_file(cursor, str(target))
        # In one transaction, into the same file: whoever waits to open it opens what is restored.
        from_.backup(to)


def _copy_rows(source: Connection, target: Connection) -> None:
    """Copy all rows of all tables, what others refer to first."""
    for table in metadata.sorted_tables:
        rows = source.execute(select(table), execution_options={"yield_per": _ROWS}).mappings()
        statement = insert(table).values(_parameters(table))
        for batch in rows.partitions():
            target.execute(statement, [dict(row) for row in batch])
        _count_on(target, table)


def _count_on(connection: Connection, table: Table) -> None:
    """Let a server give the numbers that follow those of rows which came with theirs."""
    column = table.autoincrement_column
    if column is None or connection.dialect.name != "postgresql":
        return
    sequence = func.pg_get_serial_sequence(table.name, column.name)
    last = func.coalesce(func.max(column), 0)
    connection.execute(select(func.setval(sequence, last + 1, False)).select_from(table))


def _parameters(table: Table) -> dict[str, Any]:
    """Of an insertion, by column; a document that is missing stays SQL's NULL."""
    return {
        column.name: bindparam(column.name, type_=JSON(none_as_null=True))
        if isinstance(column.type, (JSON, Document))
        else bindparam(column.name)
        for column in table.c
    }
