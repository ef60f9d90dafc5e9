"""Backup, check, pruning and housekeeping of whole databases"""

from __future__ import annotations

import logging
import os
import re
import sqlite3
import tempfile
import threading
import time
from collections.abc import Collection, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

from sqlalchemy import JSON, URL, Connection, Text, bindparam, cast, delete, func, insert, select

from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest, NotFound, StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import ENDED, JobState
from gaitswarm.services.optimizer.store import Store, schema
from gaitswarm.services.optimizer.store.engine import Database, database_time, parse_url
from gaitswarm.services.optimizer.store.jobs import TRASH
from gaitswarm.services.optimizer.store.tables import jobs, metadata, recordings

_ROWS_AT_ONCE: Final = 1000

_MOST_FINDINGS: Final = 20
"""Of one kind."""

_GRACE: Final = timedelta(days=1)
"""Age from which an unreferenced recording is removed."""

_RECORDING_ID: Final = re.compile(r"\b[0-9a-f]{32}\b")


def backup(url: str, file: Path, *, overwrite: bool = False) -> None:
    """Write a snapshot of an SQLite database, which may be in use, to a file."""
    if file.exists() and not overwrite:
        raise Conflict(f"{file} exists already; name another file, or replace it with --force")
    parsed = parse_url(url)
    if parsed.get_backend_name() != "sqlite":
        raise InvalidRequest("back up PostgreSQL with its own pg_dump --format custom", field="db")
    with _temporary_file(file.parent, f"backup {file}") as copy:
        _copy_file(Path(str(parsed.database)), copy)
        copy.replace(file)


def restore(url: str, file: Path, *, overwrite: bool = False) -> None:
    """Fill an unused database from a backup of this or an older version, in the newest schema."""
    if not file.is_file():
        raise NotFound(f"there is no backup {file}")
    parsed = parse_url(url)
    target = Path(str(parsed.database)) if parsed.get_backend_name() == "sqlite" else None
    if target is not None and target.exists() and not overwrite:
        raise Conflict(f"database {target} exists already; --force replaces all that it holds")
    folder = Path(tempfile.gettempdir()) if target is None else target.parent
    with _temporary_file(folder, f"backup {file}") as copy:
        _copy_file(file, copy)
        if schema.upgrade(str(copy)) is None:
            raise InvalidRequest(f"{file} is no backup of gaitswarm", field="FILE")
        if target is None:
            _fill_server(parsed, copy, overwrite=overwrite)
        else:
            _fill_file(parsed, target, copy)


@contextmanager
def _temporary_file(folder: Path, what: str) -> Iterator[Path]:
    try:
        with tempfile.TemporaryDirectory(dir=folder, prefix=".gaitswarm-") as directory:
            path = Path(directory, "copy.db")
            path.touch(mode=0o600)
            yield path
    except (OSError, sqlite3.Error) as error:
        raise StoreUnavailable(f"{what}: {error}") from error


def _copy_file(source: Path, target: Path) -> None:
    mode = "rw" if os.access(source, os.W_OK) else "ro"
    uri = f"{source.absolute().as_uri()}?mode={mode}"
    with closing(sqlite3.connect(uri, uri=True)) as from_, closing(sqlite3.connect(target)) as to:
        from_.backup(to)
        # Leave the write-ahead log, so that the file is complete, and read it once.
        to.execute("PRAGMA journal_mode = DELETE")
        (result,) = to.execute("PRAGMA quick_check(1)").fetchone()
    if result != "ok":
        raise StoreUnavailable(f"the database is damaged, and its copy with it: {result}")


def _fill_server(url: URL, copy: Path, *, overwrite: bool) -> None:
    schema.create(url)
    with (
        closing(Database(str(copy), for_migration=True)) as source,
        closing(Database(url, for_migration=True)) as target,
        source.read() as rows,
        schema.exclusive(target) as to,
    ):
        tables = metadata.sorted_tables
        filled = [table.name for table in tables if to.execute(select(table).limit(1)).first()]
        if filled and not overwrite:
            raise Conflict(
                f"database {target.name} holds {', '.join(filled)}; --force replaces all of it"
            )
        for table in reversed(tables):
            to.execute(delete(table))
        _copy_rows(rows, to)


def _fill_file(url: URL, target: Path, copy: Path) -> None:
    if target.exists():
        try:
            with closing(Database(url, for_migration=True)) as database, schema.exclusive(database):
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
            schema.lock_file(cursor, str(target))
        # One transaction into the same file: a process that waits for it opens the restored one.
        from_.backup(to)


def _copy_rows(source: Connection, target: Connection) -> None:
    for table in metadata.sorted_tables:
        parameters = {
            # A missing document stays SQL's NULL.
            column.name: bindparam(column.name, type_=JSON(none_as_null=True))
            if isinstance(column.type, JSON)
            else bindparam(column.name)
            for column in table.c
        }
        statement = insert(table).values(parameters)
        options = {"yield_per": _ROWS_AT_ONCE}
        rows = source.execute(select(table), execution_options=options).mappings()
        for batch in rows.partitions():
            target.execute(statement, [dict(row) for row in batch])
        column = table.autoincrement_column
        if column is not None:
            # Numbering continues after the copied rows.
            sequence = func.pg_get_serial_sequence(table.name, column.name)
            last = func.coalesce(func.max(column), 0)
            target.execute(select(func.setval(sequence, last + 1, False)).select_from(table))


