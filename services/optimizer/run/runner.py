"""Runs claimed jobs: a shell around the coordinator, and a process's share of the queue.

`run_claim` executes the coordinator's actions with store, evaluator and heartbeat; `Runner` claims
what is queued and runs several jobs at once.
"""

from __future__ import annotations

import logging
import os
import socket
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Final, TypeVar

from services.optimizer.errors import (
    BudgetChanged,
    EvaluatorUnavailable,
    GaitswarmError,
    LeaseLost,
    ProvenanceChanged,
    StoreUnavailable,
)
from services.optimizer.jobs.iteration import CompletedIteration
from services.optimizer.jobs.job import Claim, Job, JobState
from services.optimizer.jobs.provenance import (
    JobProvenance,
    job_provenance,
    optimizer_digest,
)
from services.optimizer.jobs.spec import Spec
from services.optimizer.run.coordinator import Backoff, Coordination, Phase, handle
from services.optimizer.run.economy import evaluate_unknown
from services.optimizer.run.evaluator import EvaluationRequest, EvaluationStopped, Evaluator
from services.optimizer.run.events import (
    Action,
    Begin,
    Claimed,
    Commit,
    Committed,
    Evaluate,
    Evaluated,
    EvaluationFailed,
    EvaluatorLost,
    Event,
    Extended,
    LeaseWasLost,
    PauseSeen,
    Record,
    Release,
    StopRequested,
    Wait,
    Waited,
)
from services.optimizer.run.heartbeat import Heartbeat
from services.optimizer.store.base import Store
from sim.provenance import simulator_digest

OnCommit = Callable[[CompletedIteration, JobState], None]
"""Called after an iteration is stored, in the thread that runs the job."""

OnRetry = Callable[[float, str], None]
"""Called before a wait for the workers: seconds to wait, and why."""

_GLANCE: Final = 0.1
"""Seconds between looks at what has changed, while waiting."""

_STORE_PAUSE: Final = 5.0
"""Seconds until a store that did not answer is asked again."""

_FIRST_STORE_PAUSE: Final = 0.1
"""The first of several pauses, each twice as long, while an iteration waits to be stored."""

T = TypeVar("T")

_log = logging.getLogger(__name__)


