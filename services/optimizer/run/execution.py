"""Execution of one claimed job: a shell around the coordinator, its journal and its lease"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer import errors
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration, JournalEntry
from gaitswarm.services.optimizer.jobs.job import Claim, Job, JobState, weight
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
    Decision,
    Evaluate,
    Evaluated,
    EvaluationFailed,
    EvaluatorLost,
    Event,
    Extended,
    Phase,
    Record,
    Release,
    Signal,
    Wait,
    handle,
    iteration_of,
)
from gaitswarm.services.optimizer.run.evaluator import (
    EvaluationRequest,
    EvaluationStopped,
    Evaluator,
)
from gaitswarm.services.optimizer.run.outage import Backoff, Outage, is_infrastructure
from gaitswarm.sim.outcome import Outcome, Status

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store

JOURNAL_SECONDS: Final = 10.0
"""Iterations that take longer, as the previous one did or as this one does, are journaled [s]."""

_log = logging.getLogger(__name__)


def evaluate_uncached(
    journal: Journal,
    store: Store | None,
    request: EvaluationRequest,
    keys: Sequence[bytes],
    should_stop: Callable[[], bool],
) -> tuple[tuple[Outcome, ...], tuple[bytes | None, ...]]:
    """Evaluate a request without its cached and duplicate designs."""
    if store is None or not keys:
        return journal.evaluate(request, keys, should_stop), tuple(keys)
    first = {key: index for index, key in reversed(list(enumerate(keys)))}
    cached = _cached(store, request, tuple(first))
    chosen = sorted(first.values())
    part = replace(request, designs=request.designs[chosen])
    found = journal.evaluate(part, [keys[index] for index in chosen], should_stop, cached)
    place = {keys[index]: row for row, index in enumerate(chosen)}
    rows = [place[key] for key in keys]
    outcomes = tuple(Outcome(each.objectives[rows], each.statuses[rows]) for each in found)
    new = [key not in cached and first[key] == index for index, key in enumerate(keys)]
    return outcomes, tuple(key if is_new else None for key, is_new in zip(keys, new, strict=True))


def _cached(
    store: Store, request: EvaluationRequest, keys: tuple[bytes, ...]
) -> dict[bytes, Outcome]:
    try:
        stored = store.known(keys)
    except errors.StoreUnavailable as error:
        _log.warning("job %s: simulating all designs without the cache: %s", request.job_id, error)
        return {}
    shapes = {(len(request.cases), len(case.objectives)) for case in request.cases}
    return {
        key: outcome
        for key, outcome in stored.items()
        # Infinities are stored as NaN.
        if outcome.objectives.shape in shapes
        and np.isfinite(outcome.objectives[outcome.statuses == Status.OK]).all()
    }


@dataclass(eq=False)
class Journal:
    """Evaluates the requests of a claimed job, without what an earlier run of it has stored."""

    claim: Claim
    store: Store
    evaluator: Evaluator
    after_seconds: float = JOURNAL_SECONDS
    clock: Callable[[], float] = time.monotonic

    def __post_init__(self) -> None:
        self._known: dict[tuple[int, bytes], tuple[NDArray[np.float64], int]] = {}
        for entry in self.claim.journal:
            self._know(entry)
        self._finished: list[JournalEntry] = []
        self._is_stored = bool(self.claim.journal)
        self._begun: float | None = None
        self._was_long = False
        self._writing = threading.Lock()

    def evaluate(
        self,
        request: EvaluationRequest,
        keys: Sequence[bytes],
        should_stop: Callable[[], bool],
        cached: Mapping[bytes, Outcome] = MappingProxyType({}),
    ) -> tuple[Outcome, ...]:
        """Evaluate as `Evaluator.evaluate`; designs are identified by their keys."""
        if not keys:
            return self.evaluator.evaluate(request, should_stop)
        if self._begun is None:
            self._begun = self.clock()
        numbers, count = range(len(request.cases)), len(keys)
        known = self._known | {
            (number, key): (outcome.objectives[number], int(outcome.statuses[number]))
            for key, outcome in cached.items()
            for number in numbers
        }
        if not known:
            return self._run(request, numbers, keys, should_stop)
        missing = np.array([[(number, key) not in known for number in numbers] for key in keys])
        outcomes = [
            Outcome(np.empty((count, len(case.objectives))), np.empty(count, dtype=np.uint8))
            for case in request.cases
        ]
        for row, number in np.argwhere(~missing).tolist():
            outcome = outcomes[number]
            outcome.objectives[row], outcome.statuses[row] = known[number, keys[row]]
        # Designs that are missing in the same cases make up a request.
        for pattern in np.unique(missing[missing.any(axis=1)], axis=0):
            rows = np.flatnonzero((missing == pattern).all(axis=1)).tolist()
            cases = np.flatnonzero(pattern).tolist()
            part = replace(
                request,
                cases=tuple(request.cases[number] for number in cases),
                designs=request.designs[rows],
            )
            evaluated = self._run(part, cases, [keys[row] for row in rows], should_stop)
            for number, outcome in zip(cases, evaluated, strict=True):
                outcomes[number].objectives[rows] = outcome.objectives
                outcomes[number].statuses[rows] = outcome.statuses
        return tuple(outcomes)

    def _run(
        self,
        request: EvaluationRequest,
        cases: Sequence[int],
        keys: Sequence[bytes],
        should_stop: Callable[[], bool],
    ) -> tuple[Outcome, ...]:
        def on_outcome(case: int, first: int, outcome: Outcome) -> None:
            of_designs = tuple(keys[first : first + len(outcome.statuses)])
            self._finished.append(JournalEntry(cases[case], of_designs, outcome))

        return self.evaluator.evaluate(replace(request, on_outcome=on_outcome), should_stop)

    def store_finished(self) -> None:
        """Store what tasks have finished, if the iteration is a long one. Thread-safe."""
        with self._writing:
            begun, count = self._begun, len(self._finished)
            if begun is None or not count:
                return
            if self._was_long or self.clock() - begun > self.after_seconds:
                entries = self._finished[:count]
                self._is_stored = True
                self.store.journal(self.claim, entries)
                del self._finished[:count]
                for entry in entries:
                    self._know(entry)

    def close(self) -> bool:
        """Store nothing more of the iteration; return whether any of it is stored."""
        with self._writing:
            if self._begun is not None:
                self._was_long = self.clock() - self._begun > self.after_seconds
                self._begun = None
            return self._is_stored

    def clear(self) -> None:
        """Forget the iteration, which was committed."""
        self._known.clear()
        self._finished.clear()
        self._is_stored = False

    def _know(self, entry: JournalEntry) -> None:
        rows = zip(
            entry.keys, entry.outcome.objectives, entry.outcome.statuses.tolist(), strict=True
        )
        for key, objectives, status in rows:
            self._known[entry.case, key] = objectives, status


_BEATS_PER_LEASE: Final = 3
_LONGEST_INTERVAL: Final = 1.0
"""Longest time to notice a cancellation or a pause [s]."""

_log = logging.getLogger(__name__)


@dataclass(eq=False)
class Heartbeat:
    """Renews a claim from its own thread, inside the `with` block; retries indefinitely."""

    store: Store
    claim: Claim
    lease_seconds: float
    waiting: Callable[[], str | None] = lambda: None
    outage: Outage = field(default_factory=Outage)
    after_beat: Callable[[], None] = lambda: None

    def __post_init__(self) -> None:
        job = self.claim.job
        self._ended = threading.Event()
        self._lost = threading.Event()
        # As of the last beat.
        self.state, self.priority = job.state, job.priority
        beat, name = log_context(job=job.id)(self._beat), f"heartbeat-{job.id}"
        self._thread = threading.Thread(target=beat, name=name, daemon=True)

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

    def _beat(self) -> None:
        failed = False
        interval = min(self.lease_seconds / _BEATS_PER_LEASE, _LONGEST_INTERVAL)
        while not self._ended.wait(interval):
            try:
                renewal = self.store.renew(
                    self.claim, lease_seconds=self.lease_seconds, waiting=self.waiting()
                )
                self.state, self.priority = renewal.state, renewal.priority
                self.after_beat()
            except errors.LeaseLost as error:
                # A commit that ends the job releases the lease between two beats.
                if not self._ended.is_set():
                    _log.info("job %s: %s", self.claim.job.id, error)
                self._lost.set()
                return
            except Exception as error:
                if not is_infrastructure(error):
                    raise
                failed = True
                if self.outage.failed(str(error)):
                    _log.warning("job %s: no heartbeat: %s", self.claim.job.id, error)
            else:
                # A beat sent before another access failed does not end its outage.
                if failed:
                    self.outage.ended()
                failed = False


OnCommit = Callable[[CompletedIteration, JobState], None]
"""Called after an iteration is stored, in the job's thread."""

