"""Runners, which claim jobs, run several concurrently and return them to the queue at their end"""

from __future__ import annotations

import logging
import os
import socket
import threading
import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from gaitswarm.services.optimizer.errors import (
    GaitswarmError,
    LeaseLost,
    NotFound,
    StoreUnavailable,
)
from gaitswarm.services.optimizer.jobs.iteration import Iteration
from gaitswarm.services.optimizer.jobs.job import QUARANTINE_AFTER, Claim, Job, JobState
from gaitswarm.services.optimizer.jobs.listing import Page, every
from gaitswarm.services.optimizer.jobs.provenance import optimizer_digest
from gaitswarm.services.optimizer.log_context import log_context
from gaitswarm.services.optimizer.run import execution
from gaitswarm.services.optimizer.run.evaluator import EvaluationStopped, Evaluator
from gaitswarm.services.optimizer.run.outage import Backoff, Outage, is_infrastructure
from gaitswarm.sim.provenance import simulator_digest

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store

_PAUSES: Final = Backoff(first=0.5, longest=10.0)
"""Between attempts to claim a job while the store or a thread is unavailable."""

STUCK_SECONDS: Final = 120.0
"""Time without polling after which a runner counts as stuck; an unavailable database blocks it for
a fraction of that.
"""

_LONGEST_CLAIM: Final = 20.0
"""Time to wait for a claim in progress when stopping [s]."""

_GLANCE: Final = 0.05
"""Poll interval of jobs that are drained [s]."""

_log = logging.getLogger(__name__)


def runner_name() -> str:
    """Return a unique name for this process: host, process id, random."""
    return f"{socket.gethostname()}:{os.getpid()}:{uuid.uuid4().hex[:8]}"


@dataclass(eq=False)
class Runner:
    """Runs up to `concurrency` jobs, each in its own thread, from start() to stop()."""

    store: Store
    evaluator: Evaluator
    concurrency: int = 2
    lease_seconds: float = 30.0
    poll_seconds: float = 0.5
    cache: bool = False
    quarantine_after: int = QUARANTINE_AFTER
    name: str = field(default_factory=runner_name)
    on_ended: Callable[[Job], object] | None = None
    clock: Callable[[], float] = time.monotonic

    def __post_init__(self) -> None:
        if self.concurrency < 1:
            raise ValueError(f"concurrency must be at least 1, it is {self.concurrency}")
        self._drain = threading.Event()
        self._stop = threading.Event()
        self._polled_at = self.clock()
        self._room = threading.Semaphore(self.concurrency)
        self._scheduler: threading.Thread | None = None
        self._jobs: set[threading.Thread] = set()
        self._outage = Outage()

    @property
    def running(self) -> bool:
        return self._scheduler is not None and self._scheduler.is_alive()

    def trouble(self) -> str | None:
        """Return why no jobs are claimed although they should be; None if they are."""
        if self._scheduler is None or self._drain.is_set() or self._stop.is_set():
            return None
        if not self.running:
            return "it has ended and runs no more jobs; restart this process"
        silent = self.clock() - self._polled_at
        if silent > STUCK_SECONDS:
            return f"it has not polled for jobs for {silent:.0f} s; restart it if this persists"
        return None

    def start(self) -> None:
        """Start claiming jobs. Returns at once."""
        if self._scheduler is not None:
            raise RuntimeError("a runner can be started only once")
        # While the files are still those that were imported.
        simulator_digest()
        optimizer_digest()
        self._scheduler = threading.Thread(target=self._schedule, name="runner", daemon=True)
        self._scheduler.start()

    def drain(self, seconds: float, at_once: threading.Event | None = None) -> None:
        """Let every job commit its iteration in progress and return to the queue, then stop."""
        hurry = at_once or threading.Event()
        self._drain.set()
        until = self.clock() + seconds
        while (left := until - self.clock()) > 0.0 and self._busy:
            if hurry.wait(min(left, _GLANCE)):
                break
        self.stop()

    def stop(self) -> None:
        """Drop work in progress and return the jobs to the queue. Idempotent."""
        self._drain.set()
        self._stop.set()
        if self._scheduler is not None:
            # A database that never answers must not block the process.
            self._scheduler.join(timeout=_LONGEST_CLAIM)
        for thread in tuple(self._jobs):
            thread.join()

    @property
    def _busy(self) -> bool:
        return self.running or any(thread.is_alive() for thread in tuple(self._jobs))

    def _schedule(self) -> None:
        while not self._drain.is_set():
            self._polled_at = self.clock()
            if not self._room.acquire(timeout=self.poll_seconds):
                continue
            claim = self._claim()
            if claim is None or not self._started(claim):
                self._room.release()
                self._drain.wait(self.poll_seconds)

    def _started(self, claim: Claim) -> bool:
        """Run a job in its own thread; False if it was returned to the queue."""
        thread = threading.Thread(target=self._run, args=(claim,), name=f"job-{claim.job.id}")
        if self._drain.is_set():
            self._give_back(claim)
            return False
        try:
            thread.start()
        except RuntimeError as error:
            # The system refuses another thread.
            self._give_back(claim)
            self._pause(f"job {claim.job.id} returns to the queue: {error}")
            return False
        self._outage.ended()
        self._jobs = {other for other in self._jobs if other.is_alive()} | {thread}
        return True

    def _give_back(self, claim: Claim) -> None:
        with suppress(GaitswarmError):
            self.store.release(claim, JobState.QUEUED)

    def _claim(self) -> Claim | None:
        try:
            claim = self.store.claim(
                self.name,
                lease_seconds=self.lease_seconds,
                quarantine_after=self.quarantine_after,
            )
        except Exception as error:  # noqa: BLE001
            if not is_infrastructure(error):
                # A fault of one job must not block the others.
                _log.exception("cannot claim a job")
            self._pause(f"cannot claim a job: {error}")
            return None
        if claim is None:
            self._outage.ended()
        return claim

    def _pause(self, reason: str) -> None:
        """Wait for the next attempt; log the first failure of each outage."""
        if self._outage.failed(reason):
            _log.warning("%s; retrying", reason)
        self._drain.wait(_PAUSES.pause(self._outage.failures))

    def _run(self, claim: Claim) -> None:
        # The job stays as last committed; the next claim continues from there.
        with log_context(job=claim.job.id):
            try:
                context = execution.RunContext(
                    self.store, self.evaluator, lease_seconds=self.lease_seconds, cache=self.cache
                )
                job = execution.run_claim(claim, context, self._stop, self._drain)
                iterations = job.progress.iterations
                _log.info("job %s: %s after %d iterations", job.id, job.state, iterations)
                if self.on_ended is not None and not self._stop.is_set():
                    self.on_ended(job)
            except NotFound as error:
                _log.info("job %s was deleted: %s", claim.job.id, error)
            except Exception as error:  # noqa: BLE001
                if is_infrastructure(error):
                    _log.warning("job %s: interrupted: %s", claim.job.id, error)
                else:
                    _log.exception("job %s: interrupted", claim.job.id)
            finally:
                self._room.release()


