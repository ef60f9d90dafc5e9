"""A process's share of the jobs: claims what is queued and runs several at once."""

from __future__ import annotations

import logging
import threading
from typing import Final

from services.optimizer.errors import StoreUnavailable
from services.optimizer.evaluator import Evaluator
from services.optimizer.job import Claim
from services.optimizer.run_claim import Surroundings, run_claim, runner_name
from services.optimizer.store.base import Store

_STORE_PAUSE: Final = 5.0
"""Seconds until a store that did not answer is asked again."""

_log = logging.getLogger(__name__)


class Runner:
    """Runs up to `concurrency` jobs, each in a thread of its own, from start() to stop().

    poll_seconds: how often the store is asked for a queued job while there is room for one.
    """

    def __init__(
        self,
        store: Store,
        evaluator: Evaluator,
        *,
        concurrency: int = 2,
        lease_seconds: float = 30.0,
        poll_seconds: float = 0.5,
        name: str | None = None,
    ) -> None:
        if concurrency < 1:
            raise ValueError(f"concurrency must be at least 1, it is {concurrency}")
        self._around = Surroundings(store, evaluator, lease_seconds=lease_seconds)
        self._poll_seconds = poll_seconds
        self._name = name or runner_name()
        self._stop = threading.Event()
        self._room = threading.Semaphore(concurrency)
        self._scheduler: threading.Thread | None = None
        self._jobs: set[threading.Thread] = set()

    @property
    def running(self) -> bool:
        """Whether jobs are being claimed."""
        return self._scheduler is not None and self._scheduler.is_alive()

    def start(self) -> None:
        """Begin to claim jobs. Returns at once."""
        if self._scheduler is not None:
            raise RuntimeError("a runner is started once")
        self._scheduler = threading.Thread(target=self._schedule, name="runner", daemon=True)
        self._scheduler.start()

    def stop(self) -> None:
        """Drop the work under way and give its jobs back to the queue. Idempotent."""
        self._stop.set()
        if self._scheduler is not None:
            self._scheduler.join()
        for thread in tuple(self._jobs):
            thread.join()

    def _schedule(self) -> None:
        while not self._stop.is_set():
            if not self._room.acquire(timeout=self._poll_seconds):
                continue
            claim = self._claim()
            if claim is None:
                self._room.release()
                self._stop.wait(self._poll_seconds)
                continue
            thread = threading.Thread(target=self._run, args=(claim,), name=f"job-{claim.job.id}")
            self._jobs = {other for other in self._jobs if other.is_alive()} | {thread}
            thread.start()

    def _claim(self) -> Claim | None:
        try:
            return self._around.store.claim(self._name, lease_seconds=self._around.lease_seconds)
        except StoreUnavailable as error:
            _log.warning("no job can be claimed: %s", error)
        except Exception:  # noqa: BLE001
            # Whatever is wrong with one job must not keep this process from all the others.
            _log.exception("no job can be claimed")
        self._stop.wait(_STORE_PAUSE)
        return None

    def _run(self, claim: Claim) -> None:
        try:
            job = run_claim(claim, self._around, self._stop)
            _log.info("job %s: %s after %d iterations", job.id, job.state, job.progress.iterations)
        except Exception:  # noqa: BLE001
            # The job stays as last committed; whoever claims it next goes on from there.
            _log.exception("job %s: broken off", claim.job.id)
        finally:
            self._room.release()