OnRetry = Callable[[float, str], None]
"""Called before waiting for the workers, with the pause [s] and the reason."""

_GLANCE: Final = 0.1
"""Poll interval while waiting [s]."""

_STORE: Final = Backoff(first=0.1, longest=5.0)
"""Pauses while the store does not answer; short, as an evaluated iteration may be waiting."""

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class RunContext:
    """Dependencies of a run besides its job."""

    store: Store
    evaluator: Evaluator
    # time without renewal after which another runner may take the job over [s]
    lease_seconds: float = 30.0
    backoff: Backoff = field(default_factory=Backoff)  # pauses while workers are unreachable
    on_commit: OnCommit | None = None
    on_retry: OnRetry | None = None
    # provenance of what this process computes for a spec
    provenance: Callable[[Spec], JobProvenance] = job_provenance
    accepts_changes: bool = False
    cache: bool = False  # whether to reuse outcomes of other jobs
    journal_seconds: float = JOURNAL_SECONDS  # duration from which on iterations are journaled [s]
    clock: Callable[[], float] = time.monotonic  # monotonic time [s], injectable in tests
    sleep: Callable[[float], None] = time.sleep  # injectable in tests


def run_claim(
    claim: Claim,
    context: RunContext,
    stop: threading.Event | None = None,
    drain: threading.Event | None = None,
) -> Job:
    """Run a claimed job until it ends, pauses or the lease is lost."""
    run = _Run(claim, context, stop or threading.Event(), drain or threading.Event())
    try:
        with log_context(job=claim.job.id), run.heartbeat:
            state, actions = run.begin()
            while actions:
                state, actions = run.proceed(state, actions)
    except errors.StoreUnavailable:
        raise
    except BaseException:
        with suppress(errors.GaitswarmError):
            context.store.release(claim, JobState.QUEUED)
        raise
    return context.store.job(claim.job.id)


