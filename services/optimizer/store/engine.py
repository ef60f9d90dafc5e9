"""Connections and transactions of SQLite and PostgreSQL"""

from __future__ import annotations

import json
import os
import socket
import sqlite3
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Final, Protocol

import sqlalchemy as sa
from sqlalchemy import exc

from gaitswarm.services.optimizer.errors import LeaseLost, StoreReplaced, StoreUnavailable
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, Job, JobState
from gaitswarm.services.optimizer.masking import HARMLESS, masked_url

BUSY_SECONDS: Final = 15.0
"""Longest wait of a transaction for another's lock."""

CHECK_SECONDS: Final = 5.0
"""Longest check of a file; a gigabyte takes 2 s."""

SILENCE_SECONDS: Final = 15
"""Silence after which the other end of a connection to a server counts as lost."""

IDLE_SECONDS: Final = 20
"""Longest pause between statements of a transaction, so that a stopped client holds no lock."""

STATEMENT_SECONDS: Final = 120
"""Longest statement; none takes as long on histories of any length."""

_PROBES: Final = 2
_CACHE_KIB: Final = 8192
_WRITE: Final = "gaitswarm_write"

_STRICT_JSON: Final = json.JSONEncoder(allow_nan=False, separators=(",", ":"))
"""Without NaN and infinity, which PostgreSQL refuses; floats keep every bit."""

Clock = Callable[[sa.Connection], datetime]
"""Returns the aware time inside a transaction."""


def database_time(connection: sa.Connection) -> datetime:
    """Return the time of the database's clock, as another process judges what this one writes."""
    if connection.dialect.name == "postgresql":
        # CURRENT_TIMESTAMP is the transaction's start, before any wait for a lock.
        now: datetime = connection.execute(sa.select(sa.func.clock_timestamp())).scalar_one()
        return now
    return datetime.now(UTC)


def parse_url(text: str) -> sa.URL:
    """Parse `sqlite:///path`, a bare path, or `postgresql://...`. Raises StoreUnavailable."""
    forms = "use a file name, sqlite:///FILE or postgresql://USER:PASSWORD@HOST/DATABASE"
    if not text.strip():
        raise StoreUnavailable(f"the database URL is empty; {forms}")
    try:
        url = sa.make_url(text) if "://" in text else sa.URL.create("sqlite", database=text)
    except (exc.ArgumentError, ValueError) as error:
        raise StoreUnavailable(f"the database URL cannot be understood; {forms}") from error
    if url.drivername in ("postgresql", "postgres", "postgresql+psycopg"):
        return url.set(drivername="postgresql+psycopg")
    if url.drivername not in ("sqlite", "sqlite+pysqlite"):
        raise StoreUnavailable(f"{url.drivername} databases are not supported; {forms}")
    if url.database in (None, "", ":memory:"):
        raise StoreUnavailable(f"a database in memory forgets every job; {forms}")
    return sa.URL.create("sqlite+pysqlite", database=str(Path(str(url.database)).expanduser()))


class Observer(Protocol):
    """Receives what a process does with a database, after the transaction, in its thread."""

    def transaction(self, operation: str, seconds: float, error: BaseException | None) -> None:
        """A transaction has ended after some time [s], rolled back if there is an error."""

    def claimed(self, claim: Claim) -> None: ...

    def committed(self, claim: Claim, done: CompletedIteration, state: JobState) -> None: ...

    def released(self, claim: Claim, state: JobState, error: str | None) -> None: ...

    def lost(self, claim: Claim, error: LeaseLost) -> None:
        """An operation was refused as its lease is lost; reported by every such operation."""

    def cancelled(self, job: Job) -> None: ...


