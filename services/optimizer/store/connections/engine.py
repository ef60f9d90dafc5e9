"""Connections and transactions: the one place that begins, commits and rolls back."""

from __future__ import annotations

import json
import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Final

from sqlalchemy import (
    URL,
    Connection,
    Engine,
    NullPool,
    create_engine,
    event,
    func,
    make_url,
    select,
)
from sqlalchemy.exc import (
    ArgumentError,
    DatabaseError,
    InterfaceError,
    InternalError,
    OperationalError,
)
from sqlalchemy.exc import TimeoutError as PoolTimeout

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.masking import HARMLESS, masked_url
from gaitswarm.services.optimizer.store.connections.open_file import OpenFile
from gaitswarm.services.optimizer.store.connections.postgresql import postgresql_engine

BUSY_SECONDS: Final = 15.0
"""How long a transaction waits for another's lock before the store counts as unavailable."""

CHECK_SECONDS: Final = 5.0
"""How long the reading of a whole file may take; a gigabyte takes some 2 s."""

_CACHE_KIB: Final = 8192
"""Of a connection to SQLite: its usual 2 MiB are less than the table of a thousand jobs."""

_WRITE: Final = "gaitswarm_write"

Clock = Callable[[Connection], datetime]
"""Tells the time inside a transaction, aware."""


def database_time(connection: Connection) -> datetime:
    """The time now by the one clock that all users of a database share.

    A lease is written by one process and judged by another, whose own clock may be hours off.

    Args:
        connection: An open transaction. A time read after a lock was waited for is later than one
            read before: PostgreSQL's CURRENT_TIMESTAMP would stand still from its beginning.

    Returns:
        The time, aware.
    """
    if connection.dialect.name == "postgresql":
        now: datetime = connection.execute(select(func.clock_timestamp())).scalar_one()
        return now
    # SQLite is a part of this process and has the machine's clock, like all other processes that
    # can open the file; its own functions would tell only milliseconds of it.
    return datetime.now(UTC)


def parse_url(text: str) -> URL:
    """Read the URL of a database, or a file's name.

    Args:
        text: `sqlite:///path`, a bare path, or `postgresql://...`.

    Returns:
        What SQLAlchemy takes.

    Raises:
        StoreUnavailable: It is none of these; says which forms there are.
    """
    forms = "use a file name, sqlite:///FILE or postgresql://USER:PASSWORD@HOST/DATABASE"
    if "://" not in text:
        if not text.strip():
            raise StoreUnavailable(f"the database URL is empty; {forms}")
        return _sqlite_url(text, forms)
    try:
        url = make_url(text)
    except (ArgumentError, ValueError) as error:
        raise StoreUnavailable(f"the database URL cannot be understood; {forms}") from error
    if url.drivername in ("sqlite", "sqlite+pysqlite"):
        return _sqlite_url(url.database or "", forms)
    if url.drivername in ("postgresql", "postgres", "postgresql+psycopg"):
        return url.set(drivername="postgresql+psycopg")
    raise StoreUnavailable(f"{url.drivername} databases are not supported; {forms}")


def _sqlite_url(path: str, forms: str) -> URL:
    if path in ("", ":memory:"):
        raise StoreUnavailable(f"a database in memory forgets every job; {forms}")
    return URL.create("sqlite+pysqlite", database=str(Path(path).expanduser()))


@dataclass(frozen=True, slots=True)
class Database:
    """An engine and its name.

    Attributes:
        engine: Connections to the database.
        name: By which messages call the database, without password.
        file: What is open of an SQLite file; None for a server and while one is migrated.
    """

    engine: Engine
    name: str
    file: OpenFile | None = None

    @contextmanager
    def transaction(
        self, *, write: bool, before: Callable[[Connection], None] | None = None
    ) -> Iterator[Connection]:
        """Commit at the end, roll back on any exception.

        Args:
            write: Whether anything will be written. On SQLite a transaction that only reads never
                waits for a writer, and sees one state of the database throughout; on PostgreSQL
                each of its statements sees what is committed when it begins (READ COMMITTED), so
                that each is a transaction by itself, and the server is asked once for it.
            before: Called with the connection before the transaction begins; one that only reads is
                one transaction then, as this sets it.

        Yields:
            A connection inside the transaction.

        Raises:
            StoreUnavailable: The database is unreachable, or locked for `BUSY_SECONDS`.
            StoreReplaced: Its file was removed or replaced; what was written is rolled back.
        """
        with self._translated(), self.engine.connect() as connection:
            connection.execution_options(**{_WRITE: write})
            if before is not None:
                before(connection)
            elif not write and connection.dialect.name == "postgresql":
                connection.execution_options(isolation_level="AUTOCOMMIT")
            with connection.begin():
                yield connection
                if write:
                    self.check_in_place()

    def check_in_place(self) -> None:
        """Check that an SQLite file is still the one that is open.

        Raises:
            StoreReplaced: It was removed or replaced.
        """
        if self.file is not None:
            self.file.check()

    @contextmanager
    def _translated(self) -> Iterator[None]:
        """Raise StoreUnavailable for what is the database's fault."""
        try:
            yield
        except (DatabaseError, InterfaceError, PoolTimeout) as error:
            if not _is_infrastructure(error):
                raise
            cause = self.without_secrets(_cause(error))
            raise StoreUnavailable(f"database {self.name}: {cause}") from error

    @contextmanager
    def outside_transactions(self) -> Iterator[Connection]:
        """Commit each statement by itself, for those that no transaction may hold.

        Yields:
            A connection.

        Raises:
            StoreUnavailable: As for `transaction`.
        """
        engine = self.engine.execution_options(isolation_level="AUTOCOMMIT")
        with self._translated(), engine.connect() as connection:
            yield connection

    def without_secrets(self, text: str) -> str:
        """Return a driver's message without passwords of the database's URL.

        Args:
            text: The message.
        """
        url = self.engine.url
        secrets = {str(url.password or "")}
        for name, values in url.query.items():
            if name not in HARMLESS:
                secrets |= {values} if isinstance(values, str) else {*values}
        for secret in sorted(secrets - {""}, key=len, reverse=True):
            text = text.replace(secret, "***")
        return text

    def close(self) -> None:
        """Release the pooled connections. Idempotent."""
        self.engine.dispose()