def runner_name() -> str:
    """A name for this process that no other one has: host, process id, random."""
    return f"{socket.gethostname()}:{os.getpid()}:{uuid.uuid4().hex[:8]}"


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a run needs beside its job.

    Attributes:
        store: Where the job is kept.
        evaluator: Where its walks run.
        lease_seconds: After so long without a word from here another runner takes the job over [s].
        backoff: How to wait for workers that cannot be reached.
        on_commit: Called after an iteration that was stored.
        on_retry: Called before a wait for the workers.
        provenance: Of what is computed from here for a spec.
        accepts_changes: Whether the job goes on although that has changed.
        cache: Whether a design is walked only if no job has walked it before.
        clock: Monotonic time [s]; replaced in tests.
        sleep: Lets seconds pass; replaced in tests.
    """

    store: Store
    evaluator: Evaluator
    lease_seconds: float = 30.0
    backoff: Backoff = field(default_factory=Backoff)
    on_commit: OnCommit | None = None
    on_retry: OnRetry | None = None
    provenance: Callable[[Spec], JobProvenance] = job_provenance
    accepts_changes: bool = False
    cache: bool = False
    clock: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep


def run_claim(claim: Claim, around: Surroundings, stop: threading.Event | None = None) -> Job:
    """Run a claimed job until it ends, is paused, or is no longer ours.

    A store that does not answer is tried again as long as the lease can be held.

    Args:
        claim: On the job.
        around: What the run needs beside it.
        stop: When set, work under way is dropped and the job is given back to the queue. So it is
            when `on_commit` raises, which is passed on.

    Returns:
        The job as it is then.

    Raises:
        StoreUnavailable: The store does not answer in the end; the job then stays as last
            committed, and is taken up again when its lease has run out.
    """
    heartbeat = Heartbeat(
        around.store, claim, lease_seconds=around.lease_seconds, clock=around.clock
    )
    run = _Run(claim, around, heartbeat, stop or threading.Event())
    with heartbeat:
        try:
            state, actions = _begin(claim, around)
            while actions:
                state, actions = _decide(state, run.execute(actions))
        except StoreUnavailable:
            raise
        except BaseException:
            with suppress(GaitswarmError):
                around.store.release(claim, JobState.QUEUED)
            raise
    return around.store.job(claim.job.id)


def _begin(claim: Claim, around: Surroundings) -> tuple[Coordination, tuple[Action, ...]]:
    """What to do first; a job whose robot cannot be read fails, as in `_decide`."""
    state = Coordination(backoff=around.backoff)
    try:
        here = around.provenance(claim.job.spec)
    except Exception as error:  # noqa: BLE001
        return _fail(state, error, f"job {claim.job.id}: its provenance cannot be told")
    return _decide(state, Claimed(claim, here, around.accepts_changes))


def _decide(state: Coordination, event: Event) -> tuple[Coordination, tuple[Action, ...]]:
    """As `handle`; a job that it cannot handle fails, or it would be claimed over and over."""
    try:
        return handle(state, event)
    except Exception as error:  # noqa: BLE001
        return _fail(state, error, f"a job cannot go on after {type(event).__name__}")


def _fail(
    state: Coordination, error: Exception, what: str
) -> tuple[Coordination, tuple[Action, ...]]:
    _log.exception(what)
    failed = Release(JobState.FAILED, f"internal error: {type(error).__name__}: {error}")
    return replace(state, phase=Phase.ENDED), (failed,)


@dataclass(slots=True)
class _Run:
    """claim: that of the heartbeat, its job as it was when it was last read."""

    claim: Claim
    around: Surroundings
    heartbeat: Heartbeat
    stop: threading.Event

    def execute(self, actions: tuple[Action, ...]) -> Event:
        """Do them in order; the event that answers the last, or the one that broke off."""
        try:
            return self._do_all(actions)
        except LeaseLost:
            return LeaseWasLost()
        except EvaluationStopped:
            return LeaseWasLost() if self.heartbeat.lost else StopRequested()

    def _do_all(self, actions: tuple[Action, ...]) -> Event:
        answer: Event | None = None
        try:
            for action in actions:
                answer = self._do(action)
        except BudgetChanged:
            job = self._stored(lambda: self.around.store.job(self.claim.job.id))
            self.claim = replace(self.claim, job=job)
            return Extended(job)
        if answer is None:
            raise AssertionError("the last of the coordinator's actions has no answer")
        return answer

    def _do(self, action: Action) -> Event | None:
        match action:
            case Record(provenance=provenance):
                self._stored(lambda: self.around.store.record_provenance(self.claim, provenance))
                return None
            case Begin(ask=ask):
                self._stored(lambda: self.around.store.begin(self.claim, ask))
                return None
            case Evaluate(request=request, keys=keys):
                return self._evaluate(request, keys)
            case Commit(done=done, following=following):
                state = self._stored(lambda: self.around.store.commit(self.claim, done, following))
                if self.around.on_commit is not None:
                    self.around.on_commit(done, state)
                return Committed(state)
            case Wait(seconds=seconds, reason=reason):
                return self._wait(seconds, reason)
            case Release(state=state, error=error):
                self._stored(lambda: self.around.store.release(self.claim, state, error=error))
                return LeaseWasLost()

    def _evaluate(self, request: EvaluationRequest, keys: tuple[bytes, ...]) -> Event:
        if self._should_stop():
            raise EvaluationStopped
        begun = self.around.clock()
        try:
            outcomes, walked = evaluate_unknown(
                self.around.evaluator,
                self.around.store if self.around.cache else None,
                request,
                keys,
                self._should_stop,
            )
        except EvaluationStopped:
            raise
        except EvaluatorUnavailable as error:
            return EvaluatorLost(str(error))
        except ProvenanceChanged as error:
            _log.warning("job %s: %s", request.job_id, error)
            return EvaluationFailed(str(error))
        except Exception as error:  # noqa: BLE001
            _log.exception("job %s: the evaluation failed", request.job_id)
            return EvaluationFailed(f"the simulation failed: {type(error).__name__}: {error}")
        return Evaluated(outcomes, self.around.clock() - begun, walked)

    def _wait(self, seconds: float, reason: str) -> Event:
        _log.warning(
            "job %s: workers unavailable, again in %.0f s: %s", self.claim.job.id, seconds, reason
        )
        if self.around.on_retry is not None:
            self.around.on_retry(seconds, reason)
        for _ in self._glances(seconds):
            if self.heartbeat.state is JobState.PAUSING:
                return PauseSeen()
        return Waited()

    def _stored(self, access: Callable[[], T]) -> T:
        """What the store answers, however long it takes: an evaluated iteration is expensive.

        Raises EvaluationStopped when the process is to end, or the lease cannot be held any longer.
        """
        seconds = _FIRST_STORE_PAUSE
        while True:
            try:
                return access()
            except StoreUnavailable as error:
                _log.warning("job %s: again in %.1f s: %s", self.claim.job.id, seconds, error)
            for _ in self._glances(seconds):
                pass
            seconds = min(2.0 * seconds, _STORE_PAUSE)

    def _glances(self, seconds: float) -> Iterator[None]:
        """Moments at which to look at what has changed, while so many seconds pass.

        Raises EvaluationStopped if what has changed is that nothing more is to be done.
        """
        until = self.around.clock() + seconds
        while (left := until - self.around.clock()) > 0.0:
            if self._should_stop():
                raise EvaluationStopped
            yield
            self.around.sleep(min(left, _GLANCE))

    def _should_stop(self) -> bool:
        return self.stop.is_set() or self.heartbeat.lost


class Runner:
    """Runs up to `concurrency` jobs, each in a thread of its own, from start() to stop().

    Args:
        store: Where jobs are claimed.
        evaluator: Where their walks run.
        concurrency: Jobs to run at once.
        lease_seconds: After so long without a word from here another runner takes a job over [s].
        poll_seconds: How often the store is asked for a queued job while there is room for one [s].
        cache: Whether a design is walked only if no job has walked it before.
        name: Of this runner, which no other one may have; a random one by default.

    Raises:
        ValueError: concurrency is less than 1.
    """

    def __init__(
        self,
        store: Store,
        evaluator: Evaluator,
        *,
        concurrency: int = 2,
        lease_seconds: float = 30.0,
        poll_seconds: float = 0.5,
        cache: bool = False,
        name: str | None = None,
    ) -> None:
        if concurrency < 1:
            raise ValueError(f"concurrency must be at least 1, it is {concurrency}")
        self._around = Surroundings(store, evaluator, lease_seconds=lease_seconds, cache=cache)
        self._poll_seconds = poll_seconds
        self._name = name or runner_name()
        self._stop = threading.Event()
        self._room = threading.Semaphore(concurrency)
        self._scheduler: threading.Thread | None = None
        self._jobs: set[threading.Thread] = set()

    @property
    def running(self) -> bool:
        """Whether jobs are being claimed, as from start() to stop() they should be."""
        return self._scheduler is not None and self._scheduler.is_alive()

    def start(self) -> None:
        """Begin to claim jobs. Returns at once."""
        if self._scheduler is not None:
            raise RuntimeError("a runner is started once")
        # Now, while the files are those that were imported.
        simulator_digest()
        optimizer_digest()
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
            if claim is None or not self._started(claim):
                self._room.release()
                self._stop.wait(self._poll_seconds)

    def _started(self, claim: Claim) -> bool:
        """Run a job in a thread of its own; false if this machine has none left for it."""
        thread = threading.Thread(target=self._run, args=(claim,), name=f"job-{claim.job.id}")
        try:
            thread.start()
        except RuntimeError as error:
            _log.warning("job %s goes back to the queue: %s", claim.job.id, error)
            with suppress(GaitswarmError):
                self._around.store.release(claim, JobState.QUEUED)
            return False
        self._jobs = {other for other in self._jobs if other.is_alive()} | {thread}
        return True

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