def check(url: str) -> list[str]:
    """Return damage of an SQLite file, which may be in use; at most 20 findings of each kind."""
    findings: list[str] = []
    with closing(Database(url, for_migration=True)) as database:
        schema.check_revision(database)
        with database.read() as connection:
            if database.path is not None:
                pages = connection.exec_driver_sql(f"PRAGMA integrity_check({_MOST_FINDINGS})")
                findings += [f"the file is damaged: {page}" for (page,) in pages if page != "ok"]
                orphans = connection.exec_driver_sql("PRAGMA foreign_key_check")
                findings += [
                    f"row {row} of {table} refers to a row of {parent} that is not there"
                    for table, row, parent, _ in orphans.fetchmany(_MOST_FINDINGS)
                ]
    return findings


@dataclass(frozen=True, slots=True)
class Pruned:
    """Result of pruning: ids of removed jobs, numbers of removed recordings and audit entries."""

    jobs: tuple[str, ...]
    recordings: int
    audit: int = 0


def prune(
    url: str,
    *,
    older_than: timedelta | None = None,
    states: Collection[JobState] = ENDED,
    audit_older_than: timedelta | None = None,
    trusts_clock: bool = False,
) -> Pruned:
    """Remove old jobs, as `Store.delete_ended_before`, old audit entries and unused recordings."""
    with closing(Database(url, for_migration=True)) as database:
        schema.check_revision(database)
        store = Store(database)
        with database.read() as connection:
            now = database_time(connection)
        by_age = older_than is not None or audit_older_than is not None
        jump = store.clock_jump() if by_age and not trusts_clock else None
        if jump is not None:
            raise Conflict(
                f"the clock is {jump} ahead of the last change before: check it, and if it is"
                " right, repeat with --trust-clock"
            )
        removed: tuple[str, ...] = ()
        if older_than is not None:
            removed = store.delete_ended_before(now - older_than, states)
        forgotten = 0
        if audit_older_than is not None:
            forgotten = store.forget_audit_before(now - audit_older_than)
        store.purge_deleted()
        with database.write() as connection:
            unused = _remove_unused_recordings(connection)
        _vacuum(database)
    return Pruned(removed, unused, forgotten)


def _remove_unused_recordings(connection: Connection) -> int:
    before = database_time(connection) - _GRACE
    query = select(recordings.c.id).where(recordings.c.created_at < before)
    unused = set(connection.execute(query).scalars())
    # As text: an unreadable spec keeps its recordings, too.
    specs = connection.execute(
        select(cast(jobs.c.spec, Text)), execution_options={"yield_per": 500}
    )
    for spec in specs.scalars():
        unused -= set(_RECORDING_ID.findall(spec))
    for recording in unused:
        connection.execute(delete(recordings).where(recordings.c.id == recording))
    return len(unused)


def _vacuum(database: Database) -> None:
    engine = database.engine.execution_options(isolation_level="AUTOCOMMIT")
    statements = ["VACUUM", "PRAGMA wal_checkpoint(TRUNCATE)", "PRAGMA optimize"]
    if database.path is None:
        statements = [f"VACUUM (ANALYZE) {table.name}" for table in metadata.sorted_tables]
    with database.translated_errors(), engine.connect() as connection:
        for statement in statements:
            connection.exec_driver_sql(statement)


_SECONDS_PER_ROUND: Final = 3600.0
_SECONDS_PER_ATTEMPT: Final = 10.0
_LARGEST_STEP: Final = 3600.0
_STEADY_SECONDS: Final = 86_400.0

_log = logging.getLogger(__name__)


class Housekeeping:
    """Removes rows of deleted jobs, expired jobs and old audit entries, in its own thread."""

    def __init__(
        self,
        store: Store,
        retention_days: float | None = None,
        audit_days: float | None = None,
    ) -> None:
        self._store = store
        self._retention = None if retention_days is None else timedelta(days=retention_days)
        self._audit_retention = None if audit_days is None else timedelta(days=audit_days)
        self._offset = time.time() - time.monotonic()
        self._steady_since = time.monotonic()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._rounds, name="housekeeping", daemon=True)

    def start(self) -> None:
        """Start the thread with a first round. Returns immediately."""
        self._thread.start()

    def stop(self) -> None:
        """End after the current step. Idempotent."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join()

    def round(self) -> None:
        """Run one round, unless ages cannot be trusted."""
        if not self._trusts_clock():
            return
        if self._retention is not None:
            deleted = self._store.delete_ended_before(datetime.now(UTC) - self._retention)
            for job_id in deleted:
                _log.info("job %s deleted: it ended more than %s ago", job_id, self._retention)
        if self._audit_retention is not None:
            removed = self._store.forget_audit_before(datetime.now(UTC) - self._audit_retention)
            if removed:
                _log.info(
                    "%d audit log entries removed: older than %s", removed, self._audit_retention
                )
        self._store.purge_deleted(self._stop.is_set, older_than=TRASH)

    def _trusts_clock(self) -> bool:
        """Return whether ages are right, as far as the database and this process can tell."""
        offset = time.time() - time.monotonic()
        if abs(offset - self._offset) > _LARGEST_STEP:
            self._offset, self._steady_since = offset, time.monotonic()
        jump = self._store.clock_jump()
        if jump is None or time.monotonic() - self._steady_since > _STEADY_SECONDS:
            return True
        _log.warning(
            "the clock is %s ahead of the last change before: check it; nothing is deleted for its"
            " age until the clock has been steady for a day",
            jump,
        )
        return False

    def _rounds(self) -> None:
        while not self._stop.is_set():
            seconds = _SECONDS_PER_ATTEMPT
            try:
                self.round()
                seconds = _SECONDS_PER_ROUND
            except StoreUnavailable as error:
                _log.warning("cannot remove deleted jobs yet: %s", error)
            except Exception:  # noqa: BLE001
                _log.exception("cannot remove deleted jobs yet")
            self._stop.wait(seconds)
