"""Cuts requests into tasks, hands them out fairly, gathers results."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.run.evaluator import (
    EvaluationRequest,
    EvaluationStopped,
    TaskReport,
)
from gaitswarm.services.worker.cutting import Chunk, cut
from gaitswarm.services.worker.durations import CaseTime, Durations, costs_of
from gaitswarm.services.worker.failures import killed_workers, misshapen, unlike
from gaitswarm.services.worker.fair_queue import FairQueue
from gaitswarm.services.worker.pace import Pace, TaskTime
from gaitswarm.services.worker.tasks import Answer, Load, Task, TaskTotals
from gaitswarm.services.worker.tries import Running, Tries, Verdict, straggler
from gaitswarm.sim.case import LongCase, WalkingCase
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import Outcome

_GLANCE: Final = 0.1
"""Seconds between looks at `should_stop`."""

_NO_STATUS: Final = 255
"""In place of a status that has not come yet; no `Status` has this value."""


_PACES_KEPT: Final = 64
"""Jobs whose pace is remembered: those that ran last."""


@dataclass(slots=True, eq=False)
class Batch:
    """One request under way.

    Attributes:
        request: What was asked.
        outcomes: One per case, filled in as results come.
        missing: Chunks that have no result yet.
        times: Of the tasks whose results have come.
        case_times: Of the same, by case.
        tries: Of the chunks that were handed out.
        error: With which the request failed; None if it has not.
        dropped: Whether nobody waits for it any more.
    """

    request: EvaluationRequest
    outcomes: tuple[Outcome, ...]
    missing: set[Chunk]
    times: list[TaskTime] = field(default_factory=list)
    case_times: list[CaseTime] = field(default_factory=list)
    tries: dict[Chunk, Tries] = field(default_factory=dict)
    error: BaseException | None = None
    dropped: bool = False

    @property
    def ended(self) -> bool:
        """Nothing more needs to be run."""
        return not self.missing or self.error is not None or self.dropped

    def awaits(self, chunk: Chunk) -> bool:
        """Whether a result of a chunk is still of use.

        Args:
            chunk: Of this batch.

        Returns:
            False once it has come, or nobody waits for the batch any more.
        """
        return not self.ended and chunk in self.missing


@dataclass(slots=True, eq=False)
class Work:
    """A chunk of a batch, as it waits, runs, and is perhaps run again.

    Attributes:
        batch: Which it belongs to.
        chunk: Some of the batch's designs in some of its cases.
        taken: When it was taken to be run; monotonic [s].
        node: Id of the node that it was sent to; "" where there is only one, or until it is sent.
        avoid: Ids of nodes that it is sent to only if there are no others: there a worker has died
            of it, or it takes too long.
    """

    batch: Batch
    chunk: Chunk
    taken: float = 0.0
    node: str = ""
    avoid: frozenset[str] = frozenset()

    @property
    def costs(self) -> dict[str, float]:
        """Simulated seconds by case."""
        return costs_of(self.chunk, self.batch.request.cases)

    @property
    def task(self) -> Task:
        """What is sent to the worker."""
        request = self.batch.request
        return Task.of(request.cases, request.designs, self.chunk.parts, request.provenance)


@dataclass(slots=True, eq=False)
class Dispatcher:
    """Hands the chunks of all requests to whoever takes them, and puts results where they belong.

    Thread-safe. `evaluate` is called by those who want results, `take`, `copy`, `complete`, `again`
    and `fail` by those who run the tasks.

    Attributes:
        slots: Tasks that run at the same time.
        lanes: Tells how many designs the compiled kernel of a precision steps at once.
        shared: Whether tasks that run at the same time share their walks, as they do in threads.
        totals: Of all tasks whose answers were of use.
        clock: Monotonic time [s]; replaced in tests.
    """

    slots: int
    lanes: Callable[[Precision], int]
    shared: bool = False
    totals: TaskTotals = field(default_factory=TaskTotals)
    clock: Callable[[], float] = time.monotonic
    _queue: FairQueue[Work] = field(default_factory=FairQueue)
    _changed: threading.Condition = field(default_factory=threading.Condition)
    _closed: str | None = None
    _paces: dict[str, Pace] = field(default_factory=dict)
    _durations: dict[str, Durations] = field(default_factory=dict)
    # Handed out and not settled, in order; and since when there has been a slot for each.
    _out: dict[Work, None] = field(default_factory=dict)
    _all_run_since: float | None = 0.0

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        """Queue the chunks of a request, and put their results together."""
        count = len(request.designs)
        chunks = self._cut(request)
        blank = tuple(
            Outcome(
                np.full((count, len(case.objectives)), np.nan),
                np.full(count, _NO_STATUS, dtype=np.uint8),
            )
            for case in request.cases
        )
        batch = Batch(request, blank, missing=set(chunks))
        with self._changed:
            self._refuse_if_closed()
            for chunk in chunks:
                self._queue_up(Work(batch, chunk))
            self._changed.notify_all()
        self._await(batch, should_stop)
        self._note_pace(batch)
        return batch.outcomes

    def take(self, timeout: float) -> Work | None:
        """The next chunk to run.

        Args:
            timeout: How long to wait for one [s].

        Returns:
            The chunk; None if none has come, or no more work is taken.
        """
        with self._changed:
            self._changed.wait_for(lambda: bool(self._queue) or self.closed, timeout)
            work = None if self.closed else self._queue.pop()
            if work is not None:
                self._hand_out(work)
        return work

    def copy(self) -> Work | None:
        """A chunk to be run a second time, in a slot that has nothing else to do.

        Returns:
            A chunk that is under way and takes far longer than it should; None if there is none.
        """
        with self._changed:
            for work in [work for work in self._out if not work.batch.awaits(work.chunk)]:
                self._settled(work)
            if self.closed or self._queue or len(self._out) >= self.slots:
                return None
            out = list(self._out)
            found = straggler(map(self._running, out), slots=self.slots, waiting=len(self._queue))
            if found is None:
                return None
            batch, chunk = out[found].batch, out[found].chunk
            tries = batch.tries[chunk] = replace(batch.tries[chunk], copied=True)
            work = Work(batch, chunk, avoid=tries.died_on | {out[found].node})
            self._hand_out(work)
            return work

    def complete(self, work: Work, answer: Answer) -> None:
        """The chunk has its result; a second one of the same chunk is the same and ignored.

        Args:
            work: The chunk as it was taken.
            answer: As the worker gave it. The whole request fails with ProvenanceChanged if it is
                not of the provenance that the request expects.
        """
        chunk, batch = work.chunk, work.batch
        expected = batch.request.provenance
        with self._changed:
            self._settled(work)
            self._report(work, answer.seconds, answer.host)
            if not batch.awaits(chunk):
                return
            if answer.outcomes is None or answer.provenance != expected:
                self._end(batch, unlike(expected, answer))
                return
            shapes = [outcome.objectives.shape for outcome in answer.outcomes]
            wanted = [
                (part.stop - part.start, batch.outcomes[part.case].objectives.shape[1])
                for part in chunk.parts
            ]
            if shapes != wanted:
                self._end(batch, misshapen(shapes, wanted))
                return
            for part, outcome in zip(chunk.parts, answer.outcomes, strict=True):
                into = batch.outcomes[part.case]
                into.objectives[part.start : part.stop] = outcome.objectives
                into.statuses[part.start : part.stop] = outcome.statuses
            overhead = self.clock() - work.taken - answer.seconds
            batch.times.append(TaskTime(chunk.cost, answer.seconds, overhead))
            batch.case_times.append(CaseTime(work.costs, answer.seconds))
            self.totals = self.totals.plus(answer)
            batch.missing.remove(chunk)
            self._changed.notify_all()

    def again(self, work: Work, *, suspect: bool = True) -> None:
        """The chunk was lost with its worker: it is run again, or its request fails.

        Args:
            work: The chunk as it was sent out.
            suspect: Whether it may be what ended the worker. Then its request fails with
                KilledWorker when too many have died of it.
        """
        with self._changed:
            self._settled(work)
            self._report(work, error="its worker was lost")
            batch, chunk = work.batch, work.chunk
            if not batch.awaits(chunk):
                return
            before = batch.tries.get(chunk, Tries(1))
            tries, verdict = before.lost(suspect=suspect, node=work.node)
            batch.tries[chunk] = tries
            if verdict is Verdict.GIVEN_UP:
                self._end(batch, killed_workers(batch.request, chunk, tries.killed))
            elif verdict is Verdict.AGAIN:
                self._queue_up(Work(batch, chunk, avoid=tries.died_on))
                self._changed.notify_all()

    def fail(self, work: Work, error: BaseException) -> None:
        """The chunk cannot be run: the whole request fails, if it needs it yet.

        Args:
            work: The chunk.
            error: What the request fails with.
        """
        with self._changed:
            self._settled(work)
            self._report(work, error=f"{type(error).__name__}: {error}")
            if work.batch.awaits(work.chunk):
                self._end(work.batch, error)

    @property
    def load(self) -> Load:
        """What there is to do now; nothing, without slots, once it is closed."""
        with self._changed:
            if self.closed:
                return Load()
            # Some are at hand beside those that run, so that a slot need not wait for its next.
            used = min(len(self._out), self.slots)
            return Load(self.slots, used, len(self._queue) + len(self._out) - used)

    @property
    def closed(self) -> bool:
        """Whether no more work is taken."""
        return self._closed is not None

    def close(self, reason: str) -> None:
        """Take no more work; requests under way end with EvaluatorUnavailable. Idempotent.

        Args:
            reason: For people; the first one counts.
        """
        with self._changed:
            self._closed = self._closed or reason
            self._queue.discard(lambda _: True)
            self._changed.notify_all()

    def _cut(self, request: EvaluationRequest) -> tuple[Chunk, ...]:
        # The interpreter steps one walk, and a run has the lanes for the walks that it asks for.
        is_compiled = request.provenance.backend == "native"
        lanes = max(
            self.lanes(case.precision) if is_compiled and not isinstance(case, LongCase) else 1
            for case in request.cases
        )
        return cut(
            [case.duration for case in request.cases],
            len(request.designs),
            slots=self.slots,
            lanes=lanes,
            pace=self._paces.get(request.job_id),
            together=all(isinstance(case, WalkingCase) for case in request.cases),
            shared=self.shared and is_compiled,
        )

    def _note_pace(self, batch: Batch) -> None:
        """For the job's next iteration."""
        with self._changed:
            job_id = batch.request.job_id
            pace = self._paces.pop(job_id, Pace()).after(batch.times)
            self._paces[job_id] = pace
            known = self._durations.pop(job_id, Durations())
            self._durations[job_id] = known.after(batch.case_times)
            if len(self._paces) > _PACES_KEPT:
                del self._paces[next(iter(self._paces))]
                del self._durations[next(iter(self._durations))]

    def _queue_up(self, work: Work) -> None:
        """For a worker; the caller holds the lock, and so do those of the next three."""
        request = work.batch.request
        self._queue.push(request.job_id, work.chunk.cost / request.weight, work)

    def _hand_out(self, work: Work) -> None:
        """To a worker."""
        work.taken = self.clock()
        tries = work.batch.tries
        tries[work.chunk] = tries.get(work.chunk, Tries()).sent()
        self._out[work] = None
        if len(self._out) > self.slots:
            self._all_run_since = None

    def _settled(self, work: Work) -> None:
        self._out.pop(work, None)
        if self._all_run_since is None and len(self._out) <= self.slots:
            # Until now it may have lain at hand, behind another one.
            self._all_run_since = self.clock()

    def _report(
        self, work: Work, compute_seconds: float = 0.0, host: str = "", *, error: str | None = None
    ) -> None:
        on_task = work.batch.request.on_task
        if on_task is not None:
            walks = sum(part.stop - part.start for part in work.chunk.parts)
            seconds = self.clock() - work.taken
            on_task(TaskReport(walks, seconds, compute_seconds, host, error))

    def _running(self, work: Work) -> Running:
        known = self._durations.get(work.batch.request.job_id, Durations())
        begun = max(work.taken, self._all_run_since or 0.0)
        return Running(
            self.clock() - begun,
            known.after(work.batch.case_times).predicted(work.costs),
            work.batch.tries[work.chunk],
        )

    def _await(self, batch: Batch, should_stop: Callable[[], bool]) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: batch.ended or self.closed, _GLANCE)
                if not batch.missing:
                    return
                if batch.error is not None:
                    raise batch.error
                self._refuse_if_closed()
            if should_stop():
                self._drop(batch)
                raise EvaluationStopped

    def _end(self, batch: Batch, error: BaseException) -> None:
        """With this error; the caller holds the lock."""
        batch.error = error
        self._queue.discard(lambda work: work.batch is batch)
        self._changed.notify_all()

    def _drop(self, batch: Batch) -> None:
        with self._changed:
            batch.dropped = True
            self._queue.discard(lambda work: work.batch is batch)

    def _refuse_if_closed(self) -> None:
        if self._closed is not None:
            raise EvaluatorUnavailable(self._closed)