@dataclass(eq=False)
class _Run:
    claim: Claim  # that of the heartbeat, with the job as last read
    context: RunContext
    stop: threading.Event
    drain: threading.Event

    def __post_init__(self) -> None:
        store, clock = self.context.store, self.context.clock
        self.worker_outage, self.store_outage = Outage(clock), Outage(clock)
        evaluator, seconds = self.context.evaluator, self.context.journal_seconds
        self.journal = Journal(self.claim, store, evaluator, after_seconds=seconds, clock=clock)
        self.heartbeat = Heartbeat(
            store,
            self.claim,
            lease_seconds=self.context.lease_seconds,
            waiting=lambda: self.worker_outage.reason,
            outage=self.store_outage,
            after_beat=self.journal.store_finished,
        )

    def begin(self) -> Decision:
        """Decide on the first actions; a job whose robot cannot be read fails."""
        state, context = Coordination(backoff=self.context.backoff), self.context

        def claimed() -> Decision:
            provenance = context.provenance(self.claim.job.spec)
            return handle(state, Claimed(self.claim, provenance, context.accepts_changes))

        return self._decided(state, claimed)

    def proceed(self, state: Coordination, actions: tuple[Action, ...]) -> Decision:
        """Execute actions and decide on the next ones."""
        event = self._execute(actions)
        return self._decided(state, lambda: handle(state, event))

    def _decided(self, state: Coordination, decide: Callable[[], Decision]) -> Decision:
        """Decide, but fail a job that raises, as it would be claimed again and again."""
        try:
            return self._computed(decide)
        except EvaluationStopped:
            return handle(state, self._stopped())
        except Exception as error:  # noqa: BLE001
            _log.exception("job %s cannot continue", self.claim.job.id)
            failed = Release(JobState.FAILED, f"internal error: {type(error).__name__}: {error}")
            return replace(state, phase=Phase.ENDED), (failed,)

    def _execute(self, actions: tuple[Action, ...]) -> Event:
        """Execute actions in order; return the event that answers the last, or an interruption."""
        answer: Event | None = None
        try:
            for action in actions:
                with log_context(iteration=iteration_of(action)):
                    answer = self._do(action)
        except errors.LeaseLost:
            return Signal.LEASE_LOST
        except EvaluationStopped:
            return self._stopped()
        except errors.BudgetChanged:
            try:
                job = self._stored(lambda: self.context.store.job(self.claim.job.id))
            except EvaluationStopped:
                return self._stopped()
            self.claim = replace(self.claim, job=job)
            return Extended(job)
        if answer is None:
            raise AssertionError("the last of the coordinator's actions has no answer")
        return answer

    def _stopped(self) -> Event:
        return Signal.LEASE_LOST if self.heartbeat.lost else Signal.STOP_REQUESTED

    def _do(self, action: Action) -> Event | None:
        match action:
            case Record(provenance=provenance):
                self._stored(lambda: self.context.store.record_provenance(self.claim, provenance))
                return None
            case Begin(ask=ask):
                self._stored(lambda: self.context.store.begin(self.claim, ask))
                return None
            case Evaluate(request=request, keys=keys):
                return self._evaluate(request, keys)
            case Commit(done=done, following=following):
                place = getattr(self.context.evaluator, "place", None)
                done = done._replace(evaluated_on=place)
                journaled, commit = self.journal.close(), self.context.store.commit
                state = self._stored(
                    lambda: commit(self.claim, done, following, journaled=journaled)
                )
                self.journal.clear()
                if self.context.on_commit is not None:
                    self.context.on_commit(done, state)
                if state is JobState.RUNNING and self.drain.is_set():
                    return Signal.STOP_REQUESTED
                return Committed(state)
            case Wait(seconds=seconds, reason=reason):
                return self._wait(seconds, reason)
            case Release(state=state, error=error):
                self._stored(lambda: self.context.store.release(self.claim, state, error=error))
                return Signal.LEASE_LOST

    def _evaluate(self, request: EvaluationRequest, keys: tuple[bytes, ...]) -> Event:
        if self._should_stop():
            raise EvaluationStopped
        self.worker_outage.attempted()
        begun = self.context.clock()
        try:
            outcomes, walked = evaluate_uncached(
                self.journal,
                self.context.store if self.context.cache else None,
                replace(request, weight=weight(self.heartbeat.priority)),
                keys,
                self._should_stop,
            )
        except EvaluationStopped:
            raise
        except (errors.KilledWorker, errors.ProvenanceChanged) as error:
            _log.warning("job %s: %s", request.job_id, error)
            return EvaluationFailed(str(error))
        except Exception as error:  # noqa: BLE001
            if is_infrastructure(error):
                return EvaluatorLost(_in_words(error))
            _log.exception("job %s: the evaluation failed", request.job_id)
            return EvaluationFailed(f"the simulation failed: {type(error).__name__}: {error}")
        self._note_success(self.worker_outage)
        return Evaluated(outcomes, self.context.clock() - begun, walked)

    def _wait(self, seconds: float, reason: str) -> Event:
        self._note_failure(self.worker_outage, reason)
        if self.context.on_retry is not None:
            self.context.on_retry(seconds, reason)
        for _ in self._ticks(seconds):
            if self.heartbeat.state is JobState.PAUSING:
                return Signal.PAUSE_SEEN
            if self.drain.is_set():
                return Signal.STOP_REQUESTED
        return Signal.WAITED

    def _stored(self, access: Callable[[], T]) -> T:
        """Access the store, retrying indefinitely: an evaluated iteration is expensive."""
        answer = self._retried(access, self.store_outage, _STORE)
        self._note_success(self.store_outage)
        return answer

    def _computed(self, compute: Callable[[], T]) -> T:
        """Compute, retrying while the machine lacks resources, unless the job is to pause."""
        return self._retried(
            compute,
            self.worker_outage,
            self.context.backoff,
            give_up=lambda: self.heartbeat.state is JobState.PAUSING or self.drain.is_set(),
        )

    def _retried(
        self,
        access: Callable[[], T],
        outage: Outage,
        backoff: Backoff,
        *,
        give_up: Callable[[], bool] = lambda: False,
    ) -> T:
        """Retry as long as the machine or its services are at fault."""
        failures = 0
        while True:
            try:
                return access()
            except errors.StoreReplaced:
                raise
            except Exception as error:
                if not is_infrastructure(error):
                    raise
                self._note_failure(outage, _in_words(error))
            failures += 1
            for _ in self._ticks(backoff.pause(failures)):
                if give_up():
                    raise EvaluationStopped

    def _note_failure(self, outage: Outage, reason: str) -> None:
        """Log the first failure of each outage."""
        if outage.failed(reason):
            _log.warning(
                "job %s is waiting and continues once this is resolved: %s",
                self.claim.job.id,
                reason,
            )

    def _note_success(self, outage: Outage) -> None:
        seconds = outage.ended()
        if seconds is not None:
            _log.info("job %s continues after %.0f s", self.claim.job.id, seconds)

    def _ticks(self, seconds: float) -> Iterator[None]:
        """Yield at intervals until the time has passed [s]."""
        until = self.context.clock() + seconds
        while (left := until - self.context.clock()) > 0.0:
            if self._should_stop():
                raise EvaluationStopped
            yield
            self.context.sleep(min(left, _GLANCE))

    def _should_stop(self) -> bool:
        return self.stop.is_set() or self.heartbeat.lost


def _in_words(error: Exception) -> str:
    is_known = isinstance(error, errors.Unavailable)
    return str(error) if is_known else f"{type(error).__name__}: {error}"
