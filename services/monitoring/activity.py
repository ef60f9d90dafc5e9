"""Recent activity of this process's jobs, in bounded memory (docs/decisions/0023-monitoring.md)"""

from __future__ import annotations

import logging
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import partial
from typing import Final

from pydantic import Field

from gaitswarm.services.optimizer.log_context import log_fields
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, OnTask, TaskReport
from gaitswarm.services.optimizer.views import IterationIndex, View

_JOBS: Final = 32
"""Number of jobs remembered, the most recently active ones."""

_ITERATIONS: Final = 200
_TASKS: Final = 2000
_MESSAGES: Final = 200
_LONGEST_MESSAGE: Final = 2000
"""Characters of a message."""


class IterationSpanView(View):
    """An iteration as it was evaluated."""

    iteration: IterationIndex
    begun_at: datetime = Field(description="When it was sent to the workers, UTC.")
    designs: int = Field(description="Designs simulated for it [1].", examples=[25])
    seconds: float | None = Field(examples=[0.61])
    """Duration [s]; null while in progress."""
    error: str | None
    """Why it has no result; null for a result or while in progress."""


class TaskSpanView(View):
    """A task: simulations of an iteration that a worker ran together."""

    iteration: IterationIndex
    worker: str = Field(examples=["node-1"])
    """Name of the worker's machine; empty without an answer."""
    begun_at: datetime = Field(description="When the worker received it, UTC.")
    seconds: float = Field(description="From then to its answer [s].", examples=[0.52])
    compute_seconds: float = Field(description="Computing time of these [s].", examples=[0.5])
    walks: int = Field(description="Number of simulations [1].", examples=[48])
    error: str | None = Field(description="Why there is no result; null if there is one.")


class WorkerHealthView(View):
    """A machine that has run tasks of the job."""

    name: str = Field(examples=["node-1"])
    """Name of the machine; empty for tasks without an answer."""
    tasks: int = Field(description="Ended tasks [1].", examples=[120])
    walks: int = Field(description="Simulations with a result [1].", examples=[5760])
    failures: int = Field(description="Tasks without a result [1].", examples=[0])
    compute_seconds: float = Field(description="Computing time [s].", examples=[61.2])
    last_seen_at: datetime = Field(description="When it answered last, UTC.")
    error: str | None
    """Of the last task without a result; null if all have one."""


class MessageView(View):
    """A line of the log."""

    at: datetime = Field(description="When it was written, UTC.")
    level: str = Field(description="Severity.", examples=["WARNING"])
    text: str = Field(description="Text of the message.", examples=["job k2q7zr5dm9xw waits"])
    iteration: int | None = Field(description="Iteration of the job, from 0; null for none.")


@dataclass(slots=True)
class JobActivity:
    """Recent activity of a job in this process; workers by name."""

    iterations: deque[IterationSpanView] = field(default_factory=lambda: deque(maxlen=_ITERATIONS))
    tasks: deque[TaskSpanView] = field(default_factory=lambda: deque(maxlen=_TASKS))
    messages: deque[MessageView] = field(default_factory=lambda: deque(maxlen=_MESSAGES))
    workers: dict[str, WorkerHealthView] = field(default_factory=dict)


class Activity:
    """Recent activity of the most recently active jobs. Thread-safe."""

    def __init__(self, clock: Callable[[], float] = time.time) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._jobs: OrderedDict[str, JobActivity] = OrderedDict()

    def of(self, job_id: str) -> JobActivity | None:
        """Return a copy of a job's activity."""
        with self._lock:
            job = self._jobs.get(job_id)
            if job is None:
                return None
            workers = dict(sorted(job.workers.items()))
            return JobActivity(
                job.iterations.copy(), job.tasks.copy(), job.messages.copy(), workers
            )

    @contextmanager
    def observed(self, request: EvaluationRequest) -> Iterator[OnTask]:
        """Record an evaluation and its tasks."""
        span = IterationSpanView(
            iteration=request.iteration,
            begun_at=self._now(),
            designs=len(request.designs),
            seconds=None,
            error=None,
        )
        with self._lock:
            self._of(request.job_id).iterations.append(span)
        error = None
        try:
            yield partial(self.task, request)
        except BaseException as raised:
            error = f"{type(raised).__name__}: {raised}".rstrip(": ")
            raise
        finally:
            seconds = (self._now() - span.begun_at).total_seconds()
            with self._lock:
                spans = self._of(request.job_id).iterations
                if spans and spans[-1] is span:
                    spans[-1] = span.model_copy(update={"seconds": seconds, "error": error})

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

    def task(self, request: EvaluationRequest, report: TaskReport) -> None:
        span = TaskSpanView(
            iteration=request.iteration,
            worker=report.host,
            begun_at=self._now() - timedelta(seconds=report.seconds),
            seconds=report.seconds,
            compute_seconds=report.compute_seconds,
            walks=report.walks,
            error=report.error,
        )
        with self._lock:
            job = self._of(request.job_id)
            job.tasks.append(span)
            before, failed = job.workers.get(span.worker), span.error is not None
            job.workers[span.worker] = WorkerHealthView(
                name=span.worker,
                tasks=(before.tasks if before else 0) + 1,
                walks=(before.walks if before else 0) + (0 if failed else span.walks),
                failures=(before.failures if before else 0) + failed,
                compute_seconds=(before.compute_seconds if before else 0) + span.compute_seconds,
                last_seen_at=span.begun_at + timedelta(seconds=span.seconds),
                error=span.error or (before.error if before else None),
            )

    def message(self, job_id: str, message: MessageView) -> None:
        with self._lock:
            self._of(job_id).messages.append(message)

    def _now(self) -> datetime:
        return datetime.fromtimestamp(self._clock(), UTC)

    def _of(self, job_id: str) -> JobActivity:
        """The caller holds the lock."""
        job = self._jobs.setdefault(job_id, JobActivity())
        self._jobs.move_to_end(job_id)
        while len(self._jobs) > _JOBS:
            self._jobs.popitem(last=False)
        return job


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
            MessageView(
                at=datetime.fromtimestamp(record.created, UTC),
                level=record.levelname,
                text=text[:_LONGEST_MESSAGE],
                iteration=iteration if isinstance(iteration, int) else None,
            ),
        )
