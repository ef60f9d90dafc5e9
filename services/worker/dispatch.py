"""What both evaluators share: cutting a request into tasks, fair order, results by index."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from services.optimizer.errors import EvaluatorUnavailable
from services.optimizer.run.evaluator import EvaluationRequest, EvaluationStopped
from services.worker.fair_queue import FairQueue
from services.worker.tasks import Chunk, Task, cut
from sim.outcome import Outcome

_GLANCE: Final = 0.1
"""Seconds between looks at `should_stop`."""


@dataclass(slots=True, eq=False)
class Batch:
    """One request under way. missing: number of its chunks that have no result yet."""

    request: EvaluationRequest
    outcomes: tuple[Outcome, ...]
    missing: int
    error: BaseException | None = None
    dropped: bool = False

    @property
    def ended(self) -> bool:
        """Nothing more needs to be run."""
        return self.missing == 0 or self.error is not None or self.dropped


@dataclass(slots=True, eq=False)
class Work:
    """A chunk of a batch, as it waits, runs, and is perhaps run again.

    attempts: how often it was sent out before.
    """

    batch: Batch
    chunk: Chunk
    attempts: int = 0

    @property
    def task(self) -> Task:
        """What is sent to the worker."""
        request, chunk = self.batch.request, self.chunk
        return Task(
            case=request.cases[chunk.case],
            designs=np.ascontiguousarray(request.designs[chunk.start : chunk.stop]),
        )


@dataclass(slots=True, eq=False)
class Dispatcher:
    """Hands the chunks of all requests to whoever takes them, and puts results where they belong.

    Thread-safe. `evaluate` is called by those who want results, `take`, `complete`, `again` and
    `fail` by those who run the tasks.
    """

    slots: int
    lanes: Callable[[], int]
    _queue: FairQueue[Work] = field(default_factory=FairQueue)
    _changed: threading.Condition = field(default_factory=threading.Condition)
    _closed: str | None = None

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        """See `Evaluator.evaluate`."""
        durations = [case.duration for case in request.cases]
        count = len(request.designs)
        chunks = cut(durations, count, slots=self.slots, lanes=self.lanes())
        blank = tuple(
            Outcome(np.full((count, len(case.objectives)), np.nan), np.zeros(count, dtype=np.uint8))
            for case in request.cases
        )
        batch = Batch(request, blank, missing=len(chunks))
        with self._changed:
            self._refuse_if_closed()
            for chunk in chunks:
                self._queue.push(request.job_id, chunk.cost, Work(batch, chunk))
            self._changed.notify_all()
        self._await(batch, should_stop)
        return batch.outcomes

    def take(self, timeout: float) -> Work | None:
        """The next chunk to run; None if there is none within so many seconds, or after close."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._queue) or self.closed, timeout)
            return None if self.closed else self._queue.pop()

    def complete(self, work: Work, outcome: Outcome) -> None:
        """The chunk has its result; a second one of the same chunk is the same and ignored."""
        chunk, batch = work.chunk, work.batch
        with self._changed:
            if batch.ended:
                return
            into = batch.outcomes[chunk.case]
            into.objectives[chunk.start : chunk.stop] = outcome.objectives
            into.statuses[chunk.start : chunk.stop] = outcome.statuses
            batch.missing -= 1
            self._changed.notify_all()

    def again(self, work: Work) -> None:
        """The chunk was lost with its worker: it is to be run again."""
        with self._changed:
            if not work.batch.ended:
                retry = Work(work.batch, work.chunk, work.attempts + 1)
                self._queue.push(work.batch.request.job_id, work.chunk.cost, retry)
                self._changed.notify_all()

    def fail(self, work: Work, error: BaseException) -> None:
        """The chunk cannot be run: the whole request fails with this error."""
        with self._changed:
            if not work.batch.ended:
                work.batch.error = error
                self._queue.discard(lambda other: other.batch is work.batch)
                self._changed.notify_all()

    @property
    def closed(self) -> bool:
        """Whether no more work is taken."""
        return self._closed is not None

    def close(self, reason: str) -> None:
        """Take no more work; requests under way end with EvaluatorUnavailable. Idempotent."""
        with self._changed:
            self._closed = self._closed or reason
            self._queue.discard(lambda _: True)
            self._changed.notify_all()

    def _await(self, batch: Batch, should_stop: Callable[[], bool]) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: batch.ended or self.closed, _GLANCE)
                if batch.missing == 0:
                    return
                if batch.error is not None:
                    raise batch.error
                self._refuse_if_closed()
            if should_stop():
                self._drop(batch)
                raise EvaluationStopped

    def _drop(self, batch: Batch) -> None:
        with self._changed:
            batch.dropped = True
            self._queue.discard(lambda work: work.batch is batch)

    def _refuse_if_closed(self) -> None:
        if self._closed is not None:
            raise EvaluatorUnavailable(self._closed)
