"""Runs one claimed job: a shell around the coordinator.

The coordinator's actions are executed with store, evaluator and heartbeat. What is missing of the
machine or its services is waited for, however long that takes; only the job's own faults fail it.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Final, TypeVar

import numpy as np

from gaitswarm.services.optimizer.errors import (
    BudgetChanged,
    GaitswarmError,
    KilledWorker,
    LeaseLost,
    ProvenanceChanged,
    StoreReplaced,
    StoreUnavailable,
    Unavailable,
)
from gaitswarm.services.optimizer.jobs.iteration import CachedOutcome, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, Job, JobState
from gaitswarm.services.optimizer.jobs.priority import weight
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, job_provenance
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.log_context import log_context
from gaitswarm.services.optimizer.run.coordinator import (
    Action,
    Begin,
    Claimed,
    Commit,
    Committed,
    Coordination,
    Evaluate,
    Evaluated,
    EvaluationFailed,
    EvaluatorLost,
    Event,
    Extended,
    LeaseWasLost,
    PauseSeen,
    Phase,
    Record,
    Release,
    StopRequested,
    Wait,
    Waited,
    handle,
    iteration_of,
)
from gaitswarm.services.optimizer.run.evaluator import (
    EvaluationRequest,
    EvaluationStopped,
    Evaluator,
)
from gaitswarm.services.optimizer.run.heartbeat import Heartbeat
from gaitswarm.services.optimizer.run.outage import Backoff, Outage, is_infrastructure
from gaitswarm.services.optimizer.store.port.base import Store
from gaitswarm.sim.outcome import Outcome, Status

_NEW: Final = -1

Keys = tuple[bytes | None, ...]

_log = logging.getLogger(__name__)


def evaluate_unknown(
    evaluator: Evaluator,
    store: Store | None,
    request: EvaluationRequest,
    keys: Sequence[bytes],
    should_stop: Callable[[], bool],
) -> tuple[tuple[Outcome, ...], Keys]:
    """Evaluate a request, but for what the store knows and what occurs in it twice.

    The outcomes are those of evaluating all of it, to the bit, because a walk's outcome depends on
    design and case alone. A store that does not answer knows nothing.
    """
    if store is None or not keys:
        return evaluator.evaluate(request, should_stop), tuple(keys)
    first = {key: index for index, key in reversed(list(enumerate(keys)))}
    known = _known(store, request, tuple(first))
    walked = sorted(index for key, index in first.items() if key not in known)
    if len(walked) == len(keys):
        return evaluator.evaluate(request, should_stop), tuple(keys)
    found: tuple[Outcome, ...] | None = None
    if walked:
        found = evaluator.evaluate(replace(request, designs=request.designs[walked]), should_stop)
    row_of = {index: row for row, index in enumerate(walked)}
    rows = np.array([row_of.get(first[key], _NEW) for key in keys])
    outcomes = []
    for number, case in enumerate(request.cases):
        objectives = np.empty((len(keys), len(case.objectives)))
        statuses = np.empty(len(keys), dtype=np.uint8)
        if found is not None:
            here = rows != _NEW
            objectives[here] = found[number].objectives[rows[here]]
            statuses[here] = found[number].statuses[rows[here]]
        for index in np.flatnonzero(rows == _NEW).tolist():
            earlier = known[keys[index]]
            objectives[index] = earlier.objectives[number]
            statuses[index] = earlier.statuses[number]
        outcomes.append(Outcome(objectives, statuses))
    new = set(walked)
    return tuple(outcomes), tuple(key if i in new else None for i, key in enumerate(keys))


def _known(
    store: Store, request: EvaluationRequest, keys: tuple[bytes, ...]
) -> dict[bytes, CachedOutcome]:
    """What the store has of these keys, as far as it is fit for use."""
    try:
        found = store.known(keys)
    except StoreUnavailable as error:
        _log.warning("job %s: all is walked anew: %s", request.job_id, error)
        return {}
    widths = {len(case.objectives) for case in request.cases}
    shapes = {(len(request.cases), width) for width in widths}
    return {
        key: known
        for key, known in found.items()
        if known.objectives.shape in shapes and _complete(known)
    }


def _complete(known: CachedOutcome) -> bool:
    """Not so where a number was stored as null, as infinities are."""
    ok = known.statuses == Status.OK
    return bool(np.isfinite(known.objectives[ok]).all())


OnCommit = Callable[[CompletedIteration, JobState], None]
"""Called after an iteration is stored, in the thread that runs the job."""

OnRetry = Callable[[float, str], None]
"""Called before a wait for the workers: seconds to wait, and why."""

_GLANCE: Final = 0.1
"""Seconds between looks at what has changed, while waiting."""

_STORE: Final = Backoff(first=0.1, longest=5.0)
"""Pauses while the store does not answer; an evaluated iteration may wait to be stored."""

T = TypeVar("T")


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


def run_claim(
    claim: Claim,
    around: Surroundings,
    stop: threading.Event | None = None,
    drain: threading.Event | None = None,
) -> Job:
    """Run a claimed job until it ends, is paused, or is no longer ours.

    Workers or a store that are away are waited for, however long that takes, as long as nobody else
    has taken the job over.
    """
    run = _Run.of(claim, around, stop or threading.Event(), drain or threading.Event())
    try:
        with log_context(job=claim.job.id), run.heartbeat:
            state, actions = run.begin()
            while actions:
                state, actions = run.decide(state, run.execute(actions))
    except StoreUnavailable:
        raise
    except BaseException:
        with suppress(GaitswarmError):
            around.store.release(claim, JobState.QUEUED)
        raise
    return around.store.job(claim.job.id)


Decision = tuple[Coordination, tuple[Action, ...]]


def _fail(state: Coordination, error: Exception, what: str) -> Decision:
    _log.exception(what)
    failed = Release(JobState.FAILED, f"internal error: {type(error).__name__}: {error}")
    return replace(state, phase=Phase.ENDED), (failed,)


@dataclass(slots=True)
class _Run:
    """claim: that of the heartbeat, its job as it was when it was last read.

    workers, memory: what is known of the evaluator and of the store.
    """

    claim: Claim
    around: Surroundings
    heartbeat: Heartbeat
    stop: threading.Event
    drain: threading.Event
    workers: Outage
    memory: Outage

    @classmethod
    def of(
        cls, claim: Claim, around: Surroundings, stop: threading.Event, drain: threading.Event
    ) -> _Run:
        workers, memory = Outage(around.clock), Outage(around.clock)
        heartbeat = Heartbeat(
            around.store,
            claim,
            lease_seconds=around.lease_seconds,
            waiting=lambda: workers.reason,
            outage=memory,
        )
        return cls(claim, around, heartbeat, stop, drain, workers, memory)

    def begin(self) -> Decision:
        """What to do first; a job whose robot cannot be read fails, as in `decide`."""
        state = Coordination(backoff=self.around.backoff)
        try:
            here = self._in_time(lambda: self.around.provenance(self.claim.job.spec))
        except EvaluationStopped:
            return handle(state, self._stopped())
        except Exception as error:  # noqa: BLE001
            return _fail(state, error, f"job {self.claim.job.id}: its provenance cannot be told")
        return self.decide(state, Claimed(self.claim, here, self.around.accepts_changes))

    def decide(self, state: Coordination, event: Event) -> Decision:
        """As `handle`; a job that it cannot handle fails, or it would be claimed over and over."""
        try:
            return self._in_time(lambda: handle(state, event))
        except EvaluationStopped:
            return handle(state, self._stopped())
        except Exception as error:  # noqa: BLE001
            return _fail(state, error, f"a job cannot go on after {type(event).__name__}")

    def execute(self, actions: tuple[Action, ...]) -> Event:
        """Do them in order; the event that answers the last, or the one that broke off."""
        try:
            return self._do_all(actions)
        except LeaseLost:
            return LeaseWasLost()
        except EvaluationStopped:
            return self._stopped()

    def _stopped(self) -> Event:
        return LeaseWasLost() if self.heartbeat.lost else StopRequested()

    def _do_all(self, actions: tuple[Action, ...]) -> Event:
        answer: Event | None = None
        try:
            for action in actions:
                with log_context(iteration=iteration_of(action)):
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
                if state is JobState.RUNNING and self.drain.is_set():
                    return StopRequested()
                return Committed(state)
            case Wait(seconds=seconds, reason=reason):
                return self._wait(seconds, reason)
            case Release(state=state, error=error):
                self._stored(lambda: self.around.store.release(self.claim, state, error=error))
                return LeaseWasLost()

    def _evaluate(self, request: EvaluationRequest, keys: tuple[bytes, ...]) -> Event:
        if self._should_stop():
            raise EvaluationStopped
        self.workers.attempted()
        begun = self.around.clock()
        try:
            outcomes, walked = evaluate_unknown(
                self.around.evaluator,
                self.around.store if self.around.cache else None,
                replace(request, weight=weight(self.heartbeat.priority)),
                keys,
                self._should_stop,
            )
        except EvaluationStopped:
            raise
        except (KilledWorker, ProvenanceChanged) as error:
            _log.warning("job %s: %s", request.job_id, error)
            return EvaluationFailed(str(error))
        except Exception as error:  # noqa: BLE001
            if is_infrastructure(error):
                return EvaluatorLost(_in_words(error))
            _log.exception("job %s: the evaluation failed", request.job_id)
            return EvaluationFailed(f"the simulation failed: {type(error).__name__}: {error}")
        self._over(self.workers)
        return Evaluated(outcomes, self.around.clock() - begun, walked)

    def _wait(self, seconds: float, reason: str) -> Event:
        self._away(self.workers, reason)
        if self.around.on_retry is not None:
            self.around.on_retry(seconds, reason)
        for _ in self._glances(seconds):
            if self.heartbeat.state is JobState.PAUSING:
                return PauseSeen()
            if self.drain.is_set():
                return StopRequested()
        return Waited()

    def _stored(self, access: Callable[[], T]) -> T:
        """What the store answers, however long it takes: an evaluated iteration is expensive.

        Raises EvaluationStopped when the process is to end, or another one has the job, and
        StoreReplaced, which waiting does not end.
        """
        failures = 0
        while True:
            try:
                answer = access()
            except StoreReplaced:
                raise
            except Exception as error:
                if not is_infrastructure(error):
                    raise
                self._away(self.memory, _in_words(error))
            else:
                self._over(self.memory)
                return answer
            failures += 1
            for _ in self._glances(_STORE.pause(failures)):
                pass

    def _in_time(self, compute: Callable[[], T]) -> T:
        """What is computed here, as soon as the machine has what that takes.

        Raises EvaluationStopped as `_stored`, and when the job is to pause.
        """
        failures = 0
        while True:
            try:
                answer = compute()
            except Exception as error:
                if not is_infrastructure(error):
                    raise
                self._away(self.workers, _in_words(error))
            else:
                return answer
            failures += 1
            for _ in self._glances(self.around.backoff.pause(failures)):
                if self.heartbeat.state is JobState.PAUSING or self.drain.is_set():
                    raise EvaluationStopped

    def _away(self, outage: Outage, reason: str) -> None:
        """Take note, in one line of the log for each outage."""
        if outage.failed(reason):
            _log.warning("job %s waits, and goes on by itself: %s", self.claim.job.id, reason)

    def _over(self, outage: Outage) -> None:
        seconds = outage.ended()
        if seconds is not None:
            _log.info("job %s goes on after %.0f s", self.claim.job.id, seconds)

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


def _in_words(error: Exception) -> str:
    return str(error) if isinstance(error, Unavailable) else f"{type(error).__name__}: {error}"
