"""Recent activity of the jobs run by this process: iterations, tasks by worker, and log messages

Bounded, in memory, and lost with the process; results do not depend on it
(docs/decisions/0023-monitoring.md).
"""

from __future__ import annotations

import logging
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Final, cast

from gaitswarm.services.optimizer.log_context import log_fields
from gaitswarm.services.optimizer.run.evaluator import (
    EvaluationRequest,
    Evaluator,
    TaskReport,
    place_of,
)
from gaitswarm.sim.outcome import Outcome

_JOBS: Final = 32
"""Number of jobs remembered, the most recently active ones."""

_ITERATIONS: Final = 200
_TASKS: Final = 2000
_MESSAGES: Final = 200
_LONGEST_MESSAGE: Final = 2000
"""Characters of a message."""


@dataclass(frozen=True, slots=True)
class IterationSpan:
    """Evaluation of an iteration.

    Attributes:
        begun: Unix time [s].
        seconds: duration [s]; None while in progress.
        error: cause of failure; None for a result or while in progress.
    """

    iteration: int
    begun: float
    designs: int
    seconds: float | None = None
    error: str | None = None


@dataclass(frozen=True, slots=True)
class TaskSpan:
    """A task of an iteration, as run by a worker.

    Attributes:
        worker: name of the worker's machine; "" without an answer.
        begun: Unix time of the dispatch [s].
        seconds: from the dispatch to the answer [s].
        compute_seconds: computing time [s].
        walks: number of simulations.
        error: cause of failure; None for a result.
    """

    iteration: int
    worker: str
    begun: float
    seconds: float
    compute_seconds: float
    walks: int
    error: str | None = None


@dataclass(frozen=True, slots=True)
class Message:
    """A log message.

    Attributes:
        at: Unix time [s].
        level: such as "WARNING".
        iteration: None if it belongs to none.
    """

    at: float
    level: str
    text: str
    iteration: int | None = None


@dataclass(frozen=True, slots=True)
class WorkerHealth:
    """Statistics of a machine that has run tasks of a job.

    Attributes:
        name: of the machine; "" for tasks without an answer.
        walks: simulations in these tasks.
        compute_seconds: total computing time [s].
        last_seen: Unix time of the last answer [s].
        error: of the last failed task; None if there is none.
    """

    name: str
    tasks: int = 0
    walks: int = 0
    failures: int = 0
    compute_seconds: float = 0.0
    last_seen: float = 0.0
    error: str | None = None

    def after(self, task: TaskSpan) -> WorkerHealth:
        """Return the statistics with another task."""
        failed = task.error is not None
        return replace(
            self,
            tasks=self.tasks + 1,
            walks=self.walks + (0 if failed else task.walks),
            failures=self.failures + failed,
            compute_seconds=self.compute_seconds + task.compute_seconds,
            last_seen=task.begun + task.seconds,
            error=task.error if failed else self.error,
        )


@dataclass(frozen=True, slots=True)
class JobActivity:
    """Recent activity of a job in this process."""

    iterations: tuple[IterationSpan, ...] = ()
    tasks: tuple[TaskSpan, ...] = ()
    messages: tuple[Message, ...] = ()
    workers: tuple[WorkerHealth, ...] = ()


@dataclass(slots=True)
class _Records:
    iterations: deque[IterationSpan] = field(default_factory=lambda: deque(maxlen=_ITERATIONS))
    tasks: deque[TaskSpan] = field(default_factory=lambda: deque(maxlen=_TASKS))
    messages: deque[Message] = field(default_factory=lambda: deque(maxlen=_MESSAGES))
    workers: dict[str, WorkerHealth] = field(default_factory=dict)


