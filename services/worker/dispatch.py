"""What both evaluators share: cutting a request into tasks, fair order, results by index."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from services.optimizer.errors import EvaluatorUnavailable, ProvenanceChanged
from services.optimizer.run.evaluator import EvaluationRequest, EvaluationStopped
from services.worker.cutting import Chunk, cut
from services.worker.fair_queue import FairQueue
from services.worker.pace import Pace, TaskTime
from services.worker.tasks import Answer, Task, TaskTotals
from sim.case import LongCase, WalkingCase
from sim.kernel.walk import Precision
from sim.outcome import Outcome
from sim.provenance import Provenance

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
        error: With which the request failed; None if it has not.
        dropped: Whether nobody waits for it any more.
    """

    request: EvaluationRequest
    outcomes: tuple[Outcome, ...]
    missing: set[Chunk]
    times: list[TaskTime] = field(default_factory=list)
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
        attempts: How often it was sent out before.
        taken: When it was taken to be run; monotonic [s].
    """

    batch: Batch
    chunk: Chunk
    attempts: int = 0
    taken: float = 0.0

    @property
    def task(self) -> Task:
        """What is sent to the worker."""
        request = self.batch.request
        return Task.of(request.cases, request.designs, self.chunk.parts, request.provenance)


@dataclass(slots=True, eq=False)
class Dispatcher:
    """Hands the chunks of all requests to whoever takes them, and puts results where they belong.

    Thread-safe. `evaluate` is called by those who want results, `take`, `complete`, `again` and
    `fail` by those who run the tasks.

    Attributes:
        slots: Tasks that run at the same time.
        lanes: Tells how many designs the compiled kernel of a precision steps at once.
        shared: Whether tasks that run at the same time share their walks, as they do in threads.
        totals: Of all tasks whose answers were of use.
    """

    slots: int
    lanes: Callable[[Precision], int]
    shared: bool = False
    totals: TaskTotals = field(default_factory=TaskTotals)
    _queue: FairQueue[Work] = field(default_factory=FairQueue)
    _changed: threading.Condition = field(default_factory=threading.Condition)
    _closed: str | None = None
    _paces: dict[str, Pace] = field(default_factory=dict)

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
                self._queue.push(request.job_id, chunk.cost, Work(batch, chunk))
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
            work.taken = time.monotonic()
        return work

    def complete(self, work: Work, answer: Answer | Outcome) -> None:
        """The chunk has its result; a second one of the same chunk is the same and ignored.

        Args:
            work: The chunk as it was taken.
            answer: As the worker gave it. The whole request fails with ProvenanceChanged if it is
                not of the provenance that the request expects.
        """
        chunk, batch = work.chunk, work.batch
        expected = batch.request.provenance
        with self._changed:
            if not batch.awaits(chunk):
                return
            # A worker of an earlier version answers with the bare outcome.
            if (
                not isinstance(answer, Answer)
                or answer.outcomes is None
                or answer.provenance != expected
            ):
                self._end(batch, _unlike(expected, answer))
                return
            shapes = [outcome.objectives.shape for outcome in answer.outcomes]
            wanted = [
                (part.stop - part.start, batch.outcomes[part.case].objectives.shape[1])
                for part in chunk.parts
            ]
            if shapes != wanted:
                self._end(batch, _misshapen(shapes, wanted))
                return
            for part, outcome in zip(chunk.parts, answer.outcomes, strict=True):
                into = batch.outcomes[part.case]
                into.objectives[part.start : part.stop] = outcome.objectives
                into.statuses[part.start : part.stop] = outcome.statuses
            overhead = time.monotonic() - work.taken - answer.seconds
            batch.times.append(TaskTime(chunk.cost, answer.seconds, overhead))
            self.totals = self.totals.plus(answer)
            batch.missing.remove(chunk)
            self._changed.notify_all()

    def again(self, work: Work) -> None:
        """The chunk was lost with its worker: it is to be run again.

        Args:
            work: The chunk as it was sent out.
        """
        with self._changed:
            if work.batch.awaits(work.chunk):
                retry = Work(work.batch, work.chunk, work.attempts + 1)
                self._queue.push(work.batch.request.job_id, work.chunk.cost, retry)
                self._changed.notify_all()

    def fail(self, work: Work, error: BaseException) -> None:
        """The chunk cannot be run: the whole request fails, if it needs it yet.

        Args:
            work: The chunk.
            error: What the request fails with.
        """
        with self._changed:
            if work.batch.awaits(work.chunk):
                self._end(work.batch, error)

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
            if len(self._paces) > _PACES_KEPT:
                del self._paces[next(iter(self._paces))]

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


def _misshapen(shapes: list[tuple[int, ...]], wanted: list[tuple[int, int]]) -> RuntimeError:
    return RuntimeError(
        f"a worker sent objectives of shapes {shapes} for a chunk of {wanted};"
        " it runs other code than this process"
    )


def _unlike(expected: Provenance, answer: Answer | Outcome) -> ProvenanceChanged:
    worker, why = "a worker", "its gaitswarm does not say what it computes"
    if isinstance(answer, Answer):
        worker += f" on {answer.host}"
        why = "; ".join(expected.changes(answer.provenance))
    return ProvenanceChanged(
        f"{worker} does not compute what this job's numbers depend on: {why}. Its walks were not"
        " used; give all workers the same gaitswarm and a C compiler, and resume the job"
    )
