"""Storage of jobs, iterations, recordings, tokens and notifications with SQLAlchemy"""

from __future__ import annotations

from gaitswarm.services.optimizer.store.changes import Changes
from gaitswarm.services.optimizer.store.engine import (
    Clock,
    Database,
    Observer,
    check_file_system,
    database_time,
    parse_url,
)
from gaitswarm.services.optimizer.store.history import History
from gaitswarm.services.optimizer.store.job_list import JobList
from gaitswarm.services.optimizer.store.jobs import Jobs
from gaitswarm.services.optimizer.store.leases import Leases
from gaitswarm.services.optimizer.store.outbox import Outbox
from gaitswarm.services.optimizer.store.recordings import Recordings
from gaitswarm.services.optimizer.store.schema import admit, check_revision, create
from gaitswarm.services.optimizer.store.tokens import Audit, Tokens


class Store(Jobs, JobList, Leases, History, Recordings, Audit):
    """A database of jobs. Thread-safe.

    Every method is one transaction, which happens wholly or not at all, unless it says that it uses
    several. Methods that take an id raise NotFound for an unknown one; those that take a claim
    raise LeaseLost, and change nothing, if its fencing token is not the job's. All raise
    StoreUnavailable if the database cannot be used, and writes StoreReplaced if its file was
    removed or replaced.

    Attributes:
        tokens: access tokens.
        outbox: notifications about ended jobs.
        changes: changes of jobs, by any process.
        observers: told what this process does with the store.

    Args:
        database: of the newest schema; closed with the store.
        clock: time of all that is stored; only tests need another than the database's, which all
            processes share.
    """

    def __init__(self, database: Database, *, clock: Clock = database_time) -> None:
        super().__init__(database, clock)
        self.tokens = Tokens(database, clock)
        self.outbox = Outbox(database, clock)
        self.changes = Changes(database)
        self.observers: list[Observer] = database.observers

    def ping(self) -> None:
        """Raise StoreUnavailable unless the database answers and has this version's schema."""
        check_revision(self._database, "ping")
        self._database.check_in_place()

    def verify(self) -> None:
        """Read the stored file again, for seconds at most. Raises StoreUnavailable if damaged."""
        self._database.check_pages()

    def close(self) -> None:
        """Close all connections. Idempotent."""
        self.changes.close()
        self._database.close()


def open_store(url: str, *, clock: Clock = database_time) -> Store:
    """Open a database of the newest schema; create an SQLite file, or tables in an empty database.

    Args:
        url: `sqlite:///path`, a bare path, or `postgresql://user:password@host/database`.
        clock: as for `Store`.

    Returns:
        The store, to be closed by the caller.

    Raises:
        StoreUnavailable: the database cannot be used.
    """
    parsed = parse_url(url)
    check_file_system(parsed)
    create(parsed)
    database = Database(parsed)
    admit(database)
    return Store(database, clock=clock)


__all__ = ["Observer", "Store", "open_store"]