def connect(url: URL, *, for_migration: bool = False) -> Database:
    """An engine for a database; it connects only when it is first used.

    Args:
        url: As `parse_url` has it.
        for_migration: No pool, no limit on the time of statements, and on SQLite no enforcement of
            foreign keys, because a batch migration drops and renames tables that others refer to.

    Returns:
        The database; whoever connects closes it.
    """
    options: dict[str, Any] = {"json_serializer": _strict_json}
    if for_migration:
        options |= {"poolclass": NullPool}
    else:
        # Of idle connections the one that was used last knows most of what is stored.
        options |= {"pool_size": 8, "max_overflow": 24, "pool_timeout": BUSY_SECONDS}
        options |= {"pool_use_lifo": True}
    if url.get_backend_name() == "sqlite":
        engine = _sqlite_engine(url, options, foreign_keys=not for_migration)
        name = url.database or ""
        return Database(engine, name, None if for_migration else OpenFile(name, name, engine))
    server = postgresql_engine(url, options, lock_seconds=BUSY_SECONDS, maintenance=for_migration)
    return Database(server, masked_url(url.render_as_string(hide_password=False)))


def _sqlite_engine(url: URL, options: dict[str, Any], *, foreign_keys: bool) -> Engine:
    # Without an isolation level the driver begins nothing by itself, so that we can say how.
    connect_args = {"isolation_level": None, "timeout": BUSY_SECONDS}
    engine = create_engine(url, connect_args=connect_args, **options)

    @event.listens_for(engine, "connect")
    def _configure(connection: sqlite3.Connection, _record: object) -> None:
        _journal_ahead(connection)
        # One text that is none would else keep all rows of a query from whoever asks for them.
        connection.text_factory = partial(str, encoding="utf-8", errors="replace")
        # An iteration that was acknowledged survives a power cut: WAL alone syncs less often.
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute(f"PRAGMA cache_size = {-_CACHE_KIB}")
        connection.execute(f"PRAGMA foreign_keys = {'ON' if foreign_keys else 'OFF'}")

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        options = connection.get_execution_options()
        if options.get("isolation_level") == "AUTOCOMMIT":
            return
        # A deferred transaction that turns to writing fails at once if another has written since.
        write = options.get(_WRITE, False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if write else "BEGIN DEFERRED")

    return engine


def _journal_ahead(connection: sqlite3.Connection) -> None:
    """Readers and the writer do not block each other. A property of the file, set once."""
    deadline = time.monotonic() + BUSY_SECONDS
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL")
            return
        except sqlite3.OperationalError as error:
            # The busy timeout does not cover the switch while another process makes it too.
            if "locked" not in str(error) or time.monotonic() > deadline:
                raise
            time.sleep(0.01)


def _strict_json(value: object) -> str:
    """JSON as the standard has it (PostgreSQL refuses NaN and Infinity); floats exact to the bit.

    Raises ValueError for a value that is not finite.
    """
    return json.dumps(value, allow_nan=False, separators=(",", ":"))


def check_file(database: Database) -> None:
    """Read an SQLite file anew, for about `CHECK_SECONDS` at most; do nothing for a server.

    Open connections have pages in memory, and the journal others, that the file may have lost.

    Args:
        database: The database.

    Raises:
        StoreUnavailable: The file is damaged, gone, or another one.
    """
    database.check_in_place()
    if database.engine.url.get_backend_name() != "sqlite":
        return
    path = Path(database.engine.url.database or "").absolute()
    deadline = time.monotonic() + CHECK_SECONDS
    try:
        with closing(sqlite3.connect(f"{path.as_uri()}?mode=rw", uri=True)) as connection:
            connection.execute(f"PRAGMA busy_timeout = {round(BUSY_SECONDS * 1000)}")
            connection.set_progress_handler(lambda: time.monotonic() > deadline, 1000)
            (found,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    except sqlite3.DatabaseError as error:
        if "interrupted" in str(error):
            return
        found = str(error)
    if found != "ok":
        raise StoreUnavailable(
            f"database {database.name} was damaged while it was in use: {' '.join(found.split())};"
            " jobs may be lost: put a copy of it in its place"
        )


def _is_infrastructure(error: DatabaseError | InterfaceError | PoolTimeout) -> bool:
    """Whether the database is at fault, and not a statement of ours."""
    # PostgreSQL's InternalError is a server that became read-only or gave a session up, and the
    # bare DatabaseError how the drivers say that a file or an answer is no database's.
    return isinstance(error, (OperationalError, InterfaceError, InternalError, PoolTimeout)) or (
        type(error) is DatabaseError
    )


def _cause(error: DatabaseError | InterfaceError | PoolTimeout) -> str:
    """The driver's own words, without the statement and its parameters."""
    origin = getattr(error, "orig", None)
    text = " ".join(str(origin if origin is not None else error).split())
    if "locked" in text:
        return f"{text}: another process has been writing for {BUSY_SECONDS:g} s; try again"
    if "unable to open" in text:
        return f"{text}: check that its directory exists and that you may write there"
    return text
