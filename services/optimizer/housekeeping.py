"""Removal of deleted jobs' rows, expired jobs and old audit entries"""

from __future__ import annotations

import logging
import threading
import time
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Final

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.store.jobs import TRASH

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store

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
