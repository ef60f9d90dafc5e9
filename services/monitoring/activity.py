"""What happens to the jobs that this process runs: iterations, tasks by worker, and messages.

Kept in memory, a bounded part of it, and gone with the process: nothing that a job comes to depends
on it (docs/decisions/0023-monitoring.md).
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
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, Evaluator, TaskReport
from gaitswarm.sim.outcome import Outcome

_JOBS: Final = 32
"""Jobs of which anything is known: those that were heard of last."""

_ITERATIONS: Final = 200
_TASKS: Final = 2000
_MESSAGES: Final = 200
_LONGEST_MESSAGE: Final = 2000
"""Characters of a message that are kept."""


@dataclass(frozen=True, slots=True)
class IterationSpan:
    """An iteration as it was evaluated.

    Attributes:
        iteration: Index, from 0.
        begun: When it was, in seconds since 1970 [s].
        seconds: From then to its end [s]; None while it is under way.
        designs: That walk for it.
        error: Why it has no result; None if it has one, or is under way.
    """

    iteration: int
    begun: float
    designs: int
    seconds: float | None = None
    error: str | None = None


@dataclass(frozen=True, slots=True)
class TaskSpan:
    """Some walks of an iteration, as a worker ran them.

    Attributes:
        iteration: Index, from 0.
        worker: Name of the worker's machine; "" if it did not answer.
        begun: When it was given them, in seconds since 1970 [s].
        seconds: From then to its answer [s].
        compute_seconds: Of these, how long it computed [s].
        walks: Their number.
        error: Why there is no result; None if there is one.
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
    """A line of the log.

    Attributes:
        at: When it was written, in seconds since 1970 [s].
        level: Such as "WARNING".
        text: What it says.
        iteration: To which it belongs, if to any.
    """

    at: float
    level: str
    text: str
    iteration: int | None = None


@dataclass(frozen=True, slots=True)
class WorkerHealth:
    """A machine that has run walks of a job.

    Attributes:
        name: Of the machine; "" for tasks that nobody answered.
        tasks: That it has ended.
        walks: Of these tasks.
        failures: Of the tasks, those without a result.
        compute_seconds: That it has computed [s].
        last_seen: When it answered last, in seconds since 1970 [s].
        error: Of the last task without a result; None if all have one.
    """

    name: str
    tasks: int = 0
    walks: int = 0
    failures: int = 0
    compute_seconds: float = 0.0
    last_seen: float = 0.0
    error: str | None = None

    def after(self, task: TaskSpan) -> WorkerHealth:
        """With another task."""
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
    """What is known of a job's run here; the last of each.

    Attributes:
        iterations: In the order in which they began.
        tasks: In the order in which they ended.
        messages: The oldest first.
        workers: By name, over all of the run here.
    """

    iterations: tuple[IterationSpan, ...] = ()
    tasks: tuple[TaskSpan, ...] = ()
    messages: tuple[Message, ...] = ()
    workers: tuple[WorkerHealth, ...] = ()


@dataclass(slots=True)
class _Kept:
    iterations: deque[IterationSpan] = field(default_factory=lambda: deque(maxlen=_ITERATIONS))
    tasks: deque[TaskSpan] = field(default_factory=lambda: deque(maxlen=_TASKS))
    messages: deque[Message] = field(default_factory=lambda: deque(maxlen=_MESSAGES))
    workers: dict[str, WorkerHealth] = field(default_factory=dict)


class Activity:
    """The last of what happened to the jobs that were heard of last. Thread-safe."""

    def __init__(self, clock: Callable[[], float] = time.time) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._jobs: OrderedDict[str, _Kept] = OrderedDict()

    def of(self, job_id: str) -> JobActivity | None:
        """What is known of a job."""
        with self._lock:
            kept = self._jobs.get(job_id)
            if kept is None:
                return None
            workers = tuple(kept.workers[name] for name in sorted(kept.workers))
            return JobActivity(
                tuple(kept.iterations), tuple(kept.tasks), tuple(kept.messages), workers
            )

    def watched_evaluator(self, inner: Evaluator) -> Evaluator:
        """Wrap an evaluator, so that what it is asked for is taken note of."""
        return cast(Evaluator, _WatchedEvaluator(inner, self))

    @contextmanager
    def log_kept(self) -> Iterator[None]:
        """Take note of messages that belong to a job, as far as the log has them, in the block."""
        handler = _Keeper(self)
        root = logging.getLogger()
        root.addHandler(handler)
        try:
            yield
        finally:
            root.removeHandler(handler)

    def begun(self, request: EvaluationRequest) -> None:
        """Note that an iteration is evaluated."""
        span = IterationSpan(request.iteration, self._clock(), len(request.designs))
        with self._lock:
            self._of(request.job_id).iterations.append(span)

    def ended(self, request: EvaluationRequest, error: str | None) -> None:
        """Note what came of it."""
        now = self._clock()
        with self._lock:
            spans = self._of(request.job_id).iterations
            if spans and spans[-1].iteration == request.iteration:
                span = spans.pop()
                spans.append(replace(span, seconds=now - span.begun, error=error))

    def task(self, request: EvaluationRequest, report: TaskReport) -> None:
        """Note a task that has ended."""
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
            kept = self._of(request.job_id)
            kept.tasks.append(span)
            known = kept.workers.get(span.worker, WorkerHealth(span.worker))
            kept.workers[span.worker] = known.after(span)

    def message(self, job_id: str, message: Message) -> None:
        """Note a line of the log."""
        with self._lock:
            self._of(job_id).messages.append(message)

    def _of(self, job_id: str) -> _Kept:
        """The caller holds the lock."""
        kept = self._jobs.setdefault(job_id, _Kept())
        self._jobs.move_to_end(job_id)
        while len(self._jobs) > _JOBS:
            self._jobs.popitem(last=False)
        return kept


class _WatchedEvaluator:
    def __init__(self, inner: Evaluator, activity: Activity) -> None:
        self._inner = inner
        self._activity = activity

    @property
    def slots(self) -> int:
        return self._inner.slots

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        def on_task(report: TaskReport) -> None:
            self._activity.task(request, report)
            if request.on_task is not None:
                request.on_task(report)

        self._activity.begun(request)
        try:
            found = self._inner.evaluate(replace(request, on_task=on_task), should_stop)
        except BaseException as error:
            self._activity.ended(request, f"{type(error).__name__}: {error}".rstrip(": "))
            raise
        self._activity.ended(request, None)
        return found

    def close(self) -> None:
        self._inner.close()


class _Keeper(logging.Handler):
    """Takes note of what is logged in the name of a job."""

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