class Database:
    """Connections to a database and their transactions. Thread-safe; connects when first used."""

    def __init__(self, url: str | sa.URL, *, for_migration: bool = False) -> None:
        self.url = parse_url(url) if isinstance(url, str) else url
        self.observers: list[Observer] = []
        self._file: _OpenFile | None = None
        options: dict[str, Any] = {"json_serializer": _STRICT_JSON.encode}
        if for_migration:
            options |= {"poolclass": sa.NullPool}
        else:
            # The connection used last has most of the database in its cache.
            options |= {"pool_size": 8, "max_overflow": 24, "pool_timeout": BUSY_SECONDS}
            options |= {"pool_use_lifo": True}
        if self.url.get_backend_name() == "sqlite":
            self.name = str(self.url.database)
            self.path: Path | None = Path(self.name)
            self.engine = _sqlite_engine(self.url, options, foreign_keys=not for_migration)
            if not for_migration:
                self._file = _OpenFile(self.path, self.engine)
        else:
            self.name = masked_url(self.url.render_as_string(hide_password=False))
            self.path = None
            self.engine = _postgresql_engine(self.url, options, unlimited=for_migration)

    def read(self, operation: str = "") -> AbstractContextManager[sa.Connection]:
        return self.transaction(operation, write=False)

    def write(self, operation: str = "") -> AbstractContextManager[sa.Connection]:
        """Open a transaction that writes: committed at the end, rolled back on any exception."""
        return self.transaction(operation, write=True)

    @contextmanager
    def transaction(
        self,
        operation: str = "",
        *,
        write: bool,
        before: Callable[[sa.Connection], None] | None = None,
    ) -> Iterator[sa.Connection]:
        """Open a transaction."""
        begun, failure = time.perf_counter(), None
        try:
            with self.translated_errors(), self.engine.connect() as connection:
                connection.execution_options(**{_WRITE: write})
                if before is not None:
                    before(connection)
                elif not write and connection.dialect.name == "postgresql":
                    connection.execution_options(isolation_level="AUTOCOMMIT")
                with connection.begin():
                    yield connection
                    if write:
                        self.check_in_place()
        except BaseException as error:
            failure = error
            raise
        finally:
            for observer in self.observers if operation else ():
                observer.transaction(operation, time.perf_counter() - begun, failure)

    def check_in_place(self) -> None:
        """Raise StoreReplaced if the SQLite file was removed or replaced while open."""
        if self._file is not None:
            self._file.check()

    def check_pages(self) -> None:
        """Read an SQLite file again, for `CHECK_SECONDS` at most; a server checks its own."""
        self.check_in_place()
        if self.path is None:
            return
        deadline = time.monotonic() + CHECK_SECONDS
        uri = f"{self.path.absolute().as_uri()}?mode=rw"
        try:
            with closing(sqlite3.connect(uri, uri=True)) as connection:
                connection.execute(f"PRAGMA busy_timeout = {round(BUSY_SECONDS * 1000)}")
                connection.set_progress_handler(lambda: time.monotonic() > deadline, 1000)
                (result,) = connection.execute("PRAGMA quick_check(1)").fetchone()
        except sqlite3.DatabaseError as error:
            if "interrupted" in str(error):
                return
            result = str(error)
        if result != "ok":
            raise StoreUnavailable(
                f"database {self.name} was damaged while it was in use:"
                f" {' '.join(result.split())}; jobs may be lost: put a copy of it in its place"
            )

    @contextmanager
    def translated_errors(self) -> Iterator[None]:
        """Raise StoreUnavailable for faults of the database."""
        driver = self.engine.dialect.loaded_dbapi.Error
        try:
            yield
        except (exc.DatabaseError, exc.InterfaceError, exc.TimeoutError, driver) as error:
            # InternalError: a PostgreSQL server that became read-only or ended the session. A bare
            # DatabaseError: a file or an answer that is not a database's. The driver's own: rows
            # that cannot be fetched.
            faults = (exc.OperationalError, exc.InterfaceError, exc.InternalError, exc.TimeoutError)
            if not isinstance(error, (*faults, driver)) and type(error) is not exc.DatabaseError:
                raise
            cause = self.without_secrets(_cause(error))
            raise StoreUnavailable(f"database {self.name}: {cause}") from error

    def without_secrets(self, text: str) -> str:
        """Return a driver's message without the passwords of the URL."""
        secrets = {str(self.url.password or "")}
        for name, values in self.url.query.items():
            if name not in HARMLESS:
                secrets |= {values} if isinstance(values, str) else {*values}
        for secret in sorted(secrets - {""}, key=len, reverse=True):
            text = text.replace(secret, "***")
        return text

    def close(self) -> None:
        """Close pooled connections. Idempotent."""
        self.engine.dispose()


class Aggregate:
    """A part of the store. Thread-safe; a method is one transaction unless it says otherwise."""

    def __init__(self, database: Database, clock: Clock = database_time) -> None:
        self._database = database
        self._clock = clock


def _cause(error: Exception) -> str:
    """Return the driver's message, without the statement and its parameters."""
    origin = getattr(error, "orig", None)
    text = " ".join(str(error if origin is None else origin).split())
    if "locked" in text:
        return f"{text}: another process has been writing for {BUSY_SECONDS:g} s; try again"
    if "unable to open" in text:
        return f"{text}: check that its directory exists and that you may write there"
    return text


SYNCHRONOUS = "FULL"
"""Whether what is committed survives a power cut; tests turn it off."""


