"""Notification of changed jobs, whichever process commits them"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final

from sqlalchemy import select

from gaitswarm.services.optimizer.store.engine import Database
from gaitswarm.services.optimizer.store.tables import EXISTING, jobs

_STUCK_SECONDS: Final = 120.0
"""Silence after which the thread counts as stuck; polls may be 60 s apart."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class _Watcher:
    job_id: str
    wake: Callable[[], None]
    poll_seconds: float


class Changes:
    """Changes of jobs. Thread-safe; one thread and one query poll all watched jobs of a process."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._condition = threading.Condition()
        self._watchers: set[_Watcher] = set()
        self._seen: dict[str, Any] = {}
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()
        self._looked = time.monotonic()

    @contextmanager
    def watch(
        self, job_id: str, wake: Callable[[], None], *, poll_seconds: float
    ) -> Iterator[None]:
        """Call a function on each change of a job's state or iterations, inside the block.

        A commit before the block may be reported or not, so read the job inside the block first.
        Several changes may be reported as one, and one that is none may be reported.

        Args:
            job_id: of a job, which need not exist.
            wake: called in another thread; must return at once.
            poll_seconds: longest delay [s].
        """
        watcher = _Watcher(job_id, wake, poll_seconds)
        with self._condition:
            self._watchers.add(watcher)
            if self._thread is None:
                self._looked = time.monotonic()
                self._thread = threading.Thread(target=self._run, name="changes", daemon=True)
                self._thread.start()
            self._condition.notify_all()
        try:
            yield
        finally:
            with self._condition:
                self._watchers.discard(watcher)

    def trouble(self) -> str | None:
        """Return why changes are no longer reported; None if they are."""
        with self._condition:
            if self._thread is None or not self._watchers:
                return None
            if not self._thread.is_alive():
                return "event streams get no news of jobs; restart this process"
            silent = time.monotonic() - self._looked
        if silent < _STUCK_SECONDS:
            return None
        return f"changes of jobs have not been checked for {silent:.0f} s"

    def close(self) -> None:
        """End the thread. Idempotent."""
        with self._condition:
            thread, self._thread = self._thread, None
            self._stop.set()
            self._condition.notify_all()
        if thread is not None:
            thread.join()

    def _run(self) -> None:
        failing = False
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._watchers or self._stop.is_set())
                self._looked = time.monotonic()
            if self._stop.is_set():
                return
            try:
                self._poll()
                failing = False
            except Exception as error:  # noqa: BLE001 - watchers depend on this thread
                if not failing:
                    cause = self._database.without_secrets(str(error))
                    _log.warning("polling for changes of jobs: %s", cause)
                failing = True
            with self._condition:
                if not self._stop.is_set():
                    intervals = [watcher.poll_seconds for watcher in self._watchers]
                    self._condition.wait(min(intervals, default=None))

    def _poll(self) -> None:
        """Wake watchers of jobs that changed since the last poll."""
        with self._condition:
            watched = {watcher.job_id for watcher in self._watchers}
        # The time tells two changes, back and forth, from none.
        names = ("id", "state", "iterations", "waiting", "updated_at")
        query = select(*(jobs.c[name] for name in names)).where(jobs.c.id.in_(watched), EXISTING)
        with self._database.read() as connection:
            rows = connection.execute(query).all()
        states = dict.fromkeys(watched) | {row.id: tuple(row) for row in rows}
        changed = {j for j in watched if j not in self._seen or self._seen[j] != states[j]}
        self._seen = states
        with self._condition:
            watchers = [watcher for watcher in self._watchers if watcher.job_id in changed]
        for watcher in watchers:
            watcher.wake()
