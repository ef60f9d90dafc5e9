"""What happens to a job while it runs."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Literal

from pydantic import Field

from gaitswarm.services.monitoring.activity import (
    IterationSpan,
    JobActivity,
    Message,
    TaskSpan,
    WorkerHealth,
)
from gaitswarm.views.base import View

Level = Literal["DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL"]

_LEVELS: tuple[Level, ...] = ("DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL")


class IterationSpanView(View):
    """An iteration as it was evaluated."""

    iteration: int = Field(description="Index of the iteration, from 0.", examples=[3])
    begun_at: datetime = Field(description="When it was given to the workers, UTC.")
    seconds: float | None = Field(
        description="From then to its end [s]; null while it is under way.", examples=[0.61]
    )
    designs: int = Field(description="Designs that walked for it [1].", examples=[25])
    error: str | None = Field(
        description="Why it has no result; null if it has one, or is under way.", examples=[None]
    )

    @classmethod
    def from_span(cls, span: IterationSpan) -> IterationSpanView:
        """Make a view of an iteration."""
        return cls(
            iteration=span.iteration,
            begun_at=_time(span.begun),
            seconds=span.seconds,
            designs=span.designs,
            error=span.error,
        )


class TaskSpanView(View):
    """Some walks of an iteration, as a worker ran them."""

    iteration: int = Field(description="Index of the iteration, from 0.", examples=[3])
    worker: str = Field(
        description="Name of the worker's machine; empty if it did not answer.", examples=["node-1"]
    )
    begun_at: datetime = Field(description="When the worker was given them, UTC.")
    seconds: float = Field(description="From then to its answer [s].", examples=[0.52])
    compute_seconds: float = Field(
        description="Of these, how long the worker computed [s].", examples=[0.5]
    )
    walks: int = Field(description="Number of the walks [1].", examples=[48])
    error: str | None = Field(
        description="Why there is no result; null if there is one.", examples=[None]
    )

    @classmethod
    def from_span(cls, span: TaskSpan) -> TaskSpanView:
        """Make a view of a task."""
        return cls(
            iteration=span.iteration,
            worker=span.worker,
            begun_at=_time(span.begun),
            seconds=span.seconds,
            compute_seconds=span.compute_seconds,
            walks=span.walks,
            error=span.error,
        )


class WorkerHealthView(View):
    """A machine that has run walks of the job."""

    name: str = Field(
        description="Name of the machine; empty for tasks that nobody answered.",
        examples=["node-1"],
    )
    tasks: int = Field(description="Tasks that it has ended [1].", examples=[120])
    walks: int = Field(description="Walks of those that have a result [1].", examples=[5760])
    failures: int = Field(description="Of the tasks, those without a result [1].", examples=[0])
    compute_seconds: float = Field(description="Time that it has computed [s].", examples=[61.2])
    last_seen_at: datetime = Field(description="When it answered last, UTC.")
    error: str | None = Field(
        description="Of the last task without a result; null if all have one.", examples=[None]
    )

    @classmethod
    def from_health(cls, health: WorkerHealth) -> WorkerHealthView:
        """Make a view of a worker."""
        return cls(
            name=health.name,
            tasks=health.tasks,
            walks=health.walks,
            failures=health.failures,
            compute_seconds=health.compute_seconds,
            last_seen_at=_time(health.last_seen),
            error=health.error,
        )


class MessageView(View):
    """A line of the log."""

    at: datetime = Field(description="When it was written, UTC.")
    level: str = Field(description="How grave it is.", examples=["WARNING"])
    text: str = Field(description="What it says.", examples=["job k2q7zr5dm9xw waits"])
    iteration: int | None = Field(
        description="Iteration to which it belongs, from 0; null for none.", examples=[3]
    )

    @classmethod
    def from_message(cls, message: Message) -> MessageView:
        """Make a view of a message."""
        return cls(
            at=_time(message.at),
            level=message.level,
            text=message.text,
            iteration=message.iteration,
        )


class ActivityView(View):
    """The last of what happened to a job in the process that answers."""

    id: str = Field(description="Identifier of the job.", examples=["k2q7zr5dm9xw"])
    reason: str | None = Field(
        description="Why nothing is known, for people; null if something is.", examples=[None]
    )
    workers: list[WorkerHealthView] = Field(description="Machines that have run its walks.")
    iterations: list[IterationSpanView] = Field(
        description="Iterations that were evaluated last, in the order in which they began."
    )
    tasks: list[TaskSpanView] = Field(
        description="Tasks that ended last, in that order: walks that a worker ran together."
    )
    messages: list[MessageView] = Field(description="Lines of the log, the oldest first.")

    @classmethod
    def from_activity(
        cls, job_id: str, known: JobActivity | None, level: Level, *, runs_jobs: bool
    ) -> ActivityView:
        """Make a view of a job's run."""
        found = known or JobActivity()
        grave = _LEVELS[_LEVELS.index(level) :]
        return cls(
            id=job_id,
            reason=None if known is not None else _why_nothing(runs_jobs=runs_jobs),
            workers=[WorkerHealthView.from_health(worker) for worker in found.workers],
            iterations=[IterationSpanView.from_span(span) for span in found.iterations],
            tasks=[TaskSpanView.from_span(span) for span in found.tasks],
            messages=[MessageView.from_message(m) for m in found.messages if m.level in grave],
        )


def _why_nothing(*, runs_jobs: bool) -> str:
    if not runs_jobs:
        return "this server runs no jobs; whoever runs this one has its log"
    return (
        "this server has not run the job since it was started: another process does, or it has not"
        " begun, or it ended before"
    )


def _time(seconds: float) -> datetime:
    return datetime.fromtimestamp(seconds, UTC)