def _sqlite_engine(url: sa.URL, options: dict[str, Any], *, foreign_keys: bool) -> sa.Engine:
    # Without an isolation level the driver begins no transaction of its own.
    connect_args = {"isolation_level": None, "timeout": BUSY_SECONDS}
    engine = sa.create_engine(url, connect_args=connect_args, **options)

    @sa.event.listens_for(engine, "connect")
    def _configure(connection: sqlite3.Connection, _record: object) -> None:
        _enable_write_ahead_log(connection)
        # A text that is not UTF-8 must not hide the other rows of a query.
        connection.text_factory = partial(str, encoding="utf-8", errors="replace")
        connection.execute(f"PRAGMA synchronous = {SYNCHRONOUS}")
        connection.execute(f"PRAGMA cache_size = {-_CACHE_KIB}")
        connection.execute(f"PRAGMA foreign_keys = {'ON' if foreign_keys else 'OFF'}")

    @sa.event.listens_for(engine, "begin")
    def _begin(connection: sa.Connection) -> None:
        options = connection.get_execution_options()
        if options.get("isolation_level") == "AUTOCOMMIT":
            return
        # A deferred transaction that starts to write fails if another has written since.
        write = options.get(_WRITE, False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if write else "BEGIN DEFERRED")

    return engine


def _enable_write_ahead_log(connection: sqlite3.Connection) -> None:
    """Let readers and the writer work concurrently. A property of the file, set once."""
    deadline = time.monotonic() + BUSY_SECONDS
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL")
            return
        except sqlite3.OperationalError as error:
            # The busy timeout does not cover a switch by two processes at once.
            if "locked" not in str(error) or time.monotonic() > deadline:
                raise
            time.sleep(0.01)


class _OpenFile:
    """Device and inode of an SQLite file and of its log while connections are open.

    As long as one is open both files stay: another inode is another file, in which nothing that is
    written here will be found.
    """

    def __init__(self, path: Path, engine: sa.Engine) -> None:
        self._name = str(path)
        self._file = self._log = path.absolute()
        self._lock = threading.Lock()
        self._connections = 0
        self._identity: tuple[object, object] = (None, None)
        sa.event.listen(engine, "do_connect", self._before_connection)
        sa.event.listen(engine, "checkout", self._opened)
        sa.event.listen(engine, "close", self._closed)

    def check(self) -> None:
        with self._lock:
            file, log = _identity(self._file), _identity(self._log)
            if not self._connections:
                return
            if self._identity[1] is None:
                # The first transaction creates the log.
                self._identity = self._identity[0], log
            if (file, log) == self._identity:
                return
        raise StoreReplaced(
            f"database {self._name}: the database file was removed or replaced while it was open;"
            " restart the server or command that uses it, and restore a backup if jobs are missing"
        )

    def _before_connection(self, *_: object) -> None:
        # SQLite would create an empty file in place of a removed one.
        self.check()

    def _opened(self, _connection: object, record: Any, _proxy: object) -> None:
        if record.info.get("counted"):
            return
        record.info["counted"] = True
        with self._lock:
            self._connections += 1
            if self._connections == 1:
                # SQLite follows links, and keeps its log next to the target.
                real = self._file.resolve()
                self._log = real.with_name(f"{real.name}-wal")
                self._identity = _identity(self._file), _identity(self._log)

    def _closed(self, _connection: object, record: Any) -> None:
        if record.info.pop("counted", False):
            with self._lock:
                self._connections -= 1


def _identity(path: Path) -> tuple[int, int] | None:
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino


def _postgresql_engine(url: sa.URL, options: dict[str, Any], *, unlimited: bool) -> sa.Engine:
    """Create an engine on psycopg whose connections end within `SILENCE_SECONDS` of a partition."""
    probe = SILENCE_SECONDS // (_PROBES + 1)
    probes = {"keepalives_idle": probe, "keepalives_interval": probe, "keepalives_count": _PROBES}
    connect_args: dict[str, Any] = {
        # The server cuts longer names.
        "application_name": f"gaitswarm {socket.gethostname()[:40]}:{os.getpid()}",
        "connect_timeout": SILENCE_SECONDS,
        "tcp_user_timeout": SILENCE_SECONDS * 1000,
        **probes,
    }
    connect_args = {name: value for name, value in connect_args.items() if name not in url.query}
    settings = {
        "lock_timeout": round(BUSY_SECONDS * 1000),
        "tcp_user_timeout": SILENCE_SECONDS * 1000,
        **{f"tcp_{name}": value for name, value in probes.items()},
    }
    if not unlimited:
        settings["statement_timeout"] = STATEMENT_SECONDS * 1000
        settings["idle_in_transaction_session_timeout"] = IDLE_SECONDS * 1000
    given = url.query.get("options", "")
    given = given if isinstance(given, str) else " ".join(given)
    # The last of several equal settings counts.
    connect_args["options"] = " ".join([*(f"-c {k}={v}" for k, v in settings.items()), given])
    # A connection that a restart of the server has cut is replaced before it is used.
    options = options | {"pool_pre_ping": not unlimited}
    try:
        return sa.create_engine(url, connect_args=connect_args, **options)
    except ModuleNotFoundError as error:
        raise StoreUnavailable(
            f"PostgreSQL needs {error.name}: install gaitswarm[postgres]"
        ) from error
