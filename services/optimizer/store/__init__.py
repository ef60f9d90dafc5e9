"""Storage of jobs, iterations, recordings, tokens and notifications with SQLAlchemy"""

from __future__ import annotations

from gaitswarm.services.optimizer.store.changes import Changes
from gaitswarm.services.optimizer.store.engine import (
    Clock,
    Database,
    Observer,
    database_time,
    parse_url,
)
from gaitswarm.services.optimizer.store.history import History
from gaitswarm.services.optimizer.store.jobs import Jobs
from gaitswarm.services.optimizer.store.leases import Leases
from gaitswarm.services.optimizer.store.outbox import Outbox
from gaitswarm.services.optimizer.store.recordings import Recordings
from gaitswarm.services.optimizer.store.schema import admit, check_revision, create
from gaitswarm.services.optimizer.store.tokens import Audit, Tokens


class Store(Jobs, Leases, History, Recordings, Audit):
    """A database of jobs. Thread-safe.

    A method is one transaction, which happens wholly or not at all, unless it says that it uses
    several. All raise StoreUnavailable if the database cannot be used, and writes StoreReplaced if
    its file was removed or replaced.

    Arguments of several methods:
        job_id: of a job; NotFound if there is none.
        claim: on a job. LeaseLost, and nothing is changed, unless its fencing token is the job's; a
            lease that has expired but was not taken over is still valid.
        first, last: index of the first iteration of a range, and index after its last.
        after: `next` of the page before; InvalidRequest for any other text.
        limit: maximum number of items of a page; InvalidRequest if it is less than 1.
        search: part of a name or id and of what else a list shows as text, in any case.
        archived: only jobs that are archived, or that are not; None for both.
        spec: resolved before it is stored.
        provenance: of the results; None if a runner is to record it.
        seconds: simulated time of the whole budget [s]; None if unknown.
        priority: within bounds; higher ones are claimed first.
        iterations: total budget.
        change, reference: new value.
        kept: whether deletion is refused.
        runner: name of a runner, unique to its process.
        lease_seconds: duration of a lease from now on, at most `LONGEST_LEASE_SECONDS` [s].
        actor: name of a token, or `LOCAL`, for the audit log.
        quota: limit on what the owner has unfinished; QuotaExceeded beyond it.
        iteration: index of the iteration, from 0.
        state: only jobs in it; of a released job failed, paused, or queued, where a pausing one
            becomes paused.
        where, reverse: further criteria, and whether to reverse the order.
        idempotency_key: a repeated request with it creates no second job.
        command, accept_changes: to apply, and whether a resumed job may continue under a changed
            provenance.
        moment: aware time before which entries were added, or jobs ended.
        states: in which they ended.
        older_than: time since the deletion.
        should_stop: called between transactions; if true, the rest is left to a later call.
        quarantine_after: consecutive crashes after which a job fails.
        waiting, error: reason for waiting or failing, for users; None for neither.
        ask: designs to evaluate.
        done, following: the iteration, and the next ask; None at the end of the budget.
        entries, journaled: of different tasks; whether to clear the journal.
        keys: from `walk_keys`.
        walk, ids: to store; of the walks.
        taken, final: notification of an attempt, and whether to give up now.
        name, scope: of a token; a new name was never used, not by a revoked token either.
        secret: of a token.

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
        self.observers: list[Observer] = database.observers  # of this process's transactions

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

    url: `sqlite:///path`, a bare path, or `postgresql://user:password@host/database`. The caller
    closes the store. Raises StoreUnavailable if the database cannot be used.
    """
    parsed = parse_url(url)
    create(parsed)
    database = Database(parsed)
    admit(database)
    return Store(database, clock=clock)


__all__ = ["Observer", "Store", "open_store"]
