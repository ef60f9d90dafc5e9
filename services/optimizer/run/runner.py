"""A process's share of the queue: claims jobs, and runs several at once.

A runner ends in one of two ways: `drain` lets every job commit its iteration under way, `stop`
drops that. Either gives the jobs back to the queue, where another runner finds them at once.
"""

from __future__ import annotations

import logging
import os
import socket
import threading
import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from gaitswarm.services.optimizer.errors import GaitswarmError, NotFound
from gaitswarm.services.optimizer.jobs.job import QUARANTINE_AFTER, Claim, Job, JobState
from gaitswarm.services.optimizer.jobs.provenance import optimizer_digest
from gaitswarm.services.optimizer.log_context import log_context
from gaitswarm.services.optimizer.run.evaluator import Evaluator
from gaitswarm.services.optimizer.run.execution import Surroundings, run_claim
from gaitswarm.services.optimizer.run.outage import Backoff, Outage, is_infrastructure
from gaitswarm.services.optimizer.store.port.base import Store
from gaitswarm.sim.provenance import simulator_digest

_PAUSES: Final = Backoff(first=0.5, longest=10.0)
"""Between attempts to claim a job while the store, or a thread for the job, is not to be had."""

STUCK_SECONDS: Final = 120.0
"""A runner that has not looked for jobs for so long is stuck: a database that does not answer holds
it up for a fraction of that."""

_LONGEST_CLAIM: Final = 20.0
"""Seconds that the end of a claim under way is waited for."""

_GLANCE: Final = 0.05
"""Seconds between looks at jobs that are drained."""

_log = logging.getLogger(__name__)


def runner_name() -> str:
    """A name for this process that no other one has: host, process id, random."""
    return f"{socket.gethostname()}:{os.getpid()}:{uuid.uuid4().hex[:8]}"


class Runner:
    """Runs up to `concurrency` jobs, each in a thread of its own, from start() to stop()."""

    def __init__(
        self,
        store: Store,
        evaluator: Evaluator,
        *,
        concurrency: int = 2,
        lease_seconds: float = 30.0,
        poll_seconds: float = 0.5,
        cache: bool = False,
        quarantine_after: int = QUARANTINE_AFTER,
        name: str | None = None,
        on_ended: Callable[[Job], object] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        if concurrency < 1:
            raise ValueError(f"concurrency must be at least 1, it is {concurrency}")
        self._around = Surroundings(store, evaluator, lease_seconds=lease_seconds, cache=cache)
        self._poll_seconds = poll_seconds
        self._quarantine_after = quarantine_after
        self._name = name or runner_name()
        self._on_ended = on_ended
        self._clock = clock
        self._drain = threading.Event()
        self._stop = threading.Event()
        self._looked = clock()
        self._room = threading.Semaphore(concurrency)
        self._scheduler: threading.Thread | None = None
        self._jobs: set[threading.Thread] = set()
        self._outage = Outage()

    @property
    def running(self) -> bool:
        """Whether jobs are being claimed, as from start() to drain() or stop() they should be."""
        return self._scheduler is not None and self._scheduler.is_alive()

    def trouble(self) -> str | None:
        """Why no jobs are claimed although they should be; None if they are."""
        if self._scheduler is None or self._drain.is_set() or self._stop.is_set():
            return None
        if not self.running:
            return "it has ended and runs no more jobs; restart this process"
        silent = self._clock() - self._looked
        if silent > STUCK_SECONDS:
            return f"it has not looked for jobs for {silent:.0f} s; restart it if that stays"
        return None

    def start(self) -> None:
        """Begin to claim jobs. Returns at once."""
        if self._scheduler is not None:
            raise RuntimeError("a runner is started once")
        # Now, while the files are those that were imported.
        simulator_digest()
        optimizer_digest()
        self._scheduler = threading.Thread(target=self._schedule, name="runner", daemon=True)
        self._scheduler.start()

    def drain(self, seconds: float, at_once: threading.Event | None = None) -> None:
        """Let every job commit its iteration under way, and give it back to the queue; then stop"""
        hurry = at_once or threading.Event()
        self._drain.set()
        until = self._clock() + seconds
        while (left := until - self._clock()) > 0.0 and self._busy:
            if hurry.wait(min(left, _GLANCE)):
                break
        self.stop()

    def stop(self) -> None:
        """Drop the work under way and give its jobs back to the queue. Idempotent."""
        self._drain.set()
        self._stop.set()
        if self._scheduler is not None:
            # A database that never answers must not keep the process from ending.
            self._scheduler.join(timeout=_LONGEST_CLAIM)
        for thread in tuple(self._jobs):
            thread.join()

    @property
    def _busy(self) -> bool:
        return self.running or any(thread.is_alive() for thread in tuple(self._jobs))

    def _schedule(self) -> None:
        while not self._drain.is_set():
            self._looked = self._clock()
            if not self._room.acquire(timeout=self._poll_seconds):
                continue
            claim = self._claim()
            if claim is None or not self._started(claim):
                self._room.release()
                self._drain.wait(self._poll_seconds)

    def _started(self, claim: Claim) -> bool:
        """Run a job in a thread of its own; false if it is given back to the queue."""
        thread = threading.Thread(target=self._run, args=(claim,), name=f"job-{claim.job.id}")
        if self._drain.is_set():
            self._give_back(claim)
            return False
        try:
            thread.start()
        except RuntimeError as error:
            # This machine has no thread left for it.
            self._give_back(claim)
            self._pause(f"job {claim.job.id} goes back to the queue: {error}")
            return False
        self._outage.ended()
        self._jobs = {other for other in self._jobs if other.is_alive()} | {thread}
        return True

    def _give_back(self, claim: Claim) -> None:
        with suppress(GaitswarmError):
            self._around.store.release(claim, JobState.QUEUED)

    def _claim(self) -> Claim | None:
        try:
            claim = self._around.store.claim(
                self._name,
                lease_seconds=self._around.lease_seconds,
                quarantine_after=self._quarantine_after,
            )
        except Exception as error:  # noqa: BLE001
            if not is_infrastructure(error):
                # Whatever is wrong with one job must not keep this process from all the others.
                _log.exception("no job can be claimed")
            self._pause(f"no job can be claimed: {error}")
            return None
        if claim is None:
            self._outage.ended()
        return claim

    def _pause(self, reason: str) -> None:
        """Until the next attempt; one line of the log for each outage."""
        if self._outage.failed(reason):
            _log.warning("%s; tried again until it can be", reason)
        self._drain.wait(_PAUSES.pause(self._outage.failures))

    def _run(self, claim: Claim) -> None:
        with log_context(job=claim.job.id):
            self._run_job(claim)

    def _run_job(self, claim: Claim) -> None:
        # The job stays as last committed; whoever claims it next goes on from there.
        try:
            job = run_claim(claim, self._around, self._stop, self._drain)
            _log.info("job %s: %s after %d iterations", job.id, job.state, job.progress.iterations)
            if self._on_ended is not None and not self._stop.is_set():
                self._on_ended(job)
        except NotFound as error:
            _log.info("job %s was deleted: %s", claim.job.id, error)
        except Exception as error:  # noqa: BLE001
            if is_infrastructure(error):
                _log.warning("job %s: broken off: %s", claim.job.id, error)
            else:
                _log.exception("job %s: broken off", claim.job.id)
        finally:
            self._room.release()