class Activity:
    """Recent activity of the most recently active jobs. Thread-safe."""

    def __init__(self, clock: Callable[[], float] = time.time) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._jobs: OrderedDict[str, _Records] = OrderedDict()

    def of(self, job_id: str) -> JobActivity | None:
        """Return the activity of a job."""
        with self._lock:
            records = self._jobs.get(job_id)
            if records is None:
                return None
            workers = tuple(records.workers[name] for name in sorted(records.workers))
            return JobActivity(
                tuple(records.iterations), tuple(records.tasks), tuple(records.messages), workers
            )

    def watched_evaluator(self, inner: Evaluator) -> Evaluator:
        """Wrap an evaluator so that its requests are recorded."""
        return cast(Evaluator, _WatchedEvaluator(inner, self))

    @contextmanager
    def recorded_log(self) -> Iterator[None]:
        """Record log messages that belong to jobs, inside the block."""
        handler = _LogRecorder(self)
        root = logging.getLogger()
        root.addHandler(handler)
        try:
            yield
        finally:
            root.removeHandler(handler)

    def begun(self, request: EvaluationRequest) -> None:
        """Record the start of an evaluation."""
        span = IterationSpan(request.iteration, self._clock(), len(request.designs))
        with self._lock:
            self._of(request.job_id).iterations.append(span)

    def ended(self, request: EvaluationRequest, error: str | None) -> None:
        """Record the end of an evaluation."""
        now = self._clock()
        with self._lock:
            spans = self._of(request.job_id).iterations
            if spans and spans[-1].iteration == request.iteration:
                span = spans.pop()
                spans.append(replace(span, seconds=now - span.begun, error=error))

    def task(self, request: EvaluationRequest, report: TaskReport) -> None:
        span = TaskSpan(
            request.iteration,
            report.host,
            self._clock() - report.seconds,
            report.seconds,
            report.compute_seconds,
            report.walks,
            report.error,
        )
        with self._lock:
            records = self._of(request.job_id)
            records.tasks.append(span)
            health = records.workers.get(span.worker, WorkerHealth(span.worker))
            records.workers[span.worker] = health.after(span)

    def message(self, job_id: str, message: Message) -> None:
        with self._lock:
            self._of(job_id).messages.append(message)

    def _of(self, job_id: str) -> _Records:
        """The caller holds the lock."""
        records = self._jobs.setdefault(job_id, _Records())
        self._jobs.move_to_end(job_id)
        while len(self._jobs) > _JOBS:
            self._jobs.popitem(last=False)
        return records


class _WatchedEvaluator:
    def __init__(self, inner: Evaluator, activity: Activity) -> None:
        self._inner = inner
        self._activity = activity

    @property
    def slots(self) -> int:
        return self._inner.slots

    @property
    def place(self) -> str | None:
        return place_of(self._inner)

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        def on_task(report: TaskReport) -> None:
            self._activity.task(request, report)
            if request.on_task is not None:
                request.on_task(report)

        self._activity.begun(request)
        try:
            outcomes = self._inner.evaluate(replace(request, on_task=on_task), should_stop)
        except BaseException as error:
            self._activity.ended(request, f"{type(error).__name__}: {error}".rstrip(": "))
            raise
        self._activity.ended(request, None)
        return outcomes

    def close(self) -> None:
        self._inner.close()


class _LogRecorder(logging.Handler):
    """Records log messages whose context has a job."""

    def __init__(self, activity: Activity) -> None:
        super().__init__()
        self._activity = activity

    def emit(self, record: logging.LogRecord) -> None:
        fields = log_fields()
        job_id, iteration = fields.get("job"), fields.get("iteration")
        if not isinstance(job_id, str):
            return
        try:
            text = record.getMessage()
        except (TypeError, ValueError):
            text = str(record.msg)
        if record.exc_info and record.exc_info[1] is not None:
            error = record.exc_info[1]
            text = f"{text}: {type(error).__name__}: {error}"
        self._activity.message(
            job_id,
            Message(
                record.created,
                record.levelname,
                text[:_LONGEST_MESSAGE],
                iteration if isinstance(iteration, int) else None,
            ),
        )