EMBEDDED_LEASE_SECONDS: Final = 5.0
"""Short, because a user waits for its end when the previous process was killed."""

OnIteration = Callable[[Iteration], None]
"""Called for each committed iteration, by this process or another one, once and in order."""

OnNews = Callable[[str], None]
"""Called with a message for people when another process takes or releases the job."""

_POLL_SECONDS: Final = 0.5
"""Poll interval of a job that another process holds."""

_UNDER_WAY: Final = (JobState.QUEUED, JobState.RUNNING, JobState.PAUSING)

_HELD: Final = "another process runs this job, or was killed while running it; following it"

_LOST: Final = (
    f"this process lost its lease after {EMBEDDED_LEASE_SECONDS:g} s without contact, and another"
    " process has taken the job over"
)

_TAKEN: Final = f"{_LOST}; following it there"

_FREE: Final = "no other process holds the job now; continuing it here"


def run_embedded(  # noqa: C901 - one loop
    store: Store,
    evaluator: Evaluator | Callable[[], Evaluator],
    job: str | Claim,
    *,
    on_iteration: OnIteration | None = None,
    on_retry: execution.OnRetry | None = None,
    on_news: OnNews | None = None,
    stop: threading.Event | None = None,
    accepts_changes: bool = False,
    cache: bool = False,
    followed_iterations: int | None = None,
) -> Job:
    """Run one job until it ends or is paused; return immediately if it has."""
    claim = None if isinstance(job, str) else job
    latest = store.job(job) if isinstance(job, str) else job.job
    job_id = latest.id
    runner = runner_name() if claim is None else claim.runner
    stop = stop or threading.Event()
    seen = (latest.progress.iterations if followed_iterations is None else followed_iterations) - 1
    tell, news, following = on_news or (lambda _: None), _HELD, False

    def later(_: object) -> Page[Iteration]:
        return store.iterations(job_id, after=seen)

    def catch_up() -> None:
        nonlocal seen
        for iteration in every(later):
            seen = iteration.index
            if on_iteration is not None:
                on_iteration(iteration)

    def committed(*_: object) -> None:
        # One that cannot be read now is reported with the next.
        with suppress(StoreUnavailable):
            catch_up()

    while latest.state in _UNDER_WAY and not stop.is_set():
        claim = claim or store.claim(runner, lease_seconds=EMBEDDED_LEASE_SECONDS, job_id=job_id)
        if claim is None:
            # The job first: the iterations read next include all that it counts.
            latest = store.job(job_id)
            if latest.state in _UNDER_WAY and not following:
                tell(news)
                following = True
            catch_up()
            if latest.state in _UNDER_WAY:
                _pause(stop)
            continue
        catch_up()
        if following:
            tell(_FREE)
        try:
            opened = _opened(store, evaluator, claim) if callable(evaluator) else evaluator
        except EvaluationStopped:
            latest, claim = store.job(job_id), None
            continue
        context = execution.RunContext(
            store,
            opened,
            lease_seconds=EMBEDDED_LEASE_SECONDS,
            on_commit=committed,
            on_retry=on_retry,
            accepts_changes=accepts_changes,
            cache=cache,
        )
        latest, claim = execution.run_claim(claim, context, stop), None
        # A new holder has taken the job from this process.
        news, following = _TAKEN, False
    if claim is not None:
        with suppress(LeaseLost):
            store.release(claim, JobState.QUEUED)
        latest = store.job(job_id)
    if latest.state.terminal:
        if seen + 1 < latest.progress.iterations:
            # The lease was lost, and the job ended elsewhere before the next poll.
            tell(_LOST)
            catch_up()
        store.verify()
    return latest


def _opened(store: Store, evaluator: Callable[[], Evaluator], claim: Claim) -> Evaluator:
    """Open the evaluator, keeping the lease meanwhile; queue the job on failure."""
    try:
        with execution.Heartbeat(store, claim, lease_seconds=EMBEDDED_LEASE_SECONDS):
            return evaluator()
    except BaseException:
        with suppress(GaitswarmError):
            store.release(claim, JobState.QUEUED)
        raise


def _pause(stop: threading.Event) -> None:
    # `stop.wait` would hold the lock that a signal handler takes to set `stop`.
    until = time.monotonic() + _POLL_SECONDS
    while time.monotonic() < until and not stop.is_set():
        time.sleep(_GLANCE)
