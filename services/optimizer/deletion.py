"""What becomes of jobs that nobody needs any more: deletion on request, and after a time."""

from __future__ import annotations

import logging
import threading
from datetime import UTC, datetime, timedelta
from typing import Final

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.audit import LOCAL
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.store.port.base import Store

_SECONDS_PER_ROUND: Final = 10.0
_ROUNDS_PER_RETENTION: Final = 360

_log = logging.getLogger(__name__)


class Deletion:
    """Deletes jobs, or protects them from that. Thread-safe, as the store is."""

    __slots__ = ()

    store: Store

    def keep(self, job_id: str, kept: bool, *, actor: str = LOCAL) -> Job:
        """Protect a job from deletion, or release it."""
        return self.store.keep(job_id, kept, actor=actor)

    def delete(self, job_id: str, *, actor: str = LOCAL) -> None:
        """Delete a job with all that it has committed.

        It is gone for everybody when this returns. `Store.purge_deleted`, which housekeeping calls,
        removes what is left of the rows of a long one.
        """
        self.store.delete_job(job_id, actor=actor)


class Housekeeping:
    """Removes rows of deleted jobs, and what is older than it is kept, in a thread of its own."""

    def __init__(
        self,
        store: Store,
        retention_days: float | None = None,
        audit_days: float | None = None,
    ) -> None:
        self._store = store
        self._retention = None if retention_days is None else timedelta(days=retention_days)
        self._audited = None if audit_days is None else timedelta(days=audit_days)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._rounds, name="housekeeping", daemon=True)

    def start(self) -> None:
        """Begin with a first round. Returns at once."""
        self._thread.start()

    def stop(self) -> None:
        """Leave the rest for the next time. Idempotent."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join()

    def round(self, *, retention: bool = True) -> None:
        """Do what is to be done now."""
        if retention and self._retention is not None:
            deleted = self._store.delete_ended_before(datetime.now(UTC) - self._retention)
            for job_id in deleted:
                _log.info("job %s is deleted: it ended more than %s ago", job_id, self._retention)
        if retention and self._audited is not None:
            removed = self._store.forget_audit_before(datetime.now(UTC) - self._audited)
            if removed:
                _log.info(
                    "%d entries of the audit log are removed: older than %s", removed, self._audited
                )
        self._store.purge_deleted(self._stop.is_set)

    def _rounds(self) -> None:
        number = 0
        while not self._stop.is_set():
            try:
                self.round(retention=number % _ROUNDS_PER_RETENTION == 0)
            except StoreUnavailable as error:
                _log.warning("deleted jobs are not removed yet: %s", error)
            except Exception:  # noqa: BLE001
                _log.exception("deleted jobs are not removed yet")
            number += 1
            self._stop.wait(_SECONDS_PER_ROUND)
