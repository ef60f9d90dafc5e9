"""Heartbeats: renewal of a lease, and detection of users' commands"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, Self

from gaitswarm.services.optimizer.errors import LeaseLost
from gaitswarm.services.optimizer.jobs.job import Claim
from gaitswarm.services.optimizer.log_context import log_context
from gaitswarm.services.optimizer.run.outage import Outage, is_infrastructure

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store

_BEATS_PER_LEASE: Final = 3
_LONGEST_INTERVAL: Final = 1.0
"""Longest time to notice a cancellation or a pause [s]."""

_log = logging.getLogger(__name__)


class Heartbeat:
    """Renews a claim from its own thread, inside the `with` block.

    An unavailable store is retried indefinitely: it rejects writes under a claim that another
    runner has taken over meanwhile.
    """

    def __init__(
        self,
        store: Store,
        claim: Claim,
        *,
        lease_seconds: float,
        waiting: Callable[[], str | None] = lambda: None,
        outage: Outage | None = None,
        after_beat: Callable[[], None] = lambda: None,
    ) -> None:
        self._store = store
        self._claim = claim
        self._lease_seconds = lease_seconds
        self._waiting = waiting
        self._outage = outage or Outage()
        self._after_beat = after_beat
        self._interval = min(lease_seconds / _BEATS_PER_LEASE, _LONGEST_INTERVAL)
        self._ended = threading.Event()
        self._lost = threading.Event()
        # As of the last beat.
        self.state, self.priority = claim.job.state, claim.job.priority
        self._thread = threading.Thread(
            target=self._beat_of_job, name=f"heartbeat-{claim.job.id}", daemon=True
        )

    @property
    def lost(self) -> bool:
        """Whether the job was cancelled, or belongs to another runner."""
        return self._lost.is_set()

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _beat_of_job(self) -> None:
        with log_context(job=self._claim.job.id):
            self._beat()

    def _beat(self) -> None:
        failed = False
        while not self._ended.wait(self._interval):
            try:
                renewal = self._store.renew(
                    self._claim, lease_seconds=self._lease_seconds, waiting=self._waiting()
                )
                self.state, self.priority = renewal.state, renewal.priority
                self._after_beat()
            except LeaseLost as error:
                # A commit that ends the job releases the lease between two beats.
                if not self._ended.is_set():
                    _log.info("job %s: %s", self._claim.job.id, error)
                self._lost.set()
                return
            except Exception as error:
                if not is_infrastructure(error):
                    raise
                failed = True
                if self._outage.failed(str(error)):
                    _log.warning("job %s: no heartbeat: %s", self._claim.job.id, error)
            else:
                # A beat sent before another access failed does not end its outage.
                if failed:
                    self._outage.ended()
                failed = False
