"""Reads that neither wait nor change threads: of an SQLite file, on a connection of their own."""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Hashable
from functools import partial
from pathlib import Path
from typing import Any, Final

from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.store.connections.engine import Database
from gaitswarm.services.optimizer.store.rows.job_views import shown_job
from gaitswarm.services.optimizer.store.statements.records import SHOWN_JOB, is_job_id

_VERSION: Final = "PRAGMA data_version"


class SqlAtOnce:
    """`AtOnce` of a database.

    On SQLite a row is read by a statement that is prepared once, outside SQLAlchemy. Readers of a
    write-ahead log wait for no writer; where they would, there is no answer. A PostgreSQL server is
    asked over a network, so there never is one.

    Args:
        database: With the newest schema.
    """

    def __init__(self, database: Database) -> None:
        self._dialect = database.engine.dialect
        self._path = Path(database.engine.url.database or "").absolute()
        self._job = str(SHOWN_JOB.compile(dialect=self._dialect))
        self._lock = threading.Lock()
        self._connection: sqlite3.Connection | None = None
        self._connections = 0
        self._closed = self._dialect.name != "sqlite"

    def job(self, job_id: str) -> Job | None:
        """Read a job to show it."""
        row = self._read(self._job, (job_id,)) if is_job_id(job_id) else None
        return None if row is None else shown_job(row, self._dialect)

    def version(self) -> Hashable | None:
        """Count what others have committed, as long as the connection lasts."""
        row = self._read(_VERSION, ())
        return None if row is None else (self._connections, *row)

    def close(self) -> None:
        """End the connection; nothing is read any more. Idempotent."""
        with self._lock:
            self._closed = True
            self._drop()

    def _read(self, statement: str, values: tuple[str, ...]) -> tuple[Any, ...] | None:
        with self._lock:
            if self._closed:
                return None
            try:
                if self._connection is None:
                    self._connection = self._connect()
                row: tuple[Any, ...] | None = self._connection.execute(statement, values).fetchone()
            except sqlite3.Error:
                # Whoever asks in the usual way waits, or is told what is wrong.
                self._drop()
                return None
            return row

    def _connect(self) -> sqlite3.Connection:
        """Made anew where one has failed: the store's other connections keep the file's schema."""
        self._connections += 1
        uri = f"{self._path.as_uri()}?mode=rw"
        connection = sqlite3.connect(
            uri, uri=True, timeout=0.0, isolation_level=None, check_same_thread=False
        )
        connection.text_factory = partial(str, encoding="utf-8", errors="replace")
        return connection

    def _drop(self) -> None:
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()
