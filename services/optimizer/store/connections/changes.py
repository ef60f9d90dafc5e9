"""News of jobs as they are committed, by any process: one thread for all who wait in this one."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from sqlalchemy import Connection, func, select

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.store.connections.engine import Database
from gaitswarm.services.optimizer.store.rows.tables import EXISTING, jobs

_CHANNEL: Final = "gaitswarm_jobs"

_TOLD: Final = frozenset({"state", "iterations", "waiting"})
"""Columns of jobs whose changes are news."""

_GLANCE: Final = 0.5
"""Seconds in which a listener sees that it is to end."""

_LONGEST_SILENCE: Final = 15.0
"""Seconds after which a listener looks for itself, however still it is."""

_Seen = tuple[str, int, str | None]
"""State, committed iterations, and what is waited for."""
_STUCK: Final = 120.0
"""Seconds after which a thread that has not looked is stuck; polls may be 60 s apart."""

_log = logging.getLogger(__name__)


def announce(connection: Connection, job_id: str, columns: frozenset[str]) -> None:
    """Tell listeners of a job's change when the transaction is committed. SQLite has none.

    Args:
        connection: The transaction that changes the job.
        job_id: Of the job.
        columns: Names of what it changes.
    """
    if connection.dialect.name == "postgresql" and not _TOLD.isdisjoint(columns):
        connection.execute(select(func.pg_notify(_CHANNEL, job_id)))


@dataclass(frozen=True, slots=True, eq=False)
class _Watcher:
    """wake: called when the job may have changed; poll_seconds: how late that may be."""

    job_id: str
    wake: Callable[[], None]
    poll_seconds: float


class SqlChanges:
    """`Changes` of a database.

    On PostgreSQL a connection listens for what committing transactions announce, and while there
    is none, jobs are polled; on SQLite they always are. A poll is one query for all jobs that are
    watched.

    Args:
        database: With the newest schema.
    """

    def __init__(self, database: Database) -> None:
        self._database = database
        self._condition = threading.Condition()
        self._watchers: set[_Watcher] = set()
        self._seen: dict[str, _Seen | None] = {}
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()
        self._looked = time.monotonic()

    @contextmanager
    def watch(
        self, job_id: str, wake: Callable[[], None], *, poll_seconds: float
    ) -> Iterator[None]:
        """Call `wake` on each change of a job, inside the block."""
        watcher = _Watcher(job_id, wake, poll_seconds)
        with self._condition:
            self._watchers.add(watcher)
            # A process that follows nothing has no thread for it.
            if self._thread is None:
                self._stop = threading.Event()
                self._looked = time.monotonic()
                run = partial(self._run, self._stop)
                self._thread = threading.Thread(target=run, name="changes", daemon=True)
                self._thread.start()
            self._condition.notify_all()
        try:
            yield
        finally:
            with self._condition:
                self._watchers.discard(watcher)

    def trouble(self) -> str | None:
        """Whether the thread has ended, or is stuck, while somebody waits."""
        with self._condition:
            if self._thread is None or not self._watchers:
                return None
            if not self._thread.is_alive():
                return "event streams get no news of jobs; restart this process"
            silent = time.monotonic() - self._looked
        return None if silent < _STUCK else f"nobody has looked for news of jobs for {silent:.0f} s"

    def close(self) -> None:
        """End the thread; watchers are called no more. Idempotent."""
        with self._condition:
            thread, self._thread = self._thread, None
            self._stop.set()
            self._condition.notify_all()
        if thread is not None:
            thread.join()

    def _run(self, stop: threading.Event) -> None:
        listens = self._database.engine.dialect.name == "postgresql"
        failing = False
        while self._somebody_waits(stop):
            try:
                if listens:
                    self._listen(stop)
                self._poll()
                failing = False
            except Exception as error:  # noqa: BLE001
                # Whatever it is, those who wait must not wait for a thread that has died.
                if not failing:
                    cause = self._database.without_secrets(str(error))
                    _log.warning("changes of jobs are polled for: %s", cause)
                failing = True
                self._poll_if_possible()
            self._pause(stop)

    def _somebody_waits(self, stop: threading.Event) -> bool:
        """Wait for the first watcher; false if there is to be none any more."""
        with self._condition:
            self._condition.wait_for(lambda: self._watchers or stop.is_set())
            self._looked = time.monotonic()
        return not stop.is_set()

    def _pause(self, stop: threading.Event) -> None:
        """Until the next poll, or until another watcher comes."""
        with self._condition:
            if not stop.is_set():
                intervals = [watcher.poll_seconds for watcher in self._watchers]
                self._condition.wait(min(intervals, default=None))

    def _listen(self, stop: threading.Event) -> None:
        """Pass on what is announced until the end, or until the connection is lost (raises)."""
        engine = self._database.engine.execution_options(isolation_level="AUTOCOMMIT")
        with engine.connect() as connection:
            driver: Any = connection.connection.driver_connection
            # It listens until it is closed, so nobody else is to have it.
            connection.detach()
            connection.exec_driver_sql(f"LISTEN {_CHANNEL}")
            # What was committed while nobody listened.
            self._poll()
            looked = time.monotonic()
            while not stop.is_set():
                self._looked = time.monotonic()
                with closing(driver.notifies(timeout=_GLANCE)) as announcements:
                    for announcement in announcements:
                        self._wake({announcement.payload})
                if time.monotonic() - looked > _LONGEST_SILENCE:
                    self._poll()
                    looked = time.monotonic()

    def _poll_if_possible(self) -> None:
        try:
            self._poll()
        except StoreUnavailable as error:
            _log.debug("changes of jobs cannot be polled for: %s", error)

    def _poll(self) -> None:
        """Wake those whose jobs are not as they were at the last poll."""
        with self._condition:
            watched = {watcher.job_id for watcher in self._watchers}
        columns = (jobs.c.id, jobs.c.state, jobs.c.iterations, jobs.c.waiting)
        with self._database.transaction(write=False) as connection:
            query = select(*columns).where(jobs.c.id.in_(watched), EXISTING)
            rows = connection.execute(query).all()
        found: dict[str, _Seen | None] = dict.fromkeys(watched)
        found |= {row.id: (row.state, row.iterations, row.waiting) for row in rows}
        changed = {job for job in watched if job not in self._seen or self._seen[job] != found[job]}
        self._seen = found
        self._wake(changed)

    def _wake(self, changed: set[str]) -> None:
        with self._condition:
            watchers = [watcher for watcher in self._watchers if watcher.job_id in changed]
        for watcher in watchers:
            watcher.wake()
